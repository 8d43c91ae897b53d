"""What a drawing says is kept, in each format: names, roles, folders, shapes, heights, points."""

import json
from pathlib import Path

import pytest

pytest.importorskip("shapely")
pytest.importorskip("shapefile")
import shapefile
from drawings import feature, imported
from drawn_files import (
    MIDDLE,
    ZONE,
    drawn,
    kept,
    kml,
    layer,
    line,
    of,
    placemark,
    polygon,
    refusal,
    ring,
)
from random_drawings import AREA, HOME, mission

from uas_coverage_env.flight import load_planner, rollout
from uas_coverage_env.flight.metrics import accomplished
from uas_coverage_env.operations import DrawnPolygon, LocalFrame, read_drawings
from uas_coverage_env.operations.area_import.drawn_areas import LeftOut

pytestmark = pytest.mark.usefixtures("elsewhere")

ATTRIBUTES = {
    "the field's case": {"Name": "no-fly school", "Description": None},
    "shouted": {"NAME": "NO-FLY ZONE 3"},
    "a role in capitals": {"ROLE": "No_Fly", "Name": "school"},
    "NFZ": {"name": "NFZ school"},
    "in brackets": {"name": "school (no-fly)"},
    "one word": {"name": "NoFlyZone"},
    "with numbers": {"name": "nfz_12"},
    "a title": {"title": "Keep out"},
    "a kind": {"name": "school", "type": "NO FLY ZONE"},
    "a category": {"name": "hospital", "Category": "restricted"},
    "a description alone": {"name": "school", "description": "No-fly zone."},
    "a remark alone": {"name": "school", "Bemerkung": "NFZ"},
    "a key": {"name": "school", "no_fly": "yes"},
    "another language": {"name": "Flugverbotszone Grundschule"},
    "nothing but a role": {"Role": "nfz"},
    "a role in words": {"role": "no-fly zone"},
    "tags within": {"tags": {"Role": "no_fly"}},
}


# ---- what names and roles say -------------------------------------------------------------------


@pytest.mark.parametrize("case", ATTRIBUTES)
def test_a_zone_is_one_however_its_keys_and_words_are_written_in_geojson(case):
    properties = ATTRIBUTES[case]
    zone = {**feature(ZONE), "properties": properties}
    assert kept(drawn(zone), 109.0)[0] > 5.0


@pytest.mark.parametrize("case", [case for case in ATTRIBUTES if case != "tags within"])
@pytest.mark.parametrize("element", ["Data", "SimpleData"])
def test_a_zone_is_one_however_its_keys_and_words_are_written_in_kml(case, element):
    data = {key: value for key, value in ATTRIBUTES[case].items() if value}
    said = "".join(
        f'<Data name="{k}"><value>{v}</value></Data>'
        if element == "Data"
        else f'<SchemaData><SimpleData name="{k}">{v}</SimpleData></SchemaData>'
        for k, v in data.items()
    )
    zone = f"<Placemark><ExtendedData>{said}</ExtendedData>{polygon(ZONE)}</Placemark>"
    assert kept(kml(zone), 109.0)[0] > 5.0


@pytest.mark.parametrize(
    "name", ["Smith's airfield", "unrestricted", "confluence", "avoidable", "NFZone", "noflyer"]
)
def test_words_count_as_whole_words(name):
    (_, area) = read_drawings(drawn(feature(ZONE, name=name)))
    assert isinstance(area, DrawnPolygon)
    assert area.role == "search"


def test_a_role_that_is_given_counts_against_the_name_and_that_is_said():
    depth, said = kept(drawn(feature(ZONE, name="NFZ school", role="search")))
    assert depth < 0.0
    assert "the role 'search' counts, against the name 'NFZ school'" in said


def test_a_name_that_says_two_things_is_refused_unless_a_role_is_given():
    tower_home = of("Point", [8.003, 50.0001], name="home at the tower", height=30)
    assert "its name says home and obstacle" in refusal(drawn(tower_home))
    tower_home["properties"]["role"] = "obstacle"
    tower_home["properties"]["radius_m"] = 4
    assert kept(drawn(tower_home))[0] < 0.0


