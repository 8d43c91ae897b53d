"""The table of roles, kinds and heights: what a word, a tag and a length mean."""

import math
from collections import Counter

import pytest

pytest.importorskip("shapely")
from hypothesis import given
from hypothesis import strategies as st

from uas_coverage_env.files.errors import InputError
from uas_coverage_env.operations.area_import.drawn_areas import (
    DrawnPolygon,
    LeftOut,
    TakeOff,
    drawn_of,
)
from uas_coverage_env.operations.area_import.feature_roles import ROLES, UNSAID
from uas_coverage_env.operations.area_import.geo_features import GeoFeature, attributes_of
from uas_coverage_env.operations.area_import.length_texts import length_m
from uas_coverage_env.operations.area_import.osm_tags import (
    LEAST_M,
    MET_TALL,
    STANDING,
    half_width_m,
    height_m,
    not_read,
    standing_of,
)

RING = [[8.0, 50.0], [8.001, 50.0], [8.001, 50.001], [8.0, 50.001], [8.0, 50.0]]
GEOMETRIES = {
    "polygon": {"type": "Polygon", "coordinates": [RING]},
    "line": {"type": "LineString", "coordinates": RING[:3]},
    "point": {"type": "Point", "coordinates": RING[0]},
    "nothing": None,
}
CLOSED = {"type": "LineString", "coordinates": RING}


def made(geometry, attributes):
    """What a feature becomes: the words of the table, or `refused`."""
    thing = GeoFeature("f", "one", geometry, attributes_of(attributes))
    try:
        (one,) = drawn_of(thing)
    except InputError as error:
        line = str(error)
        return "refused" if line.startswith("f: ") and len(line) < 250 else line
    if isinstance(one, DrawnPolygon):
        names = {"search": "area", "no_fly": "zone"}
        return names.get(one.role, one.role)
    return "left out" if isinstance(one, LeftOut) else "take-off place"


@pytest.mark.parametrize("shape", GEOMETRIES)
@pytest.mark.parametrize("role", ROLES)
def test_what_has_a_role_becomes_what_the_table_says(role, shape):
    attributes = {"role": role}
    if role == "obstacle":
        attributes |= {"height": 30, "radius_m": 4, "width": 4}
    wanted = getattr(ROLES[role], shape)
    assert made(GEOMETRIES[shape], attributes) == wanted
    if shape == "polygon":
        assert made(CLOSED, attributes) == wanted
    for spelling in ROLES[role].spellings:
        assert (
            made(GEOMETRIES[shape], {**attributes, "ROLE": spelling.upper(), "role": ""}) == wanted
        )


@pytest.mark.parametrize("shape", GEOMETRIES)
def test_what_says_nothing_becomes_what_the_table_says(shape):
    assert made(GEOMETRIES[shape], {}) == getattr(UNSAID, shape)
    assert made(GEOMETRIES[shape], {"name": "x"}) == getattr(UNSAID, shape)
    assert made(CLOSED, {}) == "left out"


@pytest.mark.parametrize("role", ["no_fly", "fence"])
@pytest.mark.parametrize("shape", GEOMETRIES)
def test_each_word_of_a_name_counts_as_the_role_does(role, shape):
    for word in ROLES[role].words:
        for text in (word, word.upper(), f"x {word.title()} 2", word.replace(" ", "_")):
            name = text.replace("*", "e")
            assert made(GEOMETRIES[shape], {"name": name}) == getattr(ROLES[role], shape), name


def test_nothing_that_is_firm_is_ever_left_out():
    for role in ("no_fly", "fence", "obstacle"):
        row = ROLES[role]
        assert "left out" not in (row.polygon, row.line, row.point, row.nothing)


LENGTHS = {
    "12": 12.0,
    "12.5 m": 12.5,
    "12,5": 12.5,
    "40 ft": 12.192,
    "40'": 12.192,
    "40'6\"": 12.3444,
    "40 ft 6 in": 12.3444,
    "160’": 48.768,
    "ca. 50 m": 50.0,
    "~50m": 50.0,
    "50;60": 60.0,
    "50-60 m": 60.0,
    "50 – 60": 60.0,
    "<80": 80.0,
    "1,200 ft": 365.76,
    "0.1 km": 100.0,
    "500 cm": 5.0,
    "50 Meter hoch": 50.0,
    "120 metres (est.)": 120.0,
    "5 storeys": 16.0,
    100: 100.0,
    99.5: 99.5,
}


