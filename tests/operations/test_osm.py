"""OpenStreetMap files: what stands in a town, its streets, and files that are broken."""

from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("shapely")
pytest.importorskip("osmium")
import osmium
from drawings import HOME, SQUARE, collection, feature, imported, refused

from uas_coverage_env.operations import LocalFrame
from uas_coverage_env.operations.area_import.osm_tags import STANDING

pytestmark = pytest.mark.usefixtures("elsewhere")

NODES = {
    # a house with a court, as a relation of two rings
    **{1: (10.0010, 50.0010), 2: (10.0014, 50.0010), 3: (10.0014, 50.0013), 4: (10.0010, 50.0013)},
    **{5: (10.0011, 50.0011), 6: (10.0013, 50.0011), 7: (10.0012, 50.0012)},
    # a garage
    **{8: (10.0020, 50.0016), 9: (10.0021, 50.0016), 10: (10.0021, 50.0017)},
    # a street, and a power line with a corner
    **{11: (10.0000, 50.0003), 12: (10.0030, 50.0004)},
    **{13: (10.0024, 49.9990), 14: (10.0025, 50.0010), 15: (10.0024, 50.0030)},
}
WAYS = """
<way id="1"><nd ref="1"/><nd ref="2"/><nd ref="3"/><nd ref="4"/><nd ref="1"/></way>
<way id="2"><nd ref="5"/><nd ref="6"/><nd ref="7"/><nd ref="5"/></way>
<way id="3"><nd ref="8"/><nd ref="9"/><nd ref="10"/><nd ref="8"/>
  <tag k="building" v="garage"/></way>
<way id="4"><nd ref="11"/><nd ref="12"/><tag k="highway" v="residential"/></way>
<way id="5"><nd ref="13"/><nd ref="14"/><nd ref="15"/><tag k="power" v="line"/>
  <tag k="height" v="25"/></way>
<relation id="1"><member type="way" ref="1" role="outer"/><member type="way" ref="2" role="inner"/>
  <tag k="type" v="multipolygon"/><tag k="building" v="yes"/><tag k="height" v="12"/></relation>
"""
TREE = '<node id="20" lat="50.0008" lon="10.0006"><tag k="natural" v="tree"/></node>'


def osm(extra=""):
    nodes = "".join(f'<node id="{n}" lat="{y}" lon="{x}"/>' for n, (x, y) in NODES.items())
    return f'<osm version="0.6">{nodes}{extra}{WAYS}</osm>'


def town(text, file="town.osm"):
    Path(file).write_text(text)
    return imported(collection(feature(SQUARE)), *HOME, "--town", file)


def tops_m(scenario):
    """Kind -> heights of the obstacles of that kind [m]."""
    found = {}
    for obstacle in scenario.obstacles:
        top_m = -min(z for _, _, z in obstacle.vertices_m)
        found.setdefault(obstacle.kind, []).append(top_m)
    return {kind: sorted(heights) for kind, heights in found.items()}


def test_what_stands_is_as_high_as_its_tags_or_its_kind_say(capsys):
    scenario = town(osm(TREE))
    tree_m = STANDING["natural", "tree"].guessed_m
    assert tops_m(scenario) == {
        "building": [4.0, 12.0],
        "power_line": [25.0, 25.0],  # one for each of its straight parts
        "forest": [tree_m],
    }
    out = capsys.readouterr().out
    assert "2 buildings, the heights of 1 of them guessed" in out
    assert "OpenStreetMap contributors" in Path("out.toml").read_text("utf-8").splitlines()[0]