@pytest.mark.parametrize("nesting", [0, 1, 4])
@pytest.mark.parametrize("folder", ["no-fly", "NFZ", "No fly zones 2024", "Restricted areas"])
def test_folders_of_kml_hand_their_role_on(folder, nesting):
    zone = placemark("school", polygon(ZONE))
    for _ in range(nesting):
        zone = f"<Folder><name>more</name>{zone}</Folder>"
    assert kept(kml(f"<Folder><name>{folder}</name>{zone}</Folder>"), 109.0)[0] > 5.0


def test_a_folder_may_hold_its_role_as_data_and_an_inner_one_says_something_else():
    role = '<ExtendedData><Data name="Role"><value>no_fly</value></Data></ExtendedData>'
    inside = f"<Folder><name>x</name>{role}{placemark('school', polygon(ZONE))}</Folder>"
    assert kept(kml(inside))[0] > 30.0
    searched = placemark("survey north", polygon(ZONE))
    assert kept(kml(f"<Folder><name>no-fly</name>{searched}</Folder>"))[0] < 0.0
    both = f"<Folder><name>Survey with no-fly zones</name>{placemark('x', polygon(ZONE))}</Folder>"
    assert "says no_fly and search" in refusal(kml(both))


def test_a_file_called_after_its_role_hands_it_on():
    Path("no-fly_zones.geojson").write_text(json.dumps(feature(ZONE, name="school")))
    assert kept([*drawn(), "no-fly_zones.geojson"])[0] > 30.0
    named = {"type": "FeatureCollection", "name": "NFZ", "features": [feature(ZONE)]}
    Path("more.geojson").write_text(json.dumps(named))
    assert kept([*drawn(), "more.geojson"])[0] > 30.0


# ---- shapes -------------------------------------------------------------------------------------


ROUGHLY = [*ZONE[:-1], [8.00151, 50.00101]]  # a path clicked by hand


@pytest.mark.parametrize("corners", [ZONE, ROUGHLY])
@pytest.mark.parametrize("said", [{"role": "no_fly"}, {"name": "no-fly school"}])
def test_a_zone_drawn_as_a_closed_line_is_closed_in_each_format(corners, said):
    name = said.get("name", "school")
    data = {key: value for key, value in said.items() if key != "name"}
    assert kept(kml(placemark(name, line(corners), **data)), 109.0)[0] > 5.0
    assert kept(drawn(of("LineString", corners, **said)), 109.0)[0] > 5.0
    within = {"type": "LineString", "coordinates": corners}
    mixed = {"type": "GeometryCollection", "geometries": [within]}
    many = {"type": "Feature", "properties": said, "geometry": mixed}
    assert kept(drawn(many), 109.0)[0] > 5.0
    layer("areas", shapefile.POLYLINE, [({"name": name, **data}, [corners])])
    assert kept([*drawn(), "areas.shp"], 109.0)[0] > 5.0


@pytest.mark.parametrize("role", ["no_fly", "fence"])
@pytest.mark.parametrize(
    ("kind", "places"),
    [
        ("LineString", ZONE[:3]),
        ("MultiLineString", [ZONE[:3]]),
        ("Point", list(MIDDLE)),
        ("MultiPoint", [list(MIDDLE)]),
        ("Polygon", []),
    ],
)
def test_an_open_line_a_point_or_nothing_is_refused_where_no_uas_may_fly(role, kind, places):
    for said in ({"role": role}, {"name": role.replace("_", "-")}):
        line_ = refusal(drawn(of(kind, places, **said)))
        assert line_.startswith("area.geojson: ")
        assert f"says {role}, but it" in line_
        assert "draw" in line_
    shape = {"LineString": line(ZONE[:3]), "Point": line([MIDDLE], "Point")}.get(kind)
    if shape:
        assert "draw a polygon" in refusal(kml(placemark("x", shape, Role=role)))


