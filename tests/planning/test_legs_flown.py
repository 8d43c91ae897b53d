"""Missions that an autopilot is going to fly: few straight legs, as long as its file takes."""

import numpy as np
import pytest
from small_worlds import box, meadow, waypoint

from uas_coverage_env import load_planner, rollout
from uas_coverage_env.flight.metrics import coverage
from uas_coverage_env.mission import MissionBrief
from uas_coverage_env.planning.execution.lateness import Timed, pairs_of
from uas_coverage_env.planning.execution.leg_course import CoursePlanner
from uas_coverage_env.planning.execution.leg_follower import LegFollower
from uas_coverage_env.planning.execution.leg_model import Autopilot
from uas_coverage_env.planning.routing.clock import CUTTING
from uas_coverage_env.planning.routing.legs import Legs
from uas_coverage_env.scenario import Execution, Scenario
from uas_coverage_env.world import Velocity

ROW = [waypoint((north, 60.0, -20.0), 6.0) for north in (40.0, 80.0, 120.0)]


def by_autopilot(scenario, **changes):
    execution = Execution(flown_by="autopilot", **changes)
    return scenario.model_copy(update={"execution": execution})


def corners_of(scenario, route):
    return CoursePlanner(MissionBrief.of(by_autopilot(scenario))).corners(0, route)


def test_waypoints_in_a_row_are_one_leg():
    places_m = corners_of(meadow(waypoints=ROW), [0, 1, 2]).places_m
    assert len(places_m) == 4  # above the start, to the first, along the row, home
    assert places_m[2].tolist() == [120.0, 60.0, -20.0]


@pytest.mark.parametrize(("aside_m", "legs"), [(2.5, 3), (3.5, 4)])
def test_a_leg_passes_what_is_within_the_radius_less_tolerance_and_tracking(aside_m, legs):
    row = [ROW[0], waypoint((80.0, 60.0 + aside_m, -20.0), 6.0), ROW[2]]
    assert len(corners_of(meadow(waypoints=row), [0, 1, 2]).speeds_mps) == legs


@pytest.mark.parametrize("aside_m", [0.0, 2.5])
def test_a_leg_is_so_slow_that_it_flies_through_no_sphere_between_two_samples(aside_m):
    row = [ROW[0], waypoint((80.0, 60.0 + aside_m, -20.0), 6.0), ROW[2]]
    scenario = meadow(waypoints=row)
    (speed,) = corners_of(scenario, [0, 1, 2]).speeds_mps[1:-1]
    in_it_m = 2.0 * np.sqrt(6.0**2 - aside_m**2)
    assert 0.85 * in_it_m < speed * scenario.dt_s < in_it_m


def test_legs_lead_over_a_low_roof_and_keep_its_distance():
    house = box("house", (60.0, 20.0, -25.0), (70.0, 100.0, 0.0), safe_distance_m=2.0)
    scenario = meadow(obstacles=[house], waypoints=ROW)
    corners = corners_of(scenario, [0, 1])
    ends = np.array([corners.places_m[1:-1], corners.places_m[2:]]).transpose(1, 0, 2)
    inside = [a + t * (b - a) for a, b in ends for t in np.linspace(0.0, 1.0, 50)]
    clear_m = scenario.hulls[0].signed_distance(np.array(inside)).min()
    assert clear_m > scenario.uas[0].radius_m + 2.0


def test_a_leg_keeps_the_speed_that_its_waypoints_ask_for():
    slow = {**ROW[2], "max_speed_mps": 4.0, "sensor": "camera"}
    scenario = meadow(waypoints=[*ROW[:2], slow])
    fleet = [scenario.uas[0].model_dump() | {"sensors": [{"name": "camera"}]}]
    scenario = Scenario.model_validate(scenario.model_dump(by_alias=True) | {"uas": fleet})
    speeds = corners_of(scenario, [0, 1, 2]).speeds_mps
    assert max(speeds[:-1]) > 4.0 >= speeds[1]