def test_no_uas_flies_through_a_power_line_where_it_was_drawn():
    scenario = town(osm())
    frame = LocalFrame(scenario.place)
    lines = [
        hull
        for obstacle, hull in zip(scenario.obstacles, scenario.hulls, strict=True)
        if obstacle.kind == "power_line"
    ]
    for (x0, y0), (x1, y1) in pairwise([NODES[13], NODES[14], NODES[15]]):
        for share in np.linspace(0.0, 1.0, 7):
            place = frame.to_ned(y0 + share * (y1 - y0), x0 + share * (x1 - x0), 20.0)
            if scenario.fence.signed_distance(place) < 0.0:
                assert min(hull.signed_distance(place) for hull in lines) < 0.0


def test_streets_are_drawn_and_nothing_else_knows_them():
    scenario = town(osm())
    streets = [item for item in scenario.decorations if item.kind == "street"]
    middle_m = LocalFrame(scenario.place).to_ned(50.00035, 10.0015)[:2]
    (street,) = streets
    assert np.ptp(street.polygon_m, axis=0)[1] > 150.0
    assert np.abs(np.mean(street.polygon_m, axis=0) - middle_m).max() < 12.0
    bare = town(osm().replace('k="highway"', 'k="was"'))
    assert bare.waypoints == scenario.waypoints
    assert bare.obstacles == scenario.obstacles


def test_binary_files_are_read_as_text_is():
    wanted = town(osm(TREE))
    with osmium.SimpleWriter("town.osm.pbf") as writer:
        for thing in osmium.FileProcessor("town.osm"):
            writer.add(thing)
    assert imported(collection(feature(SQUARE)), *HOME, "--town", "town.osm.pbf") == wanted


def test_the_order_of_a_file_is_no_matter():
    wanted = town(osm(TREE))
    body = osm(TREE).removeprefix('<osm version="0.6">').removesuffix("</osm>")
    nodes, ways = body.split("<way", 1)
    ways = f"<way{ways}".replace('way id="', 'way id="-').replace('ref="2" role', 'ref="-2" role')
    ways = ways.replace('ref="1" role', 'ref="-1" role')
    assert town(f'<osm version="0.6">{ways}{nodes}</osm>') == wanted


def test_a_building_of_which_the_file_lacks_corners_is_told(capsys):
    cut = '<way id="{}"><nd ref="{}"/><nd ref="99"/><tag k="building" v="yes"/></way>'
    part = osm().replace('<nd ref="3"/>', '<nd ref="99"/>')  # of the house
    more = cut.format(8, 14) + cut.format(9, 13)  # node 13 is outside
    town(part.replace("<relation", f"{more}<relation"))
    assert "2 outlines in the area lack corners in the file" in capsys.readouterr().out


SQUARE_OF = "".join(f'<nd ref="{n}"/>' for n in (8, 9, 10, 8))
KINDS = [
    *("chimney", "tower", "silo", "water_tower", "mast", "crane", "communications_tower"),
    *("cooling_tower", "storage_tank", "lighthouse", "antenna", "flagpole", "gasometer"),
]


def tags_of(**tags):
    return "".join(f'<tag k="{key}" v="{value}"/>' for key, value in tags.items())


def with_way(number, refs, tags):
    return osm().replace("<relation", f'<way id="{number}">{refs}{tags}</way><relation', 1)


@pytest.mark.parametrize("height", [None, "110", "33 m"])
@pytest.mark.parametrize("kind", KINDS)
def test_what_is_tall_is_an_obstacle_as_an_outline_a_point_and_a_multipolygon(kind, height):
    tags = tags_of(man_made=kind, **({"height": height} if height else {}))
    wanted = float(height.split()[0]) if height else STANDING["man_made", kind].guessed_m
    node = f'<node id="20" lat="50.0015" lon="10.0025">{tags}</node>'
    many = '<member type="way" ref="9" role="outer"/><tag k="type" v="multipolygon"/>'
    relation = f'<relation id="9">{many}{tags}</relation>'
    for text in (
        osm(node),
        with_way(9, SQUARE_OF, tags),
        with_way(9, SQUARE_OF, "").replace("</osm>", f"{relation}</osm>"),
    ):
        assert tops_m(town(text))["mast"] == [wanted]


