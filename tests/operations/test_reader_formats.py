"""What is of one format: coordinate systems, archives, encodings and side files, plans."""

import json
import zipfile
from contextlib import closing
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("shapely")
pytest.importorskip("shapefile")
import shapefile
from drawings import feature
from drawn_files import ZONE, drawn, kept, kml, layer, placemark, polygon, refusal
from random_drawings import AREA, HOME, WGS_84, depth_m, mission

from uas_coverage_env.operations import LocalFrame, TakeOff, read_drawings

pytestmark = pytest.mark.usefixtures("elsewhere")


# ---- GeoJSON ------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "name",
    [
        "urn:ogc:def:crs:OGC:1.3:CRS84",
        "urn:ogc:def:crs:OGC::CRS84",
        "urn:ogc:def:crs:EPSG::4326",
        "urn:ogc:def:crs:EPSG:6.18:4326",
        "http://www.opengis.net/def/crs/OGC/1.3/CRS84",
        "http://www.opengis.net/def/crs/EPSG/0/4326",
        "http://www.opengis.net/gml/srs/epsg.xml#4326",
        "EPSG:4326",
        "epsg:4326",
        "OGC:CRS84",
        "CRS84",
        "WGS84",
        "WGS 84",
    ],
)
def test_wgs_84_is_read_however_it_is_written(name):
    data = {"type": "FeatureCollection", "crs": {"type": "name", "properties": {"name": name}}}
    text = json.dumps(data | {"features": [feature(AREA)]})
    Path("area.geojson").write_text(text)
    assert len(mission(["area.geojson"], homes=(HOME,))[0].waypoints) > 5
    Path("town.geojson").write_text(
        text.replace('"properties": {}', '"properties": {"building": "yes"}')
    )
    assert "1 building" in mission(drawn(), homes=((49.999, 7.999),), town=Path("town.geojson"))[1]


@pytest.mark.parametrize(
    "crs",
    [
        {"type": "name", "properties": {"name": "EPSG:43264"}},
        {"type": "name", "properties": {"name": "urn:ogc:def:crs:EPSG::3857"}},
        {"type": "name", "properties": {"name": "urn:ogc:def:crs:EPSG::32632"}},
        {"type": "EPSG", "properties": {"code": 3067}},
        {"type": "link", "properties": {"href": "http://example.com/crs"}},
        "EPSG:3857",
    ],
)
def test_another_coordinate_system_is_refused_by_name(crs):
    Path("area.geojson").write_text(json.dumps({**feature(AREA), "crs": crs}))
    said = refusal(["area.geojson"])
    assert "is not WGS 84" in said
    name = crs if isinstance(crs, str) else str(next(iter(crs["properties"].values())))
    assert name in said
    Path("town.geojson").write_text(Path("area.geojson").read_text())
    assert "is not WGS 84" in refusal(drawn(), town=Path("town.geojson"))


def test_the_old_way_of_a_code_and_null_are_read():
    for crs in ({"type": "EPSG", "properties": {"code": 4326}}, None):
        Path("area.geojson").write_text(json.dumps({**feature(AREA), "crs": crs}))
        assert mission(["area.geojson"], homes=(HOME,))[0] is not None


# ---- KMZ ----------------------------------------------------------------------------------------


def test_an_archive_of_macos_is_read_and_all_its_kml_counts():
    zone = placemark("no-fly", polygon(ZONE))
    with zipfile.ZipFile("area.kmz", "w") as archive:
        archive.writestr("__MACOSX/._doc.kml", b"\x00\x05\x16\x07\x00\x02")
        archive.writestr("._doc.kml", b"\x00\x05\x16\x07\x00\x02")
        archive.writestr("files/photo.png", b"png")
        archive.writestr("doc.kml", Path(kml()[0]).read_text())
        archive.writestr("files/zones.kml", f"<kml><Document>{zone}</Document></kml>")
    assert kept(["area.kmz"])[0] > 30.0


# ---- shapefiles ---------------------------------------------------------------------------------


ROWS = [({"name": "Fläche Nord"}, [AREA]), ({"name": "Grundschule Süd", "role": "no_fly"}, [ZONE])]


@pytest.mark.parametrize(
    ("encoding", "page", "language"),
    [
        ("cp1252", "1252", None),
        ("cp1252", "ANSI 1252", None),
        ("cp1252", "windows-1252", None),
        ("latin-1", "ISO-8859-1", None),
        ("latin-1", "88591", None),
        ("gbk", "GBK", None),
        ("gbk", "936", None),
        ("utf-8", "UTF-8", None),
        ("utf-8", None, None),
        ("cp1252", None, 0x57),
        ("cp1252", None, 0),
        ("cp850", None, 0x02),
        ("cp1252", "what is this", 0x03),
        ("cp1252", "UTF-8", 0x03),  # which is wrong
    ],
)
def test_names_of_any_encoding_are_read(encoding, page, language):
    rows = ROWS
    if encoding == "gbk":
        rows = [({"name": "北区"}, [AREA]), ({"name": "小学", "role": "no_fly"}, [ZONE])]
    path = layer("area", shapefile.POLYGON, rows, encoding, page, language)
    assert kept([path])[0] > 30.0
    names = [thing.name for thing in read_drawings([Path(path)])]
    assert names == [fields["name"] for fields, _ in rows]


