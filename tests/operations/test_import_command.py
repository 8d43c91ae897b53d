"""From drawings to a scenario: the same in each format, and one clear line where it cannot be."""

import json
import os
import shutil
import zipfile
from contextlib import closing
from importlib import resources
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("shapely")
pytest.importorskip("shapefile")
import shapefile
from drawings import HIGH, HOME, SQUARE, collection, feature, imported, refused

from uas_coverage_env.cli import main
from uas_coverage_env.files.errors import InputError
from uas_coverage_env.operations import DrawnPolygon, LocalFrame, TakeOff, read_drawings
from uas_coverage_env.operations.area_import.drawn_areas import MOST_CORNERS
from uas_coverage_env.operations.area_import.osm_tags import (
    GUESSED_OTHER_M,
    STOREY_M,
    height_m,
    standing_of,
)
from uas_coverage_env.scenario import load_scenario, warnings

EXAMPLES = Path(str(resources.files("uas_coverage_env.operations.area_import"))) / "examples"


pytestmark = pytest.mark.usefixtures("elsewhere")


def point(longitude, latitude):
    return {"type": "Point", "coordinates": [longitude, latitude]}


@pytest.mark.parametrize(
    "files", [["karhula.kml"], ["karhula.kmz"], ["karhula.shp", "karhula_homes.shp"]]
)
def test_the_shipped_area_is_the_same_mission_in_every_format(files):
    wanted = imported("karhula")
    scenario = imported(*(EXAMPLES / file for file in files))
    assert scenario == wanted
    assert len(wanted.waypoints) > 40
    assert {obstacle.kind for obstacle in wanted.obstacles} == {"no_fly"}
    assert wanted.place.latitude_deg == pytest.approx(60.5246, abs=1e-4)


def test_a_plan_gives_the_same_area_with_its_planned_home_and_the_height_there():
    wanted, scenario = imported("karhula"), imported(EXAMPLES / "karhula.plan")
    assert scenario.place.height_m == 8.0
    assert scenario.waypoints == wanted.waypoints
    assert scenario.obstacles == wanted.obstacles
    assert scenario.uas[0] == wanted.uas[0]
    # the second one stands beside it
    assert np.subtract(scenario.uas[1].start_m, scenario.uas[0].start_m).tolist() == pytest.approx(
        [0.0, 6.72, 0.0]
    )


def test_the_buildings_of_the_town_become_obstacles_with_credit_and_can_be_flown():
    scenario = imported("karhula", "--town", "karhula")
    buildings = [o for o in scenario.obstacles if o.kind == "building"]
    assert 50 < len(buildings) < 100
    assert "OpenStreetMap contributors" in Path("out.toml").read_text("utf-8").splitlines()[0]
    assert warnings(scenario) == []


def test_the_shipped_town_is_what_import_makes_of_it():
    assert main(["import", "karhula", "--town", "karhula", *HIGH, "--out", "karhula.toml"]) == 0
    assert load_scenario("karhula.toml") == load_scenario("karhula")
    shipped = (
        resources.files("uas_coverage_env.scenario").joinpath("karhula.toml").read_text("utf-8")
    )
    assert shipped.endswith(Path("karhula.toml").read_text("utf-8"))


def test_the_check_of_a_scenario_says_where_it_is(capsys):
    imported("karhula")
    assert main(["scenario", "check", "out.toml"]) == 0
    assert "place      60.5246000, 26.9467500, 0 m above sea level\n" in capsys.readouterr().out


def test_take_off_places_lie_where_they_were_drawn():
    scenario = imported("karhula")
    frame = LocalFrame(scenario.place)
    for uas, (latitude, longitude) in zip(
        scenario.uas, [(60.5269, 26.9456), (60.52692, 26.9463)], strict=True
    ):
        place = frame.to_geodetic(uas.start_m)
        assert place == pytest.approx([latitude, longitude, 1.0], abs=1e-7)


def test_areas_have_weights_and_the_heavier_one_takes_what_overlaps():
    east = [[x + 0.001, y] for x, y in SQUARE]
    path = collection(feature(SQUARE, weight=1), feature(east, weight="2.5", name="school"))
    scenario = imported(path, *HOME)
    split_m = LocalFrame(scenario.place).to_ned(50.0, 10.001)[1]
    weights = {w.weight for w in scenario.waypoints}
    assert weights == {1.0, 2.5}
    for waypoint in scenario.waypoints:
        assert (waypoint.position_m[1] > split_m) == (waypoint.weight == 2.5)


