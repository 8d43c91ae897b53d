"""A mission whose scene changes in flight: planned from where it is, flown as planned."""

from dataclasses import replace

import numpy as np
import pytest
from hand_made import hover, straight
from small_fleets import fleet_of
from small_worlds import meadow
from uas_coverage_baselines.tour import Tour, TourOptions
from uas_coverage_baselines.tour.schedule import Schedule
from uas_coverage_baselines.trajectory import Trajectory, TrajectoryOptions
from uas_coverage_baselines.trajectory.mission_plan import Planned
from uas_coverage_baselines.trajectory.program import PlannedFlight
from uas_coverage_baselines.trajectory.under_way import UnderWay, still_clear

from uas_coverage_env import generate_scenario, load_planner, rollout
from uas_coverage_env.flight.metrics import accomplished
from uas_coverage_env.mission import MissionBrief
from uas_coverage_env.world import GoTo

GAPS_S = (15.0, 15.0)


def patrol(seed):
    """A small town whose waypoints are all asked for three times."""
    town = generate_scenario(seed=seed, n_uas=1, n_waypoints=10, n_obstacles=3)
    every = {"again_after_s": GAPS_S}
    waypoints = tuple(waypoint.model_copy(update=every) for waypoint in town.waypoints)
    return town.model_copy(update={"waypoints": waypoints, "relaunch": True})


class Watched(Trajectory):
    """Keeps the kinds of its commands."""

    def __init__(self):
        super().__init__(TrajectoryOptions(orders=1, moves=20_000, programs=40))
        self.commands = []

    def act(self, swarm):
        commands = super().act(swarm)
        self.commands += commands.values()
        return commands


@pytest.mark.parametrize("seed", [4, 5])
def test_what_is_asked_for_again_in_flight_is_flown_as_planned_and_within_the_limits(seed):
    planner = Watched()
    flight = rollout(patrol(seed), planner)
    assert accomplished(flight)
    assert flight.breaches == 0
    assert sum(decision.fallback for decision in flight.decisions) == 0
    # nothing but a landing is left to guidance
    assert all(each.mode == "return" for each in planner.commands if isinstance(each, GoTo))


def test_a_planner_of_a_mission_under_way_begins_a_new_one_as_a_fresh_planner_does():
    town = generate_scenario(seed=4, n_uas=1, n_waypoints=6, n_obstacles=2)
    for name in ("trajectory", "tour"):
        used = load_planner(name, {"moves": "20000"})
        rollout(patrol(4), used, max_steps=40)
        again = rollout(town, used, seed=3)
        assert (again.x == rollout(town, load_planner(name, {"moves": "20000"}), seed=3).x).all()


def test_tour_goes_on_from_its_order_without_a_long_search(monkeypatch):
    searches, begin = [], Schedule.begin

    def counted(self, view, seed):
        searches.append(view.time_s)
        begin(self, view, seed)

    monkeypatch.setattr(Schedule, "begin", counted)
    flight = rollout(patrol(4), Tour(TourOptions(moves=20_000)))
    assert accomplished(flight)
    assert searches == [0.0, 0.0]  # the first to warm up


def test_of_what_was_planned_holds_what_is_flown_as_planned():
    nothing = np.zeros(0, np.int64), np.zeros((7, 10)), np.zeros((6, 3)), np.zeros((6, 10))
    still = PlannedFlight(*nothing, 0.0, np.zeros(0))
    courses = [straight((10.0 * k, 0.0, -10.0), (2.0, 0.0, 0.0), 6, begin=4) for k in range(3)]
    planned = {k: Planned(np.zeros(0, np.int64), still, course) for k, course in enumerate(courses)}
    backups = {1: hover((0.0, 0.0, -10.0))}
    _, swarm = fleet_of(meadow(((20.0, 20.0, -1.0), (50.0, 20.0, -1.0), (80.0, 20.0, -1.0))))
    x = np.array([course.x[3] for course in courses])
    x[1, 0] += 0.01  # was pushed
    now = UnderWay(None, planned, backups).at(replace(swarm, step=7, x=x))
    assert now.planned.keys() == {0, 2}
    assert now.planned[2] is planned[2]
    assert now.backups is backups
    assert not UnderWay(None, planned).at(replace(swarm, step=6, x=x)).planned


def test_only_a_scene_with_at_most_more_waypoints_is_as_clear_as_it_was():
    town = generate_scenario(seed=4, n_uas=1, n_waypoints=6, n_obstacles=2)
    brief = MissionBrief.of(town)
    more = town.model_copy(update={"waypoints": (*town.waypoints, town.waypoints[0])})
    less = town.model_copy(update={"waypoints": town.waypoints[1:]})
    other = town.model_copy(update={"obstacles": town.obstacles[1:]})
    assert still_clear(brief, brief)
    assert still_clear(brief, MissionBrief.of(more))
    assert not still_clear(brief, MissionBrief.of(less))
    assert not still_clear(brief, MissionBrief.of(other))


@pytest.mark.parametrize("name", ["trajectory", "tour"])
def test_what_is_going_to_be_asked_for_is_planned_before_it_is(name):
    """A UAS that knows only what is open flies home between, and out again for each waypoint."""
    town = generate_scenario(seed=4, n_uas=1, n_waypoints=5, n_obstacles=2)
    once = rollout(town, load_planner(name, {"moves": "20000"}))
    gap_s = 1.2 * once.steps * town.dt_s
    again = tuple(w.model_copy(update={"again_after_s": (gap_s,)}) for w in town.waypoints)
    planner = load_planner(name, {"moves": "20000"})
    flight = rollout(town.model_copy(update={"waypoints": again, "relaunch": True}), planner)
    assert accomplished(flight)
    assert flight.breaches == 0
    # it waits no longer than for the first waypoint, and then flies the same once more
    assert flight.steps < gap_s / town.dt_s + 1.25 * once.steps


def test_a_planner_flies_the_same_repeated_mission_twice_as_a_fresh_one_does():
    for name in ("trajectory", "tour"):
        used = load_planner(name, {"moves": "20000"})
        first, second = (rollout(patrol(4), used, max_steps=60) for _ in range(2))
        assert (first.x == second.x).all()