def test_a_point_with_a_radius_and_a_line_with_a_width_have_outlines():
    circle = of("Point", list(MIDDLE), name="NFZ", radius_m=40)
    assert kept(drawn(circle))[0] == pytest.approx(40.0, abs=0.5)
    strip = of("LineString", [[8.0015, 50.0015], [8.0025, 50.0015]], role="no_fly", width="30 m")
    assert kept(drawn(strip))[0] == pytest.approx(15.0, abs=0.1)
    circle["properties"]["radius_m"] = "wide"
    assert "radius 'wide'; give it in metres" in refusal(drawn(circle))


EMPTY = [
    None,
    {},
    {"type": "Point", "coordinates": []},
    {"type": "Point", "coordinates": None},
    {"type": "Polygon", "coordinates": []},
    {"type": "Polygon", "coordinates": [[]]},
    {"type": "MultiPolygon", "coordinates": []},
    {"type": "MultiPolygon", "coordinates": [[]]},
    {"type": "MultiPolygon", "coordinates": [[[]]]},
    {"type": "MultiLineString", "coordinates": [[]]},
    {"type": "LineString", "coordinates": []},
    {"type": "MultiPoint", "coordinates": []},
    {"type": "GeometryCollection", "geometries": []},
    {"type": "GeometryCollection", "geometries": [{"type": "Point", "coordinates": []}]},
]
EMPTY_KML = [
    "<Point><coordinates/></Point>",
    "<Point><coordinates> \n </coordinates></Point>",
    "<Point/>",
    "<LineString><coordinates/></LineString>",
    "<Polygon/>",
    "<Polygon><outerBoundaryIs><LinearRing/></outerBoundaryIs></Polygon>",
    "<Polygon><outerBoundaryIs><LinearRing><coordinates/></LinearRing></outerBoundaryIs></Polygon>",
    "<LinearRing><coordinates/></LinearRing>",
    "<MultiGeometry/>",
    "<MultiGeometry><Point/><Polygon/></MultiGeometry>",
    "",
]


@pytest.mark.parametrize("geometry", EMPTY)
def test_empty_geometry_of_geojson_is_counted_and_named(geometry):
    label = {"type": "Feature", "properties": {"name": "label"}, "geometry": geometry}
    assert "left out: 1 empty geometry 'label'" in kept(drawn(label))[1]


@pytest.mark.parametrize("geometry", EMPTY_KML)
def test_empty_geometry_of_kml_is_counted_and_named(geometry):
    said = kept(kml(placemark("label", geometry)))[1]
    assert "left out: " in said
    assert "'label'" in said


def test_several_geometries_of_a_placemark_all_count():
    shapes = (
        polygon(ZONE)
        + line(AREA)
        + polygon([[8.003, 50.0001], [8.0035, 50.0001], [8.003, 50.0004]])
    )
    paths = kml(placemark("no-fly", f"<MultiGeometry>{shapes}</MultiGeometry>"))
    zones = [
        thing
        for thing in read_drawings([Path(path) for path in paths])
        if getattr(thing, "role", "") == "no_fly"
    ]
    assert len(zones) == 3


@pytest.mark.parametrize("tag", ["NetworkLink", "GroundOverlay", "ScreenOverlay", "PhotoOverlay"])
def test_what_kml_only_points_at_is_named_and_refused_where_it_says_no_fly(tag):
    link = "<{0}><name>{1}</name><Link><href>more.kml</href></Link></{0}>"
    assert f"left out: 1 {tag} 'more'" in kept(kml(link.format(tag, "more")))[1]
    said = refusal(kml(link.format(tag, "no-fly zones")))
    assert f"says no_fly, but it is a {tag}, which is not read" in said


def test_a_model_of_a_building_is_refused():
    place = "<Location><longitude>8.002</longitude><latitude>50.0015</latitude></Location>"
    assert "a Model, which is not read" in refusal(kml(placemark("x", f"<Model>{place}</Model>")))


# ---- what is solid ------------------------------------------------------------------------------


