"""When a UAS returns: by the waypoints that are left and the ways to them, not by the fence."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from practice_missions import corners, mission, obstacle
from uas_coverage_baselines.milp_mpc.return_rule import ReturnRule

from uas_coverage_env.flight import load_planner, rollout
from uas_coverage_env.flight.figures import summary
from uas_coverage_env.mission import MissionBrief, Ways
from uas_coverage_env.vehicle import load_vehicle
from uas_coverage_env.vehicle.params import return_threshold
from uas_coverage_env.vehicle.range import dod_per_s

S500 = load_vehicle("s500_v2")
START = (50.0, 50.0, -1.0)
NEAR, FAR = (60.0, 150.0, -20.0), (190.0, 190.0, -20.0)
OPEN = np.ones(2, bool)


def field(low_m, high_m, places, start=START, **fields):
    """A mission with a square fence between two corners."""
    fence = {"margin_m": 0.5, "vertices_m": corners((low_m, low_m, -60.0), (high_m, high_m, 0.0))}
    return mission([(place, 5.0) for place in places], [start], geofence=fence, **fields)


def rule(scenario, detour=1.5, routed=True):
    brief = MissionBrief.of(scenario)
    return ReturnRule(brief, [detour] * len(brief.uas), Ways(brief) if routed else None)


def due_s(threshold):
    """How many seconds before DoD_max a UAS of the practice missions returns."""
    return (0.75 - threshold) / dod_per_s(S500, 0.75)


@pytest.mark.parametrize("size_m", [300.0, 4000.0, 20000.0])
def test_a_larger_fence_keeps_back_no_more(size_m):
    here, small = np.array(START), rule(field(0.0, 300.0, [NEAR, FAR]))
    large = rule(field(0.0, size_m, [NEAR, FAR]))
    assert large.dod_return("uas_1", here, OPEN) == small.dod_return("uas_1", here, OPEN)


def test_what_is_kept_back_takes_it_to_the_nearest_open_waypoint_and_home():
    both, here = rule(field(0.0, 300.0, [NEAR, FAR]), detour=1.0), np.array(START)
    level_m = np.hypot(10.0, 100.0)
    # 1 m down to 20 m up at 3 m/s, and down again at 1.5 m/s, are slower than the level part
    seconds = max(level_m / 12.0, 19.0 / 3.0) + max(level_m / 12.0, 19.0 / 1.5)
    assert due_s(both.dod_return("uas_1", here, OPEN)) == pytest.approx(seconds + 22.0, abs=0.01)
    far_only = due_s(both.dod_return("uas_1", here, np.array([False, True])))
    assert far_only == pytest.approx(2.0 * np.hypot(140.0, 140.0) / 12.0 + 22.0, abs=0.01)


def test_a_way_round_a_wall_counts_and_not_the_straight_one_through_it():
    wall = obstacle((0.0, 80.0, -60.0), (150.0, 84.0, 0.0), "wall")
    scenario = field(0.0, 300.0, [NEAR], obstacles=[wall])
    here, only = np.array(START), np.ones(1, bool)
    round_it = due_s(rule(scenario).dod_return("uas_1", here, only))
    straight = due_s(rule(scenario, routed=False).dod_return("uas_1", here, only))
    assert round_it > straight + 1.5 * 2.0 * 100.0 / 12.0


def test_the_more_is_covered_near_by_the_earlier_a_uas_returns():
    made, here = rule(field(0.0, 300.0, [NEAR, FAR])), np.array(START)
    later = made.dod_return("uas_1", here, OPEN)
    assert made.dod_return("uas_1", here, np.array([False, True])) < later


def test_a_waypoint_is_beyond_exactly_where_a_return_would_be_due_if_it_were_the_only_one():
    made, here = rule(field(0.0, 300.0, [NEAR, FAR])), np.array(START)
    due = [made.dod_return("uas_1", here, np.arange(2) == w) for w in range(2)]
    assert due[1] < due[0]
    assert made.beyond("uas_1", here, due[1] - 1e-6, OPEN) == set()
    assert made.beyond("uas_1", here, due[1] + 1e-6, OPEN) == {1}
    assert made.beyond("uas_1", here, due[0] + 1e-6, OPEN) == {0, 1}
    assert made.beyond("uas_1", here, due[0] + 1e-6, np.array([True, False])) == {0}


def test_the_vehicles_own_rule_asks_for_no_waypoints():
    made, here = rule(field(0.0, 300.0, [NEAR, FAR]), detour=None), np.array(START)
    assert made.dod_return("uas_1", here, OPEN) == return_threshold(S500, 0.75)
    assert made.beyond("uas_1", here, 0.74, OPEN) == set()


metres = st.floats(5.0, 3000.0)


@settings(max_examples=40, deadline=None)
@given(places=st.lists(st.tuples(metres, metres, st.floats(-50.0, -5.0)), min_size=1, max_size=6))
def test_a_uas_returns_when_and_only_when_all_that_is_open_is_beyond(places):
    made = rule(field(0.0, 3100.0, places), routed=False)
    here, everything = np.array(START), np.ones(len(places), bool)
    due = made.dod_return("uas_1", here, everything)
    for dod in (due - 1e-6, due + 1e-6):
        left = set(range(len(places))) - made.beyond("uas_1", here, dod, everything)
        assert bool(left) == (dod < due)


def flown(scenario):
    return rollout(scenario, load_planner("milp-mpc", {"horizon": 10}))


SMALL_AREA = {
    "4 km, home in a corner, behind a house": (-30.0, 4000.0, (110.0, 0.0, -20.0)),
    "4 km, home in a corner, near by": (-30.0, 4000.0, (-20.0, -20.0, -10.0)),
    "4 km, home in a corner, 400 m out": (-30.0, 4000.0, (300.0, 250.0, -30.0)),
    "10 km, home in the middle, behind a house": (-5000.0, 5000.0, (110.0, 0.0, -20.0)),
    "10 km, home in the middle, to the south": (-5000.0, 5000.0, (-300.0, 0.0, -40.0)),
    "10 km, home in the middle, to the west": (-5000.0, 5000.0, (0.0, -60.0, -5.0)),
}


@pytest.mark.slow
@pytest.mark.parametrize(("low_m", "high_m", "place"), SMALL_AREA.values(), ids=SMALL_AREA)
def test_what_is_near_home_is_covered_however_large_the_fence_is(low_m, high_m, place):
    house = obstacle((40.0, -20.0, -55.0), (50.0, 30.0, 0.0), "house")
    flight = flown(field(low_m, high_m, [place], start=(0.0, 0.0, -1.0), obstacles=[house]))
    result = summary(flight)
    assert (result["coverage"], result["all_home"], result["violations"]) == (1.0, True, [])
    assert flight.steps <= 120


@pytest.mark.slow
def test_a_waypoint_kilometres_away_is_covered_where_the_battery_allows_it():
    flight = flown(field(-30.0, 4000.0, [(1500.0, 30.0, -20.0)], (0.0, 0.0, -1.0)))
    result = summary(flight)
    assert (result["coverage"], result["all_home"]) == (1.0, True)