@pytest.mark.parametrize("weight", [1, 3])
def test_an_area_within_another_that_weighs_as_much_changes_nothing(weight):
    within = [[10.001, 50.0005], [10.002, 50.0005], [10.002, 50.0015], [10.001, 50.0015]]
    alone = imported(collection(feature(SQUARE, weight=weight)), *HOME)
    both = collection(feature(SQUARE, weight=weight), feature([*within, within[0]], weight=1))
    assert imported(both, *HOME).waypoints == alone.waypoints


def test_a_hole_is_not_searched():
    hole = [[10.001, 50.0005], [10.002, 50.0005], [10.002, 50.0015], [10.001, 50.0015]]
    whole = imported(collection(feature(SQUARE)), *HOME)
    holed = imported(collection(feature(SQUARE, [*hole, hole[0]])), *HOME)
    frame = LocalFrame(holed.place)
    middle_m = frame.to_ned(50.001, 10.0015)[:2]
    nearest = [
        min(np.hypot(*(np.array(w.position_m[:2]) - middle_m)) for w in scenario.waypoints)
        for scenario in (whole, holed)
    ]
    assert nearest[0] < nearest[1]


def test_no_uas_leaves_a_drawn_fence_that_is_not_convex():
    outline = [[10.0, 50.0], [10.004, 50.0], [10.004, 50.001], [10.001, 50.001], [10.001, 50.003]]
    fence = [*outline, [10.0, 50.003], [10.0, 50.0]]
    inner = [[10.0002, 50.0002], [10.0008, 50.0002], [10.0008, 50.0028], [10.0002, 50.0002]]
    scenario = imported(collection(feature(fence, role="fence"), feature(inner)), *HOME)
    frame = LocalFrame(scenario.place)
    outside, inside = frame.to_ned([50.0018, 50.0005], [10.002, 10.003], 30.0)
    assert scenario.fence.signed_distance(outside) < 0.0
    assert min(hull.signed_distance(outside) for hull in scenario.hulls) < 0.0
    assert min(hull.signed_distance(inside) for hull in scenario.hulls) > 0.0
    assert scenario.fence.signed_distance(inside) < 0.0


@pytest.mark.parametrize("longitude", [180.0, -180.0, 0.0])
@pytest.mark.parametrize("latitude", [0.0, -60.0, 89.9999, -90.0])
def test_an_area_may_lie_on_the_date_line_and_at_the_poles(latitude, longitude):
    from uas_coverage_env.scenario import Place

    frame = LocalFrame(Place(latitude_deg=latitude, longitude_deg=longitude))
    corners_m = [[-100, -150, 0], [-100, 150, 0], [100, 150, 0], [100, -150, 0], [-100, -150, 0]]
    ring = frame.to_geodetic(corners_m)[:, 1::-1].tolist()
    home = frame.to_geodetic([-80.0, 0.0, 0.0])
    scenario = imported(collection(feature(ring)), "--home", f"{home[0]:.9f},{home[1]:.9f}")
    spread_m = np.ptp([w.position_m for w in scenario.waypoints], axis=0)
    if abs(latitude) < 80.0:
        assert spread_m[:2] == pytest.approx([200 - 200 / 6, 300 - 300 / 5], abs=0.1)
    assert len(scenario.waypoints) >= 30


def test_a_fleet_is_mixed_and_may_hold_own_vehicles(tmp_path):
    own = str(resources.files("uas_coverage_env.vehicle").joinpath("hexacopter.toml"))
    shutil.copy(own, tmp_path / "mine.toml")
    scenario = imported("karhula", "--fleet", "s500_v2:2,mine.toml:1,hexacopter")
    vehicles = [Path(uas.vehicle).stem for uas in scenario.uas]
    assert vehicles == ["s500_v2", "s500_v2", "mine", "hexacopter"]
    assert scenario.uas[0].radius_m == 0.36
    assert len({uas.start_m for uas in scenario.uas}) == 4


@pytest.mark.parametrize(
    ("tags", "height", "known"),
    [
        ({"height": "12"}, 12.0, True),
        ({"height": "12,5 m", "building:levels": "9"}, 12.5, True),
        ({"height": "40'"}, 12.192, True),
        ({"building:levels": "3"}, 3 * STOREY_M + 2.0, True),
        ({"building:levels": "2", "roof:levels": "1"}, 3 * STOREY_M, True),
        ({"height": "tall", "building": "church"}, 35.0, False),
        ({"building": "moon base"}, GUESSED_OTHER_M, False),
        ({"height": "-3", "building:levels": "0"}, GUESSED_OTHER_M, False),
    ],
)
def test_heights_come_from_tags_levels_or_a_guess(tags, height, known):
    what = standing_of({"building": "yes"} | tags)
    assert height_m(tags, what.guessed_m) == (pytest.approx(height), known)


