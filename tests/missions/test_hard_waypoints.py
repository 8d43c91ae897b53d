"""One hard waypoint does not take the mission down: reached with care, or left and given up."""

import numpy as np
import pytest
from hard_missions import TOWER, mission

from uas_coverage_env.flight import load_planner, rollout

EASY = ((60.0, 120.0, -14.0), 10.0)
HARD = {
    "at the ceiling": ((60.0, 60.0, -49.8), 1.0),
    "at a corner of the ceiling": ((199.8, 199.8, -49.8), 2.0),
    "at the foot of a wall": ((100.0, 88.5, -5.0), 3.0),
}
OUT_OF_REACH = ((100.0, 89.0, -5.0), 1.0)
"""Nearer to a wall than its safe distance allows."""


def flown(planner, *waypoints):
    scenario = mission(*waypoints, obstacles=[TOWER]).as_scenario()
    return rollout(scenario, load_planner(planner, {}), seed=0)


@pytest.mark.parametrize("where", HARD)
@pytest.mark.parametrize("planner", ["nearest-waypoint", "lawnmower", "learned-velocity"])
def test_a_hard_waypoint_is_covered_and_the_swarm_comes_home(planner, where):
    flight = flown(planner, HARD[where], EASY)
    assert flight.covered[-1] == 2
    assert flight.ended == "complete"
    assert not flight.violations
    assert flight.breaches == 0
    assert len(flight.decisions) < 160


def test_small_waypoints_are_covered_by_the_policy_that_never_saw_such():
    small = [((60.0, 60.0, -14.0), 1.0), ((100.0, 60.0, -14.0), 2.0), ((120.0, 140.0, -14.0), 3.0)]
    flight = flown("learned-velocity", *small)
    assert flight.covered[-1] == len(small)
    assert not flight.violations


@pytest.mark.parametrize("planner", ["nearest-waypoint", "lawnmower"])
def test_what_cannot_be_covered_is_given_up_for_the_others_and_in_the_end(planner):
    flight = flown(planner, OUT_OF_REACH, EASY)
    assert flight.covered[-1] == 1
    assert flight.ended == "complete"
    assert not flight.violations
    assert flight.breaches == 0
    covered_at = int(np.argmax(flight.covered))
    assert 60 < covered_at < len(flight.decisions) < 250
