"""Clearances grow by what disturbances may do, and by nothing where the air is still."""

import numpy as np
import pytest
from small_worlds import box, meadow, waypoint

from uas_coverage_env import World, rollout
from uas_coverage_env.autopilot.lookahead import fly_and_brake
from uas_coverage_env.features import constant_wind
from uas_coverage_env.mission import MissionBrief
from uas_coverage_env.scenario import with_disturbances
from uas_coverage_env.scenario.levels import DISTURBANCE_LEVELS
from uas_coverage_env.world import GoTo, Velocity, build_arena
from uas_coverage_env.world.obstacles import route_margin_m
from uas_coverage_env.world.tubes import UNKNOWN

TOWER = box("tower", (90.0, 90.0, -50.0), (110.0, 110.0, 0.0))
TOWN = meadow(((40.0, 100.0, -20.0),), obstacles=(TOWER,), waypoints=(waypoint((160, 100, -20)),))


def in_wind(level, seed=0):
    return with_disturbances(TOWN, level, seed)


def test_in_still_air_there_is_no_tube():
    assert not build_arena(TOWN).tube_m.any()


def test_where_nothing_is_stated_the_least_is_kept():
    arena = World(TOWN, disturbances=(constant_wind(3.0, 0.0),)).arena
    assert (arena.tube_m == UNKNOWN * route_margin_m(TOWN)).all()
    assert arena.obstacles["wall_m"] == build_arena(TOWN).obstacles["wall_m"]


@pytest.mark.parametrize("level", DISTURBANCE_LEVELS)
def test_the_tube_grows_along_the_horizon_and_planners_know_it_as_the_world_does(level):
    scenario = in_wind(level)
    arena = World(scenario).arena
    (tube_m,) = arena.tube_m
    assert (np.diff(tube_m) >= 0.0).all()
    unknown_m = UNKNOWN * route_margin_m(scenario)
    assert tube_m[0] == unknown_m < tube_m[3] < tube_m[-1]
    planners = build_arena(MissionBrief.of(scenario).as_scenario())
    np.testing.assert_array_equal(planners.tube_m, arena.tube_m)
    # routes pass the tower with the whole tube beside them
    more_m = arena.obstacles["wall_m"] - build_arena(TOWN).obstacles["wall_m"]
    assert more_m == pytest.approx(tube_m[-1] - unknown_m)
    assert unknown_m < route_margin_m(scenario)
    np.testing.assert_array_equal(planners.nodes_m, arena.nodes_m)


@pytest.mark.parametrize("level", DISTURBANCE_LEVELS)
def test_turbulence_and_gusts_seldom_lead_a_prediction_out_of_its_tube(level):
    scenario = in_wind(level, seed=3)
    mean_mps = DISTURBANCE_LEVELS[level].mean_mps[1]
    scenario = scenario.model_copy(
        update={
            "wind": scenario.wind.model_copy(update={"mean_mps": mean_mps}),
            "uncertainty": None,
        }
    )
    world, horizon = World(scenario, seed=1), 8
    predicted, flown = [], []
    for _ in range(250):
        path_m = np.zeros((int(world.arena.rules[0].lookahead_steps) + 1, 3))
        state, brake = world.state, world.arena.rules[0].brake
        fly_and_brake(
            world.arena,
            0,
            state.x[0],
            state.uas[0].reference_mps[:],
            brake,
            False,
            path_m,
            state.uas[0].belief[:],
        )
        predicted.append(path_m[: horizon + 1, :2])
        flown.append(world.state.x[0, :2].copy())
        # away from where it would land, then in place
        east_mps = 8.0 if len(flown) < 10 else 0.0
        world.step({"uas_1": Velocity(0.0, east_mps, 20.0)})
    off_m = np.array(
        [
            [np.linalg.norm(flown[t + k] - predicted[t][k]) for k in range(1, horizon + 1)]
            for t in range(20, len(flown) - horizon)
        ]
    )
    inside = off_m <= world.arena.tube_m[0, 1 : horizon + 1]
    assert inside.mean() > 0.98
    assert inside[:, 0].mean() > 0.98  # the step that is certain to be flown
    # and it is no wider than it has to be by far
    assert off_m.max() > 0.3 * world.arena.tube_m[0, horizon]


def test_a_mission_in_wind_ends_safe_with_the_waypoint_covered():
    flight = rollout(in_wind("light"), "nearest-waypoint")
    assert flight.violations == ()
    assert flight.breaches == 0
    assert flight.covered[-1] == 1


def test_guidance_in_wind_goes_round_the_tower_with_more_room():
    least_m = []
    for scenario in (TOWN, in_wind("moderate")):
        world, hull = World(scenario), TOWN.hulls[0]
        near_m = np.inf
        for _ in range(45):
            world.step({name: GoTo(0) for name in world.active})
            near_m = min(near_m, float(hull.signed_distance(world.state.x[0, :3])))
        least_m.append(near_m)
    assert least_m[1] > least_m[0] + 0.5