def test_a_tag_that_cannot_be_read_is_said(capsys):
    ring = [[10.001, 50.0005], [10.0012, 50.0005], [10.0012, 50.0007], [10.001, 50.0005]]
    Path("town.geojson").write_text(
        json.dumps(
            {
                "type": "FeatureCollection",
                "features": [feature(ring, building="yes", height="tall")],
            }
        )
    )
    imported(collection(feature(SQUARE)), *HOME, "--town", "town.geojson")
    assert "cannot be read, such as 'height=tall'" in capsys.readouterr().out


BOMB = (
    '<?xml version="1.0"?><!DOCTYPE kml [<!ENTITY a "aaaaaaaaaa">'
    + "".join(f'<!ENTITY {n} "{10 * f"&{m};"}">' for m, n in pairwise("abcdefghi"))
    + "]><kml><Placemark><name>&i;</name></Placemark></kml>"
)
XXE = '<!DOCTYPE kml [<!ENTITY a SYSTEM "file:///etc/passwd">]><kml>&a;</kml>'
BOW_TIE = [[10.0, 50.0], [10.003, 50.002], [10.003, 50.0], [10.0, 50.002], [10.0, 50.0]]
KML = (
    "<kml><Placemark><Polygon><outerBoundaryIs><LinearRing><coordinates>{}</coordinates>"
    "</LinearRing></outerBoundaryIs></Polygon></Placemark></kml>"
)


def geojson(*rings, **properties):
    return json.dumps(feature(*rings, **properties))


HOSTILE = {
    "an entity bomb": ("a.kml", BOMB, "document type or entities"),
    "an external entity": ("a.kml", XXE, "document type or entities"),
    "no XML": ("a.kml", "<kml><Placemark>", "is no XML"),
    "text for coordinates": ("a.kml", KML.format("1,2 three,4 5,6"), "broken coordinate"),
    "underscores": ("a.kml", KML.format("1,4_7 2,47 2,48"), "broken coordinate"),
    "a line of the map": ("a.kml", KML.format("8.54,47.37 8.544,47.37 8.548,47.37"), "no area"),
    "deep XML": ("a.kml", "<a>" * 200_000 + "</a>" * 200_000, "no area to search"),
    "no archive": ("a.kmz", "PK but no archive", "cannot be unpacked"),
    "no JSON": ("a.geojson", '{"type": ', "is not JSON"),
    "deep JSON": ("a.geojson", "[" * 200_000, "nested too deeply"),
    "NaN": ("a.geojson", '{"type": "Polygon", "coordinates": [[[NaN, 1]]]}', "NaN is no number"),
    "infinity": ("a.geojson", geojson(SQUARE).replace("10.003", "1e999"), "broken coordinate"),
    "text": ("a.geojson", geojson([["a", "b"], ["c", "d"], ["e", "f"]]), "broken coordinate"),
    "a number for rings": ("a.geojson", '{"type":"Polygon","coordinates":7}', "has no rings"),
    "something else in JSON": ("a.geojson", '{"type":"Topology"}', "is no GeoJSON"),
    "a list": ("a.geojson", "[1, 2]", "holds no JSON object"),
    "a line": ("a.geojson", '{"type":"LineString","coordinates":[[1,2],[3,4]]}', "no area"),
    "a line to keep out of": (
        "a.geojson",
        '{"type":"Feature","properties":{"role":"no_fly"},"geometry":'
        '{"type":"LineString","coordinates":[[1,2],[3,4]]}}',
        "the role 'no_fly' says no_fly, but it is a LineString; draw a polygon",
    ),
    "a bow tie": ("a.geojson", geojson(BOW_TIE), "self-intersection at 50.001000, 10.001500"),
    "two corners": ("a.geojson", geojson([[1, 2], [2, 3], [1, 2]]), "fewer than three corners"),
    "no area": ("a.geojson", geojson([[1, 2], [1.001, 2], [1.002, 2], [1, 2]]), "has no area"),
    "projected metres": (
        "a.geojson",
        geojson([[385000, 6672000], [385100, 6672000], [385100, 6672100]]),
        "6672100, which is no degree; export it in WGS 84",
    ),
    "swapped degrees": ("a.geojson", geojson([[1, 120], [1, 121], [2, 121]]), "swapped"),
    "another crs": (
        "a.geojson",
        json.dumps({"crs": {"name": "EPSG:3067"}, **feature(SQUARE)}),
        "EPSG:3067",
    ),
    "a continent": ("a.geojson", geojson([[1, 1], [20, 1], [20, 20]]), "further than 20 km"),
    "an unknown role": ("a.geojson", geojson(SQUARE, role="picnic"), "unknown role 'picnic'"),
    "a weight of text": ("a.geojson", geojson(SQUARE, weight="much"), "weight 'much'"),
    "a weight of nothing": ("a.geojson", geojson(SQUARE, weight=0), "weight '0'"),
    "a plan that is none": ("a.plan", '{"fileType": "Plain"}', "no QGroundControl plan"),
    "a broken plan": ("a.plan", '{"fileType": "Plan", "mission": {"items": [1]}}', "broken"),
    "an unknown ending": ("a.docx", "", "unknown kind of file"),
    "no projection": ("a.shp", "", "has no .prj"),
}