@pytest.mark.parametrize("text", LENGTHS)
def test_lengths_are_read_as_people_write_them(text):
    assert length_m(text) == pytest.approx(LENGTHS[text])


@pytest.mark.parametrize("text", ["tall", "", None, True, "-3", "m", [], "high (see photo)"])
def test_what_names_no_length_is_none(text):
    assert math.isnan(length_m(text))


@given(st.floats(1.0, 999.0), st.sampled_from(["", " m", "m", " metres", " ft", "ft", "'"]))
def test_a_length_in_any_unit_is_right(value, unit):
    metres = value * (0.3048 if "f" in unit or "'" in unit else 1.0)
    assert length_m(f"{value:.4f}{unit}") == pytest.approx(metres, abs=1e-3)


@given(st.text(max_size=30))
def test_no_text_breaks_a_length_and_a_height(text):
    assert not length_m(text) < 0.0
    top_m, known = height_m({"height": text}, 9.0)
    assert 0.0 < top_m <= 1_000.0 or not known


@pytest.mark.parametrize("tag", STANDING)
def test_each_kind_of_the_table_stands_as_high_as_it_says_in_any_case(tag):
    key, value = tag
    what = standing_of(attributes_of({key.upper(): value.replace("*", "other").title()}))
    assert what.guessed_m == STANDING[tag].guessed_m > LEAST_M
    disused = standing_of(attributes_of({f"disused:{key}": value.replace("*", "other")}))
    assert disused == what


@pytest.mark.parametrize(
    ("tags", "top_m"),
    [
        ({"building": "yes", "man_made": "chimney"}, 100.0),  # the highest of its kinds
        ({"building": "silo"}, 30.0),
        ({"building": "water_tower"}, 50.0),
        ({"man_made": "tower;communications_tower"}, 250.0),
        ({"building:part": "yes", "min_height": "20", "height": "30"}, 30.0),  # from the ground
        ({"man_made": "tower", "height": "ca. 62 m"}, 62.0),
        ({"generator:source": "wind", "height:hub": "100", "rotor:diameter": "120"}, 160.0),
        ({"man_made": "pipeline", "height": "12"}, 12.0),  # whatever has a height
        ({"building": "yes", "building:levels": "4;6", "roof:height": "9"}, 6 * 3.2 + 9.0),
        ({"building": "yes", "building:levels": "3,5"}, 3.5 * 3.2 + 2.0),
    ],
)
def test_what_stands_is_as_high_as_its_tags_say(tags, top_m):
    what = standing_of(tags)
    assert height_m(tags, what.guessed_m)[0] == pytest.approx(top_m)


def test_what_is_low_or_unknown_does_not_stand_but_is_named_where_it_may_be_tall():
    assert standing_of({"man_made": "pier"}) is None
    assert standing_of({"barrier": "fence", "height": "2"}) is None
    assert standing_of({"barrier": "wall", "height": "4"}) is not None
    assert standing_of({"building": "no"}) is None
    assert not_read({"man_made": "ski_jump"}) == "man_made=ski_jump"
    assert not_read({"man_made": "pier"}) is None
    for key, value in MET_TALL:
        assert not_read({key: value}) == f"{key}={value}"
        assert standing_of({key: value, "height": "12"}) is not None


def test_a_width_that_is_tagged_counts_where_it_is_more():
    mast = STANDING["man_made", "mast"]
    assert half_width_m({}, mast) == mast.half_width_m
    assert half_width_m({"diameter": "20 m"}, mast) == 10.0
    assert half_width_m({"diameter": "1"}, mast) == mast.half_width_m
    turbine = STANDING["generator:source", "wind"]
    assert half_width_m({"rotor:diameter": "200"}, turbine) == 100.0


def test_a_height_that_cannot_be_read_is_counted():
    unread = Counter()
    assert height_m({"height": "tall", "building:levels": "many"}, 9.0, unread) == (9.0, False)
    assert unread == {"height=tall": 1, "building:levels=many": 1}


def test_a_take_off_place_may_be_drawn_as_several_points():
    many = {"type": "MultiPoint", "coordinates": RING[:2]}
    places = list(drawn_of(GeoFeature("f", "one", many, {"role": "home"})))
    assert [type(place) for place in places] == [TakeOff, TakeOff]