SOLID = {
    "a role and a height": {"role": "obstacle", "height_m": 60},
    "a kind as a role": {"role": "tower", "Height": "60 m"},
    "a word and a height": {"name": "radio tower", "HEIGHT": "197 ft"},
    "a tag": {"man_made": "chimney", "height": "ca. 60 m"},
    "a building of 20 levels": {"building": "yes", "building:levels": "20"},
    "nothing but a height": {"name": "thing", "height": 60},
    "a tag without a height": {"man_made": "tower"},
    "a height in its name": {"name": "Tower 2 (60 m)"},
    "feet in its name": {"name": "chimney 197ft"},
    "a kind": {"kind": "chimney", "name": "x", "height": "50-60 m"},
}


@pytest.mark.parametrize("case", SOLID)
def test_something_solid_is_an_obstacle_up_to_its_height(case):
    solid = drawn({**feature(ZONE), "properties": SOLID[case]})
    assert kept(solid, 59.0)[0] > 0.0
    assert kept(solid, 102.0)[0] < 0.0


def test_a_point_is_as_wide_as_its_kind_or_as_it_is_said_to_be():
    mast = of("Point", list(MIDDLE), name="mast", height=50)
    assert kept(drawn(mast), 20.0)[0] == pytest.approx(3.0, abs=0.2)
    mast["properties"]["diameter"] = 30
    assert kept(drawn(mast), 20.0)[0] == pytest.approx(15.0, abs=0.5)


def test_the_height_in_the_name_of_a_point_counts_before_that_of_its_kind():
    mast = of("Point", list(MIDDLE), name="Radio mast 105 m")
    assert kept(drawn(mast), 104.0)[0] > 0.0
    mast["properties"]["name"] = "mast 3, 20 m"
    assert kept(drawn(mast), 24.0)[0] < 0.0


def test_an_area_called_after_something_solid_is_refused_without_height_or_role():
    site = feature(ZONE, name="Tower meadow")
    assert "says an obstacle, but its height is not given" in refusal(drawn(site))
    site["properties"]["role"] = "search"
    assert kept(drawn(site))[0] < 0.0


def test_an_obstacle_without_a_height_or_of_unknown_size_is_refused():
    assert "has no height; give height_m" in refusal(drawn(feature(ZONE, role="obstacle")))
    tall = feature(ZONE, role="obstacle", height="very tall")
    assert "height 'very tall' cannot be read" in refusal(drawn(tall))
    assert "height 'tall' cannot be read" in refusal(drawn(feature(ZONE, height="tall")))
    dot = of("Point", list(MIDDLE), role="obstacle", height=30)
    assert "give radius_m" in refusal(drawn(dot))
    wall = of("LineString", ZONE[:3], role="obstacle", height=30)
    assert "give width" in refusal(drawn(wall))


def test_a_block_of_google_earth_is_solid_and_one_above_the_sea_is_refused():
    block = polygon(ZONE, "<extrude>1</extrude>", "<altitudeMode>{}</altitudeMode>").replace(
        ",0 ", ",45 "
    )
    here = kml(placemark("x", block.format("relativeToGround")))
    assert kept(here, 44.0)[0] > 0.0
    assert kept(here, 49.0)[0] < 0.0
    above = placemark("x", block.format("absolute"))
    assert "height 'above sea level' cannot be read" in refusal(kml(above))
    assert kept(kml(placemark("NFZ", block.format("absolute"))), 109.0)[0] > 5.0


# ---- what is harmless, and who takes off where --------------------------------------------------


def test_points_that_are_labels_are_no_take_off_places_and_are_named():
    marks = [placemark(f"GCP {n}", line([(8.001 + n / 1e4, 50.001)], "Point")) for n in range(5)]
    said = kept(kml(*marks))[1]
    assert "left out: 5 points 'GCP …'" in said
    refused_ = refusal(kml(*marks), homes=())
    assert "no take-off place" in refused_
    assert "'GCP 0'" in refused_
    home = placemark("Home", line([HOME[::-1]], "Point"))
    scenario, said = mission(kml(*marks, home))
    assert "take-off: uas_1 from 'Home' at 49.999500, 7.999500" in said
    frame = LocalFrame(scenario.place)
    assert frame.to_geodetic(scenario.uas[0].start_m)[:2] == pytest.approx(HOME, abs=1e-7)