@pytest.mark.parametrize("case", HOSTILE)
def test_a_hostile_file_is_refused_in_one_line(case, capsys):
    name, text, said = HOSTILE[case]
    Path(name).write_text(text)
    err = refused(capsys, name, *HOME)
    assert err.startswith(f"error: {name}")
    assert said in err


def test_one_corner_too_many_is_refused(capsys):
    ring = ",".join(f"[{n % 99},{n % 89}]" for n in range(MOST_CORNERS + 1))
    Path("a.geojson").write_text(f'{{"type":"Polygon","coordinates":[[{ring}]]}}')
    assert "more than 100000 corners" in refused(capsys, "a.geojson", *HOME)


def test_a_huge_file_and_an_archive_that_grows_are_refused(capsys):
    with Path("big.geojson").open("wb") as file:
        file.truncate(30_000_000)
    assert "larger than 20 MB" in refused(capsys, "big.geojson", *HOME)
    with zipfile.ZipFile("bomb.kmz", "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("doc.kml", b" " * 100_000_000)
    assert "unpacks to more than 20 MB" in refused(capsys, "bomb.kmz", *HOME)


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="os.mkfifo is of POSIX systems")
def test_a_pipe_is_refused_and_not_waited_for(capsys):
    for name in ("pipe.geojson", "pipe.kml", "pipe.kmz", "pipe.plan"):
        os.mkfifo(name)
        assert "is not a plain file" in refused(capsys, name, *HOME)


@pytest.mark.parametrize("cut", [10, 90, 110, 150])
def test_a_damaged_shapefile_is_refused(cut, capsys):
    for path in EXAMPLES.glob("karhula.*"):
        shutil.copy(path, ".")
    data = bytearray(Path("karhula.shp").read_bytes())
    rng = np.random.default_rng(cut)
    data[cut:] = rng.integers(0, 256, len(data) - cut, dtype=np.uint8).tobytes()
    Path("karhula.shp").write_bytes(data)
    assert "karhula.shp" in refused(capsys, "karhula.shp", *HOME)
    Path("karhula.prj").write_text("METRES OF THE KING")
    assert "names no coordinate system" in refused(capsys, "karhula.shp", *HOME)


def test_a_shapefile_that_was_cut_off_is_one_line_without_warnings_of_its_reader(capsys, recwarn):
    for path in EXAMPLES.glob("karhula.*"):
        shutil.copy(path, ".")
    data = Path("karhula.shp").read_bytes()
    Path("karhula.shp").write_bytes(data[:120])
    assert "is no sound shapefile" in refused(capsys, "karhula.shp", *HOME)
    assert not recwarn


def test_a_shapefile_in_projected_metres_is_read_by_its_projection():
    import pyproj

    crs = pyproj.CRS.from_epsg(32632)
    x, y = pyproj.Transformer.from_crs(4326, crs, always_xy=True).transform(*np.transpose(SQUARE))
    with closing(shapefile.Writer("metres", shapeType=shapefile.POLYGON)) as writer:
        writer.field("name", "C", 10)
        writer.poly([list(zip(x, y, strict=True))[::-1]])
        writer.record("field")
    Path("metres.prj").write_text(crs.to_wkt("WKT1_ESRI"))
    (area,) = read_drawings([Path("metres.shp")])
    assert isinstance(area, DrawnPolygon)
    assert area.outer[::-1, ::-1] == pytest.approx(np.array(SQUARE), abs=1e-7)


