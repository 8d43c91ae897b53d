"""What learners add to a scenario, and what every mission in it begins with."""

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.env.actions import Actions
from uas_coverage_env.env.memory import (
    CONTACT_WITH,
    COVERED,
    LEARNERS,
    LOOK,
    STATUS,
    Learners,
    Tables,
)
from uas_coverage_env.env.nearest import NO_TARGET, count_company, neighbours_of
from uas_coverage_env.env.observation import observe, scales_of
from uas_coverage_env.scenario import Scenario
from uas_coverage_env.world import FLYING, Arena, WorldState
from uas_coverage_env.world.arena import ARENA


def tables_of(scenario: Scenario, actions: Actions) -> Tables:
    """What does not change during the missions of a scenario."""
    return Tables(actions.ranges, scales_of(scenario), neighbours_of(scenario))


def first_look(
    arena: Arena, state: WorldState, tables: Tables, action_size: int
) -> tuple[Learners, NDArray[np.float32]]:
    """What missions of a scenario begin with, always the same.

    Args:
        arena: The arena.
        state: The world at t = 0.
        tables: Of the scenario.
        action_size: Numbers of an action.

    Returns:
        The learners' arrays, and the observations, (U, OBSERVATION_SIZE).
    """
    sizes = ARENA.sizes_of(arena, {"A": action_size})
    learners = LEARNERS.zeros(sizes)
    learners.targets[:] = NO_TARGET
    learners.candidates[:] = -1
    learners.report[:, CONTACT_WITH] = -1
    learners.report[:, STATUS] = state.status
    learners.report[:, COVERED] = (~state.uncovered).sum()
    look = LOOK.zeros(sizes)
    count_company(state.uncovered, tables.neighbours, learners.company)
    observe(
        arena,
        state,
        tables.scales,
        learners.company,
        state.status == FLYING,
        learners.targets,
        int(arena.rules["max_steps"][0]),
        learners.candidates,
        look.observation,
    )
    return learners, look.observation
