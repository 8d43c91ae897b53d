import numpy as np
import pytest

from uas_coverage_env import GoTo, World, load_scenario
from uas_coverage_env.autopilot.guidance import steer, velocity_of
from uas_coverage_env.entities.commands import CLIMB, GO_TO
from uas_coverage_env.entities.outcome import OUTCOME_DTYPE
from uas_coverage_env.vehicle.layout import VX, VZ


@pytest.mark.parametrize("dynamics", ["lpv", "nonlinear"])
def test_the_velocity_of_a_goto_flies_as_the_goto_does(dynamics):
    scenario = load_scenario("village")
    world, twin = (World(scenario, dynamics=dynamics) for _ in range(2))
    rng = np.random.default_rng(0)
    brakes = 0
    for _ in range(150):
        low, high = scenario.fence.vertices_m.min(axis=0), scenario.fence.vertices_m.max(axis=0)
        world.reset()
        state = world.state
        state.x[:, :3] = rng.uniform(low, high, (2, 3))
        state.x[:, VX : VZ + 1] = rng.uniform(-2.5, 2.5, (2, 3))
        state.x[:, VX] *= 3.0
        state.uas["reference_mps"][:] = state.x[:, VX : VX + 2]
        for mine, other in zip(twin.state, state, strict=True):
            mine[:] = other
        target = int(rng.integers(len(scenario.waypoints)))
        commands = {"uas_1": GoTo(target), "uas_2": GoTo(None)}
        nonlinear = dynamics == "nonlinear"
        same = {
            name: velocity_of(world.arena, state, i, command, nonlinear=nonlinear)
            for i, (name, command) in enumerate(commands.items())
        }
        brakes += braking(world, target, nonlinear)
        world.step(commands)
        twin.step(same)
        np.testing.assert_allclose(twin.state.x, world.state.x, rtol=1e-9, atol=1e-9)
        np.testing.assert_array_equal(twin.state.uas["status"], world.state.uas["status"])
    assert brakes > 3


def braking(world, target, nonlinear) -> int:
    """How many guidance lets brake, towards this waypoint and home."""
    outcome = np.zeros(2, OUTCOME_DTYPE)
    outcome["applied_command"]["kind"] = GO_TO
    outcome["applied_command"]["values"][:, 0] = (target, -1)
    steer(world.arena, world.state, nonlinear, outcome)
    return int((outcome["applied_command"]["kind"] == CLIMB).sum())
