"""Which waypoints have a way to them, and what closes off the others."""

import pytest
from closed_yards import HOME, INSIDE, OPEN, ring, yard
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from small_worlds import box, meadow, waypoint

from uas_coverage_env.mission import MissionBrief
from uas_coverage_env.mission.access import Access

OPEN_GAP_M = 2.0 * (0.36 + 2.0 + 1.0)  # radius, safe distance and the margin of routes


def access(scenario):
    return Access(MissionBrief.of(scenario))


def test_a_ring_of_zones_closes_off_what_is_inside_it_and_nothing_else():
    made = access(yard())
    assert made.has_way.tolist() == [[True, False, True]]
    assert made.closed_by(0, 1) in [("zone_south",), ("zone_west",)]
    assert made.why_closed(0, 1).startswith("closed off by no-fly zone zone_")


def test_buildings_are_not_called_zones():
    made = access(yard(ring(kind="building", name="house")))
    assert made.why_closed(0, 1).startswith("closed off by house_")


def test_what_can_be_flown_over_closes_off_nothing():
    # above 25 m routes go round where they can, and below the ceiling over it where they cannot
    for top_m in (5.0, 20.0, 30.0, 40.0):
        assert access(yard(ring(top_m))).has_way.all()


@pytest.mark.parametrize(
    ("gap_m", "is_open"), [(OPEN_GAP_M + 0.5, True), (OPEN_GAP_M - 0.5, False)]
)
def test_a_gap_is_a_way_from_twice_the_distance_of_routes_on(gap_m, is_open):
    assert bool(access(yard(ring(gap_m=gap_m))).has_way[0, 1]) is is_open


def test_gaps_that_a_uas_fits_through_but_routes_do_not_are_named():
    narrow = access(yard(ring(gap_m=OPEN_GAP_M - 0.5))).narrow_gaps
    assert [gap.width_m for gap in narrow] == pytest.approx([OPEN_GAP_M - 0.5])
    assert [gap.needed_m for gap in narrow] == pytest.approx([OPEN_GAP_M])
    assert all(name.startswith("zone_") for name in narrow[0].between)
    assert not access(yard(ring(gap_m=OPEN_GAP_M + 0.5))).narrow_gaps
    # walls that touch, and a slit that no UAS fits through, are no gaps
    assert not access(yard()).narrow_gaps
    assert not access(yard(ring(gap_m=0.7))).narrow_gaps
    # what can be flown over closes nothing
    assert not access(yard(ring(20.0, gap_m=5.0))).narrow_gaps


def test_a_smaller_margin_of_routes_opens_a_gap():
    scenario = yard(ring(gap_m=OPEN_GAP_M - 0.5))
    made = access(scenario.model_copy(update={"route_margin_m": 0.3}))
    assert made.has_way.all()
    assert not made.narrow_gaps


def test_a_sphere_that_reaches_out_of_the_ring_can_be_covered_from_outside():
    assert not access(yard(radius_m=20.0)).has_way[0, 1]
    assert access(yard(radius_m=40.0)).has_way[0, 1]


def test_an_obstacle_on_the_way_that_closes_nothing_is_not_named():
    tower = box("tower", (60.0, 60.0, -50.0), (80.0, 80.0, 0.0))
    assert access(yard([*ring(), tower])).closed_by(0, 1)[0].startswith("zone_")


def test_where_one_alone_opens_nothing_all_on_the_straight_way_are_named_nearest_first():
    inner, outer = ring(half_m=20.0, name="inner"), ring(half_m=40.0, name="outer")
    made = access(yard([*inner, *outer]))
    names = made.closed_by(0, 1)
    assert {name.partition("_")[0] for name in names} == {"inner", "outer"}
    assert names[0].startswith("inner")
    assert made.why_closed(0, 1).startswith("closed off, behind no-fly zone inner_")


def test_a_home_that_is_closed_in_has_a_way_to_what_is_closed_in_with_it_only():
    places = [waypoint((140.0, 140.0, -10.0), 5.0), waypoint(OPEN[0], 5.0)]
    made = access(meadow(((*INSIDE[:2], -1.0), HOME), obstacles=ring(), waypoints=places))
    assert made.has_way.tolist() == [[True, False], [False, True]]


places = st.tuples(st.floats(8.0, 190.0), st.floats(8.0, 190.0))


@settings(max_examples=25, deadline=None)
@given(where=places)
def test_a_place_is_closed_off_exactly_where_it_lies_inside_the_ring(where):
    away_m = max(abs(where[0] - INSIDE[0]), abs(where[1] - INSIDE[1]))
    assume(not 21.0 <= away_m <= 33.0)  # in the walls, or too near to them
    point = waypoint((*where, -10.0), 0.5)
    made = access(meadow((HOME,), obstacles=ring(), waypoints=[point]))
    assert bool(made.has_way[0, 0]) is (away_m > 33.0)