def test_points_that_say_nothing_are_take_off_places_where_no_other_is_and_that_is_said():
    marks = [placemark(f"P{n}", line([(7.9995, 49.9990 + n / 1e4)], "Point")) for n in range(3)]
    said = mission(kml(*marks))[1]
    assert "take-off (points that say nothing else): uas_1 from 'P0'" in said
    assert "left out: 2 points 'P1', 'P2'" in said
    said = mission(kml(*marks, placemark("take-off", line([(7.999, 49.9985)], "Point"))))[1]
    assert "take-off: uas_1 from 'take-off'" in said
    assert "left out: 3 points 'P0', 'P1', 'P2'" in said


def test_what_is_passed_over_is_counted_and_named():
    marks = [placemark("path", line(ZONE[:3])), placemark("Area 1", line([MIDDLE], "Point"))]
    said = kept(kml(*marks))[1]
    assert "left out: 1 line 'path', 1 point 'Area 1'" in said
    assert LeftOut("line", "path") in read_drawings([Path(path) for path in kml(*marks)])


def test_a_point_within_the_geometry_of_a_polygon_is_its_label():
    both = f"<MultiGeometry>{line([MIDDLE], 'Point')}{polygon(ZONE)}</MultiGeometry>"
    depth, said = kept(kml(placemark("no-fly school", both)))
    assert depth > 30.0
    assert "left out: 1 label of a polygon 'no-fly school'" in said


def test_a_key_that_says_no_does_not_count_and_a_polygon_may_have_two_outlines():
    assert kept(drawn(feature(ZONE, name="school", no_fly=False)))[0] < 0.0
    more = f"<outerBoundaryIs><LinearRing>{ring(ZONE)}</LinearRing></outerBoundaryIs>"
    far = [[x + 0.001, y - 0.001] for x, y in ZONE]
    assert kept(kml(placemark("NFZ", polygon(far, more))))[0] > 30.0
    assert (
        kept(kml(placemark("NFZ", polygon(far).replace("</Polygon>", f"{more}</Polygon>"))))[0] > 30
    )


def test_a_name_that_stands_twice_counts_twice():
    zone = {**feature(ZONE), "properties": {"name": "polygon 7", "Name": "NFZ"}}
    assert kept(drawn(zone))[0] > 30.0


def test_what_was_drawn_is_said_and_what_lies_outside_the_fence():
    far = [[x + 0.02, y] for x, y in ZONE]
    tower = of("Point", [8.003, 50.0005], name="Tower A")
    features = [feature(ZONE, name="NFZ 1"), feature(far, name="NFZ 2"), tower]
    said = kept(drawn(*features))[1]
    assert "drawn: 1 area 'field', 2 no-fly zones 'NFZ …', 1 obstacle 'Tower A'" in said
    assert "heights guessed from their kind: 1 obstacle of 100 m 'Tower A'" in said
    assert "outside the fence, where no UAS flies: 1 no-fly zone 'NFZ 2'" in said


def test_the_shipped_zones_a_structure_and_a_tower_are_flown_around(capsys):
    scenario = imported("zones", "--flown-by", "autopilot")
    kinds = sorted(obstacle.kind for obstacle in scenario.obstacles)
    assert kinds == ["mast", "no_fly", "no_fly", "no_fly", "structure"]
    out = capsys.readouterr().out
    assert "left out: 2 points 'GCP …', 1 line 'footpath'" in out
    flight = rollout(scenario, load_planner("trajectory"))
    assert accomplished(flight)
    for longitude, latitude, top_m in ((8.0036, 50.00075, 25.0), (8.0023, 50.0020, 75.0)):
        place = LocalFrame(scenario.place).to_ned(latitude, longitude, top_m - 0.5)
        assert min(hull.signed_distance(place) for hull in scenario.hulls) < 0.0