@pytest.mark.parametrize(
    ("tags", "kind", "top_m"),
    [
        ({"power": "tower"}, "power_line", 60.0),
        ({"power": "generator", "generator:source": "wind"}, "mast", 250.0),
        ({"aerialway": "pylon", "height": "55"}, "mast", 55.0),
        ({"building:part": "yes", "height": "44", "min_height": "20"}, "building", 44.0),
        ({"disused:man_made": "chimney", "height": "80"}, "mast", 80.0),
        ({"amenity": "sculpture", "height": "33"}, "structure", 33.0),
        ({"role": "obstacle", "height": "33"}, "structure", 33.0),
        ({"Man_Made": "Tower", "Height": "ca. 45 m"}, "mast", 45.0),
    ],
)
def test_whatever_has_a_height_is_an_obstacle(tags, kind, top_m):
    node = f'<node id="20" lat="50.0015" lon="10.0025">{tags_of(**tags)}</node>'
    assert top_m in tops_m(town(osm(node)))[kind]
    scenario = town(with_way(9, SQUARE_OF, tags_of(**tags)))
    assert top_m in tops_m(scenario)[kind]


@pytest.mark.parametrize("refs", [(8, 9, 10, 8), (1, 3, 2, 4, 1)])
def test_a_closed_way_of_which_nothing_is_missing_is_an_outline_whatever_it_is_like(refs):
    corners = "".join(f'<nd ref="{n}"/>' for n in refs)  # the second crosses itself
    scenario = town(with_way(9, corners, tags_of(man_made="chimney", area="no", height="90")))
    assert 90.0 in tops_m(scenario)["mast"]


def test_cables_are_walls_along_their_line_also_where_it_is_closed():
    scenario = town(with_way(9, SQUARE_OF, tags_of(aerialway="gondola")))
    lines = [o for o in scenario.obstacles if o.kind == "power_line"]
    assert len(lines) == 2 + 3  # of the power line, and the three sides of the cable
    open_one = town(with_way(9, '<nd ref="8"/><nd ref="10"/>', tags_of(aerialway="cable_car")))
    assert STANDING["aerialway", "cable_car"].guessed_m in tops_m(open_one)["power_line"]


def test_tall_kinds_that_are_not_read_are_printed_by_name(capsys):
    nodes = [
        '<node id="20" lat="50.0008" lon="10.0006"><tag k="highway" v="street_lamp"/></node>',
        '<node id="21" lat="50.0008" lon="10.0007"><tag k="highway" v="street_lamp"/></node>',
        '<node id="22" lat="50.0008" lon="10.0008"><tag k="man_made" v="ski_jump"/></node>',
        '<node id="23" lat="51.0" lon="10.0"><tag k="man_made" v="far_away"/></node>',
    ]
    town(osm("".join(nodes)))
    out = capsys.readouterr().out
    assert "may be tall, and not read: 2 highway=street_lamp, 1 man_made=ski_jump;" in out


def test_an_outline_of_a_tower_that_is_small_stands():
    nodes = {30: (10.0020, 50.0005), 31: (10.00201, 50.0005), 32: (10.00201, 50.00051)}
    text = "".join(f'<node id="{n}" lat="{y}" lon="{x}"/>' for n, (x, y) in nodes.items())
    refs = "".join(f'<nd ref="{n}"/>' for n in (30, 31, 32, 30))
    way = f'<way id="9">{refs}{tags_of(man_made="mast", height="40")}</way><relation'
    assert tops_m(town(osm(text).replace("<relation", way)))["mast"] == [40.0]


