"""What a step leaves of the record of the step before: nothing."""

import numpy as np
import pytest

from uas_coverage_env import generate_scenario
from uas_coverage_env.autopilot.assist import assistants
from uas_coverage_env.entities.commands import COMMAND_DTYPE, VELOCITY
from uas_coverage_env.entities.outcome import OUTCOME_DTYPE
from uas_coverage_env.simulation.step import advance
from uas_coverage_env.simulation.world import initial_state
from uas_coverage_env.world import build_arena

# written, and read, only where disturbances act: `flight.clear` resets them
OF_DISTURBANCES = {"wind_mps", "force_N", "dod_lost"}

SCENARIO = generate_scenario(3, n_uas=3, n_waypoints=20, n_obstacles=10)


def flown(outcome):
    arena, state = build_arena(SCENARIO), initial_state(SCENARIO)
    commands = np.zeros(3, COMMAND_DTYPE)
    commands["kind"], commands["values"][:, 1] = VELOCITY, 2.0
    advance(arena, state, commands, False, assistants(False, True), None, outcome)
    return outcome


@pytest.mark.parametrize("name", sorted(set(OUTCOME_DTYPE.names) - OF_DISTURBANCES))
def test_each_field_is_written_anew_in_every_step(name):
    """One that is added and counted up would go on counting where the record is used again."""
    used = np.full(3 * OUTCOME_DTYPE.itemsize, 1, np.uint8).view(OUTCOME_DTYPE)
    fresh = np.zeros(3, OUTCOME_DTYPE)
    np.testing.assert_array_equal(flown(used)[name], flown(fresh)[name])
