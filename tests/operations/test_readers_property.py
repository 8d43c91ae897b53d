"""Whatever is drawn in whatever format: what is solid or forbidden is kept, or the file refused."""

import json
from pathlib import Path

import pytest

pytest.importorskip("shapely")
pytest.importorskip("shapefile")
pytest.importorskip("osmium")
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from random_drawings import (
    AREA,
    CELLS,
    HALF_Y,
    HOME,
    depth_m,
    drawings,
    feature_of,
    mission,
    solids,
    write_geojson,
    write_kml,
    write_kmz,
    write_shapefiles,
    zones,
)

pytestmark = pytest.mark.usefixtures("elsewhere")

EXAMPLES = settings(
    max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
OUTLINES = ("polygon", "multi", "collection", "closed line", "nearly closed line")


def check(things, paths, **options):
    """All that is solid or forbidden is where it was drawn, or a line says what cannot be."""
    scenario, said = mission(paths, **options)
    firm = [thing for thing in things if thing.means != "harmless"]
    if scenario is None:
        assert any(thing.shape not in OUTLINES for thing in firm), said
        assert any(said.startswith(path) for path in paths), said
        assert "\n" not in said
        return
    for thing in firm:
        assert thing.shape != "empty", said
        heights = (1.0, thing.height_m - 0.5) if thing.means == "solid" else (1.0, 50.0, 109.0)
        for height_m in heights:
            assert depth_m(scenario, *place_of(thing), min(height_m, 109.0)) > 0.0, (thing, said)
    if len(firm) < len(things):
        assert "left out: " in said


def place_of(thing):
    """A place that it holds for sure: its middle, or that of a line."""
    x, y = thing.middle
    return (x, y - HALF_Y) if thing.shape == "line" else (x, y)


@EXAMPLES
@given(things=drawings())
def test_geojson_keeps_what_is_solid_or_forbidden(things):
    check(things, write_geojson(things))


@EXAMPLES
@given(things=drawings(folders=True))
def test_kml_keeps_what_is_solid_or_forbidden_in_any_folder(things):
    check(things, write_kml(things))


@settings(EXAMPLES, max_examples=15)
@given(things=drawings(folders=True))
def test_kmz_keeps_what_is_solid_or_forbidden(things):
    check(things, write_kmz(things))


@settings(EXAMPLES, max_examples=30)
@given(things=drawings(), upper=st.booleans())
def test_shapefiles_keep_what_is_solid_or_forbidden(things, upper):
    check(things, write_shapefiles(things, upper))


@EXAMPLES
@given(data=st.data())
def test_plans_keep_structures_exclusions_and_fences(data):
    cells = data.draw(st.lists(st.sampled_from(range(9)), max_size=4, unique=True))
    polygons, circles, items, probes = [], [], [survey(AREA)], []
    for cell in cells:
        x, y = CELLS[cell]
        ring = [[y + b, x + a] for a, b in ((-3e-4, -2e-4), (3e-4, -2e-4), (3e-4, 2e-4))]
        kind = data.draw(st.sampled_from(["zone", "circle", "structure", "landing", "waypoint"]))
        if kind == "zone":
            polygons.append({"inclusion": False, "polygon": ring})
            probes.append((x + 1e-4, y - 1e-4, 100.0))
        elif kind == "circle":
            circles.append({"inclusion": False, "circle": {"center": [y, x], "radius": 20}})
            probes.append((x, y + 1.7e-4, 100.0))
        elif kind == "structure":
            height = data.draw(st.sampled_from([20, 55.5]))
            scan = {"complexItemType": "StructureScan", "polygon": ring, "StructureHeight": height}
            items.append({"type": "ComplexItem", **scan})
            probes.append((x + 1e-4, y - 1e-4, height - 0.5))
        elif kind == "landing":
            items.append({"type": "ComplexItem", "complexItemType": "vtolLandingPattern"})
        else:
            items.append({"type": "SimpleItem"})
    firmware = data.draw(st.sampled_from([3, 12, 0]))
    fences = data.draw(st.lists(st.sampled_from([0.0, 5e-4, 1e-3]), max_size=2, unique=True))
    for aside in fences:
        low, high = (49.999, 7.999), (50.004, 8.005 + aside)
        corners = [low, (low[0], high[1]), high, (high[0], low[1])]
        polygons.append({"inclusion": True, "polygon": corners})
    plan = {
        "fileType": "Plan",
        "geoFence": {"polygons": polygons, "circles": circles},
        "mission": {"items": items, "firmwareType": firmware, "plannedHomePosition": [*HOME, 0]},
    }
    Path("area.plan").write_text(json.dumps(plan))
    scenario, said = mission(["area.plan"])
    assert scenario is not None, said
    for x, y, height_m in probes:
        assert depth_m(scenario, x, y, height_m) > 0.0
    left = [item for item in items if item.get("complexItemType", "") in ("", "vtolLandingPattern")]
    assert ("left out" in said) == bool(left)
    for aside in fences:
        x = 8.005 + aside + 2e-5
        inside = firmware == 12 and aside < max(fences)
        out = scenario.fence.signed_distance(local(scenario, x, 50.001)) > 0.0
        assert out or inside or depth_m(scenario, x, 50.001, 50.0) > 0.0


def survey(ring):
    corners = [[y, x] for x, y in ring[:-1]]
    return {"type": "ComplexItem", "complexItemType": "survey", "polygon": corners}


def local(scenario, longitude, latitude):
    from uas_coverage_env.operations import LocalFrame

    return LocalFrame(scenario.place).to_ned(latitude, longitude, 50.0)


@st.composite
def town_things(draw):
    cells = draw(st.lists(st.sampled_from(range(9)), min_size=1, max_size=5, unique=True))
    shapes = ["polygon", "multi", "closed line", "point"]
    return [draw(solids(cell, shapes)) for cell in cells]


@EXAMPLES
@given(things=town_things(), zone=zones(4, False, ["polygon", "multi"]))
def test_a_town_of_geojson_keeps_what_stands_and_roles(things, zone):
    write_geojson([])
    things = [thing for thing in things if thing.cell != 4 and "name" not in thing.attributes]
    zone_said = {"role" if key.lower() == "role" else key for key in zone.attributes} == {"role"}
    found = [
        feature_of(t.geometry(), t.attributes) for t in (*things, *([zone] if zone_said else []))
    ]
    house = [[7.9998, 50.0031], [7.9999, 50.0031], [7.9999, 50.0032], [7.9998, 50.0031]]
    found.append(feature_of({"type": "Polygon", "coordinates": [house]}, {"building": "yes"}))
    Path("town.geojson").write_text(json.dumps({"type": "FeatureCollection", "features": found}))
    scenario, said = mission(["area.geojson"], town=Path("town.geojson"))
    firm = [*things, *([zone] if zone_said else [])]
    assert scenario is not None, said
    for thing in firm:
        heights = (1.0, thing.height_m - 0.5) if thing.means == "solid" else (1.0, 109.0)
        for height_m in heights:
            assert depth_m(scenario, *place_of(thing), min(height_m, 109.0)) > 0.0, (thing, said)


@EXAMPLES
@given(things=town_things())
def test_openstreetmap_keeps_what_stands(things):
    write_geojson([])
    things = [thing for thing in things if "name" not in thing.attributes]
    nodes, ways, relations = [], [], []
    for n, thing in enumerate(things, 1):
        tags = "".join(f'<tag k="{k.lower()}" v="{v}"/>' for k, v in thing.attributes.items())
        tags = tags.replace("'\"", '&apos;"')
        x, y = thing.middle
        first = 10 * n
        if thing.shape == "point":
            nodes.append(f'<node id="{first}" lat="{y:.7f}" lon="{x:.7f}">{tags}</node>')
            continue
        for k, (x, y) in enumerate(thing.ring()[:-1]):
            nodes.append(f'<node id="{first + k}" lat="{y:.7f}" lon="{x:.7f}"/>')
        refs = "".join(f'<nd ref="{first + k}"/>' for k in (0, 1, 2, 3, 0))
        alone = thing.shape != "multi"
        ways.append(f'<way id="{n}">{refs}{tags if alone else ""}</way>')
        if not alone:
            member = f'<member type="way" ref="{n}" role="outer"/><tag k="type" v="multipolygon"/>'
            relations.append(f'<relation id="{n}">{member}{tags}</relation>')
    body = "".join((*nodes, *ways, *relations))
    Path("town.osm").write_text(f'<osm version="0.6">{body}</osm>')
    scenario, said = mission(["area.geojson"], town=Path("town.osm"))
    if not things:
        assert "holds no building" in said
        return
    assert scenario is not None, said
    for thing in things:
        for height_m in (1.0, thing.height_m - 0.5):
            assert depth_m(scenario, *place_of(thing), min(height_m, 109.0)) > 0.0, (thing, said)


JSON = st.recursive(
    st.none() | st.booleans() | st.integers(-200, 200) | st.floats() | st.text(max_size=8),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=8), inner),
    max_leaves=6,
)
KEYS = st.sampled_from(
    [
        *("name", "Role", "height", "radius", "width", "man_made", "building", "weight", "camera"),
        *("tags", "building:levels", "height_m", "description", "kind", "generator:source"),
    ]
)
KINDS = ["Point", "LineString", "Polygon", "MultiPolygon", "GeometryCollection", "MultiPoint", "x"]
GEOMETRY = st.fixed_dictionaries(
    {"type": st.sampled_from(KINDS)},
    optional={"coordinates": JSON, "geometries": JSON, "crs": JSON},
)


@EXAMPLES
@given(
    attributes=st.dictionaries(KEYS, JSON, max_size=4),
    geometry=st.one_of(JSON, GEOMETRY, st.just({"type": "Polygon", "coordinates": [AREA]})),
    crs=st.none() | JSON,
)
def test_whatever_json_holds_is_read_or_refused_in_one_line(attributes, geometry, crs):
    one = feature_of(geometry, attributes)
    try:
        text = json.dumps({"type": "FeatureCollection", "crs": crs, "features": [one]})
    except ValueError:
        return
    Path("x.geojson").write_text(text, encoding="utf-8", errors="replace")
    write_geojson([])
    for paths, options in (
        (["area.geojson", "x.geojson"], {}),
        (["area.geojson"], {"town": Path("x.geojson")}),
    ):
        scenario, said = mission(paths, **options)
        assert scenario is not None or "\n" not in said