def test_corners_cost_what_the_leg_model_loses_in_them_and_straight_on_costs_nothing():
    scenario = meadow(waypoints=ROW)
    legs = Legs(MissionBrief.of(by_autopilot(scenario, corner_m=1.0)))
    by = Autopilot.of(scenario.vehicles[0], 1.0)
    assert legs.turn_s[0].tolist() == [by.turn_s] * 3
    assert by.turn_s > Autopilot.of(scenario.vehicles[0], 8.0).turn_s > 0.0
    assert legs.turn_of_cosine[[128, 256]].tolist() == [1.0, 0.0]
    assert Legs(MissionBrief.of(scenario)).turn_of_cosine is CUTTING


CROSSING = [waypoint((150.0, 140.0, -20.0), 6.0), waypoint((150.0, 60.0, -20.0), 6.0)]
STARTS_M = (50.0, 60.0, -1.0), (50.0, 140.0, -1.0)


def test_uas_that_cross_wait_on_the_ground_until_one_may_be_late():
    scenario = by_autopilot(meadow(STARTS_M, waypoints=CROSSING))
    follower = LegFollower(MissionBrief.of(scenario))
    follower.begin([[0], [1]])
    names = [uas.name for uas in scenario.uas]
    flown = [Timed(u, names[u], course.followed) for u, course in enumerate(follower.courses)]
    (pair,) = pairs_of(scenario, flown)
    assert pair.slack_s >= 20.0


@pytest.mark.parametrize(
    ("planner", "options"),
    [("tour", {"moves": 1000}), ("trajectory", {"moves": 1000}), ("lawnmower", {})],
)
def test_planners_fly_to_the_time_of_the_legs_and_accomplish_the_mission(planner, options):
    scenario = by_autopilot(meadow(waypoints=ROW, max_steps=400))
    flight = rollout(scenario, load_planner(planner, options))
    assert (coverage(flight), flight.breaches, flight.violations) == (1.0, 0, ())
    planned = CoursePlanner(MissionBrief.of(scenario))
    times_s = [
        planned.course(0, planned.corners(0, route)).lands_s for route in ([0, 1, 2], [2, 1, 0])
    ]
    assert min(times_s) - 2.0 < flight.last_sample[0] * scenario.dt_s < max(times_s) + 12.0


def test_a_uas_that_is_late_finds_time_stopped_where_it_is():
    scenario = by_autopilot(meadow(waypoints=ROW))
    brief = MissionBrief.of(scenario)
    flight = rollout(scenario, Held(follower_of(brief), until_s=40.0))
    assert coverage(flight) == 1.0
    assert (
        flight.last_sample[0] > rollout(scenario, Held(follower_of(brief), 0.0)).last_sample[0] + 15
    )


def follower_of(brief):
    follower = LegFollower(brief)
    follower.begin([[0, 1, 2]])
    return follower


class Held:
    """Flies along, but hovers between 20 s and a later time, whatever it should do."""

    def __init__(self, follower, until_s):
        self._follower, self._until_s = follower, until_s

    def reset(self, brief, seed):
        pass

    def act(self, swarm):
        route = [w for w in (0, 1, 2) if swarm.uncovered[w]]
        commands = self._follower.commands(swarm, [route])
        if 20.0 < swarm.time_s < self._until_s:
            return {name: Velocity(0.0, 0.0, -swarm.x[0, 2]) for name in commands}
        return commands


def test_a_follower_that_takes_over_in_the_air_flies_on_from_where_the_uas_is():
    scenario = by_autopilot(meadow(waypoints=ROW))
    brief = MissionBrief.of(scenario)

    class Replaced(Held):
        def act(self, swarm):
            if swarm.step == 25:
                self._follower = follower_of(brief)
            return super().act(swarm)

    flight = rollout(scenario, Replaced(follower_of(brief), 0.0))
    whole = rollout(scenario, Held(follower_of(brief), 0.0))
    assert coverage(flight) == 1.0
    assert flight.last_sample[0] < whole.last_sample[0] + 15