def test_circles_and_fences_of_a_plan_are_read(tmp_path):
    plan = {
        "fileType": "Plan",
        "geoFence": {
            "polygons": [{"inclusion": True, "polygon": [[y, x] for x, y in SQUARE[:-1]]}],
            "circles": [{"inclusion": False, "circle": {"center": [50.001, 10.001], "radius": 20}}],
        },
        "mission": {"items": [], "plannedHomePosition": [50.0002, 10.0002, 431.0]},
    }
    Path("a.plan").write_text(json.dumps(plan))
    fence, area, circle, home = read_drawings([Path("a.plan")])
    assert isinstance(fence, DrawnPolygon)
    assert isinstance(area, DrawnPolygon)
    assert isinstance(circle, DrawnPolygon)
    assert (fence.role, area.role, circle.role) == ("fence", "search", "no_fly")
    assert home == TakeOff("a.plan: 'planned home'", 50.0002, 10.0002, 431.0)
    ring = LocalFrame.around(*circle.outer.T).to_ned(*circle.outer.T)[:, :2]
    middles = 0.5 * (ring + np.roll(ring, 1, axis=0))
    assert np.hypot(*middles.T).min() == pytest.approx(20.0, abs=0.01)


MISTAKES = {
    "no take-off place": ((), "no take-off place"),
    "a take-off place far away": (("--home", "10.0,50.0"), "swapped"),
    "a take-off place of text": (("--home", "here"), "should be LAT,LON"),
    "a place on no Earth": (("--home", "100,10"), "is no latitude and longitude"),
    "an unknown vehicle": ((*HOME, "--fleet", "kite:2"), "kite"),
    "a fleet of none": ((*HOME, "--fleet", "s500_v2:0"), "--fleet"),
    "too large a fleet": ((*HOME, "--fleet", "s500_v2:99"), "'s500_v2:99': more than"),
    "far too large a fleet": ((*HOME, "--fleet", "s500_v2:100000"), "'s500_v2:100000': more than"),
    "a camera without a name": ((*HOME, "--fleet", "s500_v2+:1"), "VEHICLE+CAMERA:COUNT"),
    "an unknown camera of a UAS": ((*HOME, "--fleet", "s500_v2+eye:1"), "unknown camera"),
    "an unknown camera": ((*HOME, "--camera", "eye"), "unknown camera"),
    "too low": ((*HOME, "--height", "10"), "fly higher than"),
    "a ceiling below the waypoints": ((*HOME, "--ceiling", "30"), "--ceiling 30"),
    "height and resolution": ((*HOME, "--height", "60", "--resolution", "2"), "leave out --height"),
    "too sharp": ((*HOME, "--resolution", "0.2"), "--resolution 0.2: needs a height below"),
    "no speed": ((*HOME, "--max-speed", "0"), "--max-speed 0"),
    "no height": ((*HOME, "--height", "nan"), "--height nan"),
    "no town": ((*HOME, "--town", "town.geojson"), "no such file"),
    "the town of another place": ((*HOME, "--town", "karhula"), "km from the area"),
    "a take-off place in a no-fly zone": (
        ("--home", "50.001,10.001"),
        "inside an obstacle (no-fly zone)",
    ),
}


@pytest.mark.parametrize("case", MISTAKES)
def test_a_mistake_in_an_option_is_refused_in_one_line(case, capsys):
    arguments, said = MISTAKES[case]
    zone = [[10.0009, 50.0009], [10.0012, 50.0009], [10.0012, 50.0012], [10.0009, 50.0009]]
    path = collection(feature(SQUARE), feature(zone, name="no-fly zone"))
    assert said in refused(capsys, path, *arguments)


def test_the_town_with_swapped_degrees_is_told(capsys):
    data = json.loads((EXAMPLES / "karhula_buildings.geojson").read_text("utf-8"))
    for each in data["features"]:
        if each["geometry"]["type"] == "Polygon":
            rings = each["geometry"]["coordinates"]
            each["geometry"]["coordinates"] = [[p[::-1] for p in ring] for ring in rings]
    Path("swapped.geojson").write_text(json.dumps(data))
    assert "swapped" in refused(capsys, "karhula", "--town", "swapped.geojson")


def test_without_the_extra_one_line_names_it(capsys, monkeypatch):
    import sys

    for name in list(sys.modules):
        if name.partition(".")[0] == "pyproj" or "operations" in name:
            monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, "pyproj", None)
    assert 'pip install "uas-coverage-env[ops]"' in refused(capsys, "karhula")


def test_a_file_that_exists_is_kept(capsys):
    Path("no.toml").write_text("mine")
    with pytest.raises(InputError):
        read_drawings([Path("nowhere.kml")])
    assert main(["import", "karhula", "--out", "no.toml"]) == 2
    assert "add --overwrite" in capsys.readouterr().err
    assert Path("no.toml").read_text() == "mine"