def test_a_height_that_cannot_be_read_is_named_and_that_of_the_kind_counts(capsys):
    node = '<node id="20" lat="50.0008" lon="10.0006">{}</node>'
    scenario = town(osm(node.format(tags_of(man_made="mast", height="tall"))))
    assert tops_m(scenario)["mast"] == [100.0]
    assert "cannot be read, such as 'height=tall'" in capsys.readouterr().out
    town(osm(node.format(tags_of(tourism="artwork", height="tall", name="Big Joe"))))
    assert "left out: 1 thing of unknown height 'Big Joe'" in capsys.readouterr().out


def test_a_role_in_a_town_counts_and_areas_are_refused_there(capsys):
    zone = tags_of(role="no_fly", name="school")
    assert "no_fly" in tops_m(town(with_way(9, SQUARE_OF, zone)))
    assert "no_fly" in tops_m(town(with_way(9, SQUARE_OF, tags_of(name="No-fly zone clinic"))))
    assert "no_fly" not in tops_m(town(with_way(9, SQUARE_OF, tags_of(name="Restricted shop"))))
    town(with_way(9, SQUARE_OF, tags_of(role="outer", building="yes")))
    capsys.readouterr()
    Path("town.osm").write_text(with_way(9, SQUARE_OF, tags_of(role="fence")))
    line = refused(capsys, collection(feature(SQUARE)), *HOME, "--town", "town.osm")
    assert "says fence, which is no matter of --town" in line


def test_a_building_without_an_area_does_not_spoil_the_others(capsys):
    dot = '<way id="9"><nd ref="14"/><nd ref="14"/><nd ref="14"/><nd ref="14"/>{}</way><relation'
    dot = dot.format('<tag k="building" v="yes"/>')
    assert tops_m(town(osm().replace("<relation", dot))) == tops_m(town(osm()))
    assert "1 outlines in the area lack corners" in capsys.readouterr().out


def test_who_takes_off_in_a_wood_is_told_where(capsys):
    wood = '<way id="9">{}<tag k="natural" v="wood"/></way><relation'
    corners = (f'<nd ref="{n}"/>' for n in (1, 11, 12, 1))
    Path("town.osm").write_text(osm().replace("<relation", wood.format("".join(corners))))
    home = ("--home", "50.00035,10.0005")
    line = refused(capsys, collection(feature(SQUARE)), *home, "--town", "town.osm")
    assert "uas_1 would take off at 50.000350,10.000500, inside an obstacle (forest)" in line


BROKEN = {
    "nothing": (b"", "is no OpenStreetMap file"),
    "something else": (b"<html><body>429 Too Many Requests</body></html>", "top-level element"),
    "the answer of a server": (b'{"version": 0.6, "elements": []}', "is no OpenStreetMap file"),
    "half a file": (osm().encode()[:700], "is no OpenStreetMap file"),
    "entities": (
        b'<!DOCTYPE osm [<!ENTITY a "aaaaaaaaaa">]>' + osm().encode(),
        "XML entities are not supported",
    ),
    "a latitude of words": (osm().replace('"50.001"', '"north"').encode(), "no OpenStreetMap"),
    "a latitude beyond all": (osm().replace('"50.001"', '"1e9"').encode(), "no OpenStreetMap"),
    "no building": (b'<osm version="0.6"></osm>', "holds no building"),
}


@pytest.mark.parametrize("name", BROKEN)
def test_a_broken_file_is_refused_in_one_line(capsys, name):
    data, reason = BROKEN[name]
    Path("town.osm").write_bytes(data)
    line = refused(capsys, collection(feature(SQUARE)), *HOME, "--town", "town.osm")
    assert "town.osm: " in line
    assert reason in line


@pytest.mark.parametrize("data", [b"\x00\x00\x00\x0dgarbage" * 9, b"\xff" * 4, osm().encode()])
def test_what_is_no_binary_file_is_refused_in_one_line(capsys, data):
    Path("town.osm.pbf").write_bytes(data)
    line = refused(capsys, collection(feature(SQUARE)), *HOME, "--town", "town.osm.pbf")
    assert "town.osm.pbf: is no OpenStreetMap file" in line
