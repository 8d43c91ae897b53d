"""One waypoint is closed off: every planner covers the others, comes home and says so."""

import pytest
from closed_yards import HOME, INSIDE, OPEN, ring, yard
from small_worlds import meadow, waypoint

from uas_coverage_env.flight import Why, load_planner, rollout

LITTLE_MILP = {"horizon": 10, "threads": 1, "teams": 2, "at_once": 1}
PLANNERS = {
    "nearest-waypoint": {},
    "lawnmower": {},
    "trajectory": {"orders": 1, "moves": 20_000, "programs": 40, "idle_work": 0},
    "tour": {"moves": 20_000, "changes": 50},
    "milp-mpc": LITTLE_MILP,
    "learned-route": {"samples": 4, "changes": 1000, "rehearsed": 1},
    "learned-velocity": {},
}


@pytest.mark.slow
@pytest.mark.parametrize("name", PLANNERS)
def test_a_planner_flies_the_rest_where_one_waypoint_is_closed_off(name):
    flight = rollout(yard(), load_planner(name, PLANNERS[name]))
    assert flight.covered[-1] == 2
    assert flight.mode[-1].tolist() == [3]
    assert flight.violations == ()
    assert flight.breaches == 0
    assert [(one.waypoint, one.why) for one in flight.left_open] == [(1, Why.NO_WAY)]


@pytest.mark.parametrize("first", [0, 1, 2])
def test_trajectory_flies_the_rest_at_once_wherever_the_closed_one_stands_in_the_list(first):
    places = [waypoint(OPEN[0], 8.0), waypoint(OPEN[1], 8.0)]
    places.insert(first, waypoint(INSIDE, 5.0))
    scenario = meadow((HOME,), obstacles=ring(), waypoints=places, max_steps=100)
    flight = rollout(scenario, load_planner("trajectory", PLANNERS["trajectory"]))
    assert (flight.covered[-1], flight.mode[-1].tolist()) == (2, [3])
    assert flight.steps < 50
    assert [one.waypoint for one in flight.left_open] == [first]


def test_tour_leaves_out_what_is_closed_off_before_it_takes_off():
    planner = load_planner("tour", PLANNERS["tour"])
    flight = rollout(yard(), planner)
    assert (flight.covered[-1], flight.mode[-1].tolist()) == (2, [3])
    assert flight.steps < 50
    assert planner.given_up == {1: "no way to it"}


def test_trajectory_leaves_what_is_closed_off_to_a_uas_that_has_a_way():
    starts = (HOME, (INSIDE[0] + 8.0, INSIDE[1], -1.0))
    places = [waypoint(OPEN[0], 8.0), waypoint(INSIDE, 5.0)]
    scenario = meadow(starts, obstacles=ring(), waypoints=places, max_steps=100)
    flight = rollout(scenario, load_planner("trajectory", PLANNERS["trajectory"]))
    assert (flight.covered[-1], flight.mode[-1].tolist()) == (2, [3, 3])