def test_a_field_whose_name_is_no_ascii_is_read():
    rows = [({"Fläche": "Nord", "name": "x"}, [AREA]), ({"name": "no-fly"}, [ZONE])]
    assert kept([layer("area", shapefile.POLYGON, rows, "cp1252", "1252")])[0] > 30.0


@pytest.mark.parametrize("ending", [str.upper, str.title, str.lower])
@pytest.mark.parametrize("stem", [str.upper, str.lower])
def test_side_files_are_found_whatever_their_case(ending, stem):
    layer("area", shapefile.POLYGON, ROWS, "cp1252", "1252")
    Path("area.shp").rename("AREA.SHP")
    for each in ("shx", "dbf", "prj", "cpg"):
        Path(f"area.{each}").rename(f"{stem('area')}.{ending(each)}")
    assert kept(["AREA.SHP"])[0] > 30.0


def test_rows_without_a_shape_are_counted_and_those_with_a_role_refused():
    rows = [({"name": "none"}, None), *ROWS, ({"name": "none either"}, None)]
    depth, said = kept([layer("area", shapefile.POLYGON, rows)])
    assert depth > 30.0
    assert "left out: 2 empty geometrys 'none …'" in said.replace("geometries", "geometrys")
    rows.append(({"name": "x", "role": "no_fly"}, None))
    assert "it has no place" in refusal([layer("area", shapefile.POLYGON, rows)])


def test_a_table_with_fewer_rows_than_shapes_is_refused():
    layer("area", shapefile.POLYGON, ROWS)
    layer("other", shapefile.POLYGON, ROWS[:1])
    Path("area.dbf").write_bytes(Path("other.dbf").read_bytes())
    assert "2 shapes, but 1 rows" in refusal(["area.shp"])


def test_a_row_that_is_marked_as_deleted_is_left_out():
    layer("area", shapefile.POLYGON, [*ROWS, ({"name": "more"}, [ZONE])])
    table = bytearray(Path("area.dbf").read_bytes())
    header, length = (int.from_bytes(table[n : n + 2], "little") for n in (8, 10))
    table[header + 2 * length] = ord("*")
    Path("area.dbf").write_bytes(table)
    depth, said = kept(["area.shp"])
    assert depth > 30.0
    assert "left out: 1 deleted row" in said


def test_bodies_of_a_shapefile_are_refused():
    with closing(shapefile.Writer("area", shapeType=shapefile.MULTIPATCH)) as writer:
        writer.field("name", "C", 10)
        writer.multipatch([[[*place, 10.0] for place in ZONE]], partTypes=[shapefile.RING])
        writer.record("x")
    Path("area.prj").write_text(WGS_84)
    assert "a MultiPatch, which is not read" in refusal([*drawn(), "area.shp"])


# ---- plans --------------------------------------------------------------------------------------


def turned(corners):
    return [[y, x] for x, y in corners]


SURVEY = {"type": "ComplexItem", "complexItemType": "survey", "polygon": turned(AREA[:-1])}
SCAN = {"complexItemType": "StructureScan", "StructureHeight": 50, "polygon": turned(ZONE[:-1])}
CORRIDOR = {
    "complexItemType": "CorridorScan",
    "CorridorWidth": 50,
    "polyline": [[50.001, 8.006], [50.003, 8.006], [50.003, 8.008]],
}


def plan(*items, firmware=3, polygons=(), circles=()):
    data = {
        "fileType": "Plan",
        "geoFence": {"version": 2, "polygons": list(polygons), "circles": list(circles)},
        "mission": {"firmwareType": firmware, "items": list(items)},
    }
    Path("site.plan").write_text(json.dumps(data))
    return ["site.plan"]


def test_a_structure_to_scan_is_an_obstacle_and_never_ground_to_search():
    depth, said = kept(plan(SURVEY, SCAN), 49.0)
    assert depth > 0.0
    assert "1 structure" in said
    assert kept(plan(SURVEY, SCAN), 54.0)[0] < 0.0
    assert "'StructureScan_1' is obstacle" in refusal(plan(SCAN))
    tall = {**SCAN, "StructureHeight": "tall"}
    assert "height 'tall' cannot be read" in refusal(plan(SURVEY, tall))


