"""Plans of still air flown in wind: the wind is found out, and commands fly the plan."""

import numpy as np
import pytest
from small_worlds import meadow, waypoint
from uas_coverage_baselines.milp_mpc.in_wind import InWind, axes
from uas_coverage_baselines.milp_mpc.model.problem import Plan

from uas_coverage_env import World
from uas_coverage_env.disturbances import constant_wind, wind_velocity_mps
from uas_coverage_env.mission import MissionBrief
from uas_coverage_env.vehicle import TAU_X, TAU_Y, X
from uas_coverage_env.world import Velocity

FIELD = meadow(((100.0, 100.0, -30.0),), waypoints=(waypoint((150.0, 100.0, -30.0)),))
MEAN_MPS, FROM_DEG = 3.5, 150.0


def world_in(mean_mps):
    """The field in a steady wind, of which nobody is told."""
    return World(FIELD, disturbances=(constant_wind(mean_mps, FROM_DEG),))


def flown(world, in_wind, velocity_mps, steps):
    """What is seen after some steps of one velocity."""
    seen, (north_mps, east_mps) = in_wind.see(world.swarm_state()), velocity_mps
    for _ in range(steps):
        world.step({"uas_1": Velocity(north_mps, east_mps, 30.0)})
        seen = in_wind.see(world.swarm_state())
    return seen


def accelerating(seen, alpha_radps2, off_m=0.0):
    """A plan of angular accelerations (north, east) from where the UAS is seen, or south of it."""
    x, u = np.array([[seen.x[0], seen.x[0]]]), np.zeros((1, 1, 5))
    x[0, :, X] -= off_m
    inertia_kgm2 = MissionBrief.of(FIELD).vehicles[0].airframe.inertia_kgm2
    u[0, 0, TAU_Y] = -alpha_radps2[0] * inertia_kgm2[1]
    u[0, 0, TAU_X] = alpha_radps2[1] * inertia_kgm2[0]
    return Plan(("uas_1",), x, u, np.zeros((1, 1, 0), bool), 0.0, -np.inf)


@pytest.mark.parametrize("velocity_mps", [(0.0, 0.0), (4.0, -3.0)])
def test_a_steady_wind_is_found_out_whatever_is_flown(velocity_mps):
    world, in_wind = world_in(MEAN_MPS), InWind(MissionBrief.of(FIELD))
    flown(world, in_wind, velocity_mps, 8)
    blows_mps = wind_velocity_mps(MEAN_MPS, FROM_DEG, 0.0)[:2]
    np.testing.assert_allclose(in_wind.wind_mps[0], blows_mps, atol=0.1)


def test_in_still_air_no_wind_is_found_and_states_stay_as_they_are():
    world, in_wind = world_in(0.0), InWind(MissionBrief.of(FIELD))
    seen = flown(world, in_wind, (5.0, 2.0), 6)
    np.testing.assert_allclose(in_wind.wind_mps, 0.0, atol=1e-9)
    np.testing.assert_allclose(seen.x, world.swarm_state().x, atol=1e-9)


def test_a_hover_in_wind_is_seen_as_a_level_one():
    world, in_wind = world_in(MEAN_MPS), InWind(MissionBrief.of(FIELD))
    seen = flown(world, in_wind, (0.0, 0.0), 25)
    leans = axes(world.swarm_state().x[0])[:, 2]
    assert np.abs(leans).min() > 0.03
    np.testing.assert_allclose(axes(seen.x[0])[:, 2], 0.0, atol=5e-3)


@pytest.mark.parametrize("mean_mps", [0.0, MEAN_MPS])
def test_the_commanded_velocity_flies_the_plans_accelerations_in_wind_as_in_still_air(mean_mps):
    world, in_wind = world_in(mean_mps), InWind(MissionBrief.of(FIELD))
    seen = flown(world, in_wind, (1.0, 1.0), 20)
    alpha = np.array([0.04, -0.03])
    plan = accelerating(seen, alpha)
    (command,) = in_wind.velocities(plan, seen, lambda name: "covering").values()
    rate_before = axes(world.swarm_state().x[0])[:, 3]
    world.step({"uas_1": command})
    gained = axes(world.swarm_state().x[0])[:, 3] - rate_before
    np.testing.assert_allclose(gained, alpha * FIELD.dt_s, atol=4e-3)


def test_what_an_old_plan_is_off_by_is_fed_back():
    world, in_wind = world_in(0.0), InWind(MissionBrief.of(FIELD))
    seen = flown(world, in_wind, (0.0, 0.0), 3)
    here, off = (
        in_wind.velocities(accelerating(seen, (0.0, 0.0), off_m), seen, lambda name: "covering")[
            "uas_1"
        ]
        for off_m in (0.0, 2.0)
    )
    assert (here.north_mps, here.east_mps) == pytest.approx((0.0, 0.0), abs=1e-6)
    assert off.north_mps < -0.5
    assert off.east_mps == pytest.approx(0.0, abs=1e-6)
