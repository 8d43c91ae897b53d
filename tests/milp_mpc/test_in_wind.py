"""Plans of still air flown in wind: the wind is found out, and commands fly the plan."""

from dataclasses import replace

import numpy as np
import pytest
from small_worlds import meadow, waypoint
from uas_coverage_baselines.milp_mpc.fallback.plans import fallback_plans
from uas_coverage_baselines.milp_mpc.in_wind import InWind, axes
from uas_coverage_baselines.milp_mpc.model.problem import Plan
from uas_coverage_baselines.milp_mpc.model.verify import first_trouble
from uas_coverage_baselines.milp_mpc.planner import MilpMpc, MilpMpcOptions

from uas_coverage_env import World, generate_scenario, rollout
from uas_coverage_env.features import constant_wind
from uas_coverage_env.features.steady_wind import wind_velocity_mps
from uas_coverage_env.mission import MissionBrief, first_sight
from uas_coverage_env.vehicle.layout import TAU_X, TAU_Y, VX, VY, X, Y, Z
from uas_coverage_env.world import Velocity

FIELD = meadow(((100.0, 100.0, -30.0),), waypoints=(waypoint((150.0, 100.0, -30.0)),))
MEAN_MPS, FROM_DEG = 3.5, 150.0


def world_in(mean_mps):
    """The field in a steady wind, of which no planner is told."""
    return World(FIELD, disturbances=(constant_wind(mean_mps, FROM_DEG),))


def flown(world, in_wind, velocity_mps, steps):
    """What is seen after some steps of one velocity."""
    seen, (north_mps, east_mps) = in_wind.see(world.swarm_state()), velocity_mps
    for _ in range(steps):
        world.step({"uas_1": Velocity(north_mps, east_mps, 30.0)})
        seen = in_wind.see(world.swarm_state())
    return seen


def accelerating(seen, alpha_radps2):
    """A plan of angular accelerations (north, east) from where the UAS is seen."""
    x, u = np.array([[seen.x[0], seen.x[0]]]), np.zeros((1, 1, 5))
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


def test_a_plan_goes_on_from_where_the_uas_is_and_leads_back_to_itself():
    brief = MissionBrief.of(FIELD)
    planner = MilpMpc(MilpMpcOptions(horizon=12))
    planner.reset(brief, 0)
    problem = planner.problem(first_sight(brief))
    plan = fallback_plans(problem, 0, None, brief.dt_s)[0]
    off = np.zeros(14)
    off[[X, Y, Z, VX, VY]] = 0.8, -0.5, 0.3, 0.3, 0.2
    here = replace(problem, x0=problem.x0 + off)
    led = InWind(brief).from_here(plan, here)
    np.testing.assert_array_equal(led.x[0, 0], here.x0[0])
    model = problem.models[0]
    for k in range(plan.u.shape[1]):  # a flight of the same model
        step = model.A @ (led.x[0, k] - plan.x[0, k]) + model.B @ (led.u[0, k] - plan.u[0, k])
        np.testing.assert_allclose(led.x[0, k + 1] - plan.x[0, k + 1], step, atol=1e-9)
    assert np.abs((led.x - plan.x)[0, -1, :6]).max() < 0.1
    assert np.abs((led.x - plan.x)[0, :, :3]).max() < 1.3
    assert first_trouble(here, plan) is not None
    assert first_trouble(here, led) is None


def test_of_a_fleet_that_plans_in_turn_none_brakes_between_its_turns():
    town = generate_scenario(5, n_uas=2, n_waypoints=6, n_obstacles=2, disturbances="light")
    options = MilpMpcOptions(horizon=10, in_wind="tube", at_once=1, threads=1)
    flight = rollout(town, MilpMpc(options), 0, max_steps=8)
    first_mps = np.hypot(flight.x[2:, 0, VX], flight.x[2:, 0, VY])
    assert first_mps[-1] > 10.0
    assert (np.diff(first_mps) > 0.0).all()