def near_m(scenario, longitude, latitude):
    """How far the nearest waypoint is from a place [m]."""
    place = LocalFrame(scenario.place).to_ned(latitude, longitude)[:2]
    places = np.array([waypoint.position_m[:2] for waypoint in scenario.waypoints])
    return np.hypot(*(places - place).T).min()


@pytest.mark.parametrize("closed", [False, True])
def test_the_strip_along_a_corridor_is_searched_and_its_middle_not(closed):
    corners = [[50.001, 8.006], [50.003, 8.006], [50.003, 8.009], [50.001, 8.009]]
    line_ = [*corners, corners[0]] if closed else corners
    scenario, _ = mission(plan(SURVEY, {**CORRIDOR, "polyline": line_}), homes=(HOME,))
    assert near_m(scenario, 8.006, 50.002) < 45.0
    assert near_m(scenario, 8.0075, 50.003) < 45.0
    assert (near_m(scenario, 8.0075, 50.001) < 45.0) == closed
    assert near_m(scenario, 8.0075, 50.002) > 60.0


def fence_(west, south, east, north):
    corners = [[south, west], [south, east], [north, east], [north, west]]
    return {"inclusion": True, "polygon": corners}


OUTER, INNER = fence_(7.998, 49.999, 8.01, 50.004), fence_(7.999, 49.9992, 8.0045, 50.0032)
BETWEEN = (8.007, 50.002)


@pytest.mark.parametrize("firmware", [3, 0, None])
def test_of_several_fences_none_is_left_unless_px4_flies(firmware):
    paths = plan(SURVEY, firmware=firmware, polygons=[OUTER, INNER])
    scenario, said = mission(paths, homes=(HOME,))
    frame = LocalFrame(scenario.place)
    place = frame.to_ned(BETWEEN[1], BETWEEN[0], 30.0)
    assert scenario.fence.signed_distance(place) > 0.0 or depth_m(scenario, *BETWEEN, 30.0) > 0.0
    assert "2 fences: UAS stay in all of them at once, as ArduPilot does" in said


def test_px4_stays_in_any_of_several_fences():
    scenario, said = mission(plan(SURVEY, firmware=12, polygons=[OUTER, INNER]), homes=(HOME,))
    place = LocalFrame(scenario.place).to_ned(BETWEEN[1], BETWEEN[0], 30.0)
    assert scenario.fence.signed_distance(place) < 0.0
    assert depth_m(scenario, *BETWEEN, 30.0) < 0.0
    assert "2 fences are taken as one: UAS stay in any, as PX4 does" in said


def test_circles_count_as_fences_and_exclusions_do():
    circle = {"inclusion": True, "circle": {"center": [50.0015, 8.002], "radius": 330}}
    scenario, _ = mission(plan(SURVEY, polygons=[OUTER], circles=[circle]), homes=(HOME,))
    assert scenario.fence.signed_distance(LocalFrame(scenario.place).to_ned(50.002, 8.0079, 30)) > 0
    out = {"inclusion": False, "circle": {"center": [50.0015, 8.002], "radius": 30}}
    assert kept(plan(SURVEY, circles=[out]))[0] == pytest.approx(30.0, abs=0.5)


def test_fences_that_share_no_ground_are_refused():
    far = fence_(8.02, 50.0, 8.03, 50.01)
    assert "have no ground in common" in refusal(plan(SURVEY, polygons=[OUTER, far]))


def test_what_a_plan_has_besides_is_named():
    landing = {"type": "ComplexItem", "complexItemType": "fwLandingPattern"}
    waypoint = {"type": "SimpleItem", "command": 16, "params": []}
    said = kept(plan(SURVEY, landing, waypoint, waypoint))[1]
    assert "left out: 1 fwLandingPattern, 2 mission items" in said


def test_a_plan_of_a_fence_alone_is_searched_within_it_and_the_fence_is_kept():
    scenario, _ = mission(plan(polygons=[OUTER]), homes=((50.0, 8.0),))
    place = LocalFrame(scenario.place).to_ned(49.9989, 8.0, 30.0)
    assert scenario.fence.signed_distance(place) > 0.0
    roles = [getattr(thing, "role", "") for thing in read_drawings([Path("site.plan")])]
    assert roles == ["fence", "search"]


def test_a_fence_before_2018_is_read():
    data = json.loads(Path(plan(SURVEY)[0]).read_text())
    data["geoFence"] = {"polygon": INNER["polygon"], "version": 1}
    Path("site.plan").write_text(json.dumps(data))
    assert [getattr(t, "role", "") for t in read_drawings([Path("site.plan")])] == [
        "search",
        "fence",
    ]


def test_take_off_places_are_equal_by_what_they_are():
    assert TakeOff("a", 1.0, 2.0, name="x") == TakeOff("a", 1.0, 2.0, name="y")
