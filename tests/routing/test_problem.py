"""The fleet as a routing problem: what is kept of the flying time, who may go where, how quick."""

from types import SimpleNamespace

import numpy as np
import pytest

from uas_coverage_env import generate_scenario
from uas_coverage_env.mission import MissionBrief, first_sight
from uas_coverage_env.planning.reserves import Reserve
from uas_coverage_env.planning.routing import RoutingProblem
from uas_coverage_env.planning.routing.legs import Legs
from uas_coverage_env.planning.routing.terrain import Terrain
from uas_coverage_env.scenario import Sensor, with_disturbances
from uas_coverage_env.vehicle.layout import DOD, VX, VY

RESERVE = Reserve(
    "a test", "none", kept_s=20.0, spare_s=7.0, landing_s=5.0, legs_share=0.9, time_share=0.8
)
KEPT_S = 27.0
BOTH = np.ones(2, np.bool_)


@pytest.fixture(scope="module")
def town():
    drawn = generate_scenario(seed=5, n_uas=2, n_waypoints=8, n_obstacles=6)
    return drawn.model_copy(update={"max_steps": 10_000})


def seen(scenario, works=BOTH, reserve=RESERVE, swarm=None, legs=Legs, **more):
    brief = MissionBrief.of(scenario)
    swarm = first_sight(brief) if swarm is None else swarm
    return RoutingProblem.seen(brief, swarm, legs(brief), works, reserve, **more)


def moment(scenario, **changes):
    """Any record with states, what is uncovered and the time is seen as a swarm is."""
    swarm = first_sight(MissionBrief.of(scenario))
    known = {"x": swarm.x.copy(), "uncovered": swarm.uncovered, "time_s": 0.0}
    return SimpleNamespace(**(known | changes))


def battery_s(scenario):
    brief = MissionBrief.of(scenario)
    uas, used = Legs(brief).arena.uas, first_sight(brief).x[:, DOD]
    return (uas["dod_max"] - used) / uas["dod_per_s"]


def test_of_a_share_of_the_battery_time_is_kept_for_home_and_for_delays(town):
    whole_s = battery_s(town)
    left_s = 0.8 * whole_s - KEPT_S
    assert seen(town).uas["budget_s"] == pytest.approx(left_s)
    slower = seen(town, pace=np.array([1.0, 2.0]), late_s=np.array([10.0, 0.0])).uas["budget_s"]
    assert slower == pytest.approx([left_s[0] - 10.0, left_s[1] / 2.0])
    half = moment(town)
    half.x[:, DOD] += 0.5 * (Legs(MissionBrief.of(town)).arena.uas["dod_max"] - half.x[:, DOD])
    assert seen(town, swarm=half).uas["budget_s"] == pytest.approx(0.4 * whole_s - KEPT_S)


def test_a_battery_that_outlasts_the_mission_is_for_what_is_left_of_the_mission(town):
    end_s = town.max_steps * town.dt_s
    late = moment(town, time_s=end_s - 60.0)
    assert seen(town, swarm=late).uas["budget_s"] == pytest.approx([0.8 * 60.0 - KEPT_S] * 2)


def test_batteries_last_as_long_as_those_of_the_worst_vehicle_that_is_stated(town):
    windy = with_disturbances(town, "moderate", seed=0)
    conditions = MissionBrief.of(windy).conditions
    assert conditions.charge_share < 1.0
    left_s = 0.8 * conditions.charge_share * battery_s(town) - KEPT_S
    assert seen(windy).uas["budget_s"] == pytest.approx(left_s)


def test_a_route_begins_where_its_uas_is_as_it_flies_and_ends_where_it_takes_off(town):
    under_way = moment(town)
    under_way.x[:, :3] += (30.0, -20.0, -5.0)
    under_way.x[:, VX : VY + 1] = (3.0, -4.0), (0.0, 2.0)
    uas = seen(town, swarm=under_way).uas
    np.testing.assert_array_equal(uas["position_m"], under_way.x[:, :2])
    np.testing.assert_array_equal(uas["velocity_mps"], [(3.0, -4.0), (0.0, 2.0)])
    np.testing.assert_array_equal(uas["home_m"], [one.start_m[:2] for one in town.uas])


def test_one_that_does_not_work_may_not_fly_and_takes_no_time(town):
    away = moment(town)
    away.x[:, :2] += 40.0
    problem = seen(town, np.array([True, False]), swarm=away)
    assert problem.may_fly.tolist() == [True, False]
    assert problem.uas["budget_s"][1] == -np.inf
    assert problem.uas["idle_s"][0] > 3.0
    assert problem.uas["idle_s"][1] == 0.0


def test_legs_are_their_share_and_landing_is_added_to_those_home(town):
    problem, legs = seen(town), Legs(MissionBrief.of(town))
    assert problem.between_s == pytest.approx(0.9 * legs.between_s)
    assert problem.home_s == pytest.approx(0.9 * legs.home_s + 5.0)
    x = first_sight(MissionBrief.of(town)).x
    assert problem.first_s[1] == pytest.approx(0.9 * legs.from_here_s(1, x[1, :3]))


def test_at_half_the_speed_legs_and_turns_take_twice_the_time(town):
    one, half = seen(town), seen(town, speed_share=0.5)
    assert half.between_s == pytest.approx(2.0 * one.between_s)
    assert half.first_s == pytest.approx(2.0 * one.first_s)
    assert half.home_s - 5.0 == pytest.approx(2.0 * (one.home_s - 5.0))
    assert half.turn_s == pytest.approx(2.0 * one.turn_s)
    assert half.uas["speed_mps"] == pytest.approx(0.5 * one.uas["speed_mps"])


def test_with_terrain_legs_are_the_shorter_of_the_ways_over_and_round(town):
    over, either = seen(town), seen(town, legs=Terrain)
    assert (either.between_s <= over.between_s).all()
    assert (either.home_s <= over.home_s).all()
    assert either.turn_s.tolist() == over.turn_s.tolist()


def test_open_is_what_is_uncovered_and_one_of_those_that_work_can_cover(town):
    camera = town.uas[0].model_copy(update={"sensors": (Sensor(name="camera"),)})
    asks = town.waypoints[3].model_copy(update={"sensor": "camera"})
    waypoints = (*town.waypoints[:3], asks, *town.waypoints[4:])
    sensed = town.model_copy(update={"uas": (camera, town.uas[1]), "waypoints": waypoints})
    uncovered = np.arange(8) != 6
    now = moment(sensed, uncovered=uncovered)
    assert seen(sensed, swarm=now).open_waypoints.tolist() == [0, 1, 2, 3, 4, 5, 7]
    without = seen(sensed, np.array([False, True]), swarm=now)
    assert without.open_waypoints.tolist() == [0, 1, 2, 4, 5, 7]
    none_works = seen(sensed, np.zeros(2, np.bool_), swarm=now)
    assert none_works.open_waypoints.tolist() == [0, 1, 2, 3, 4, 5, 7]
    asked = seen(sensed, swarm=now, open_waypoints=np.arange(8) == 6)
    assert asked.open_waypoints.tolist() == [6]
    assert uncovered.sum() == 7, "what is seen stays as it is"


def test_release_dates_and_forbidden_waypoints_are_none_unless_they_are_said(town):
    plain = seen(town)
    assert not plain.release_s.any()
    assert not plain.forbidden.any()
    forbidden, release_s = np.eye(2, 8, dtype=bool), np.arange(8.0)
    said = seen(town, forbidden=forbidden, release_s=release_s)
    assert said.forbidden.tolist() == forbidden.tolist()
    assert said.release_s.tolist() == release_s.tolist()
