"""What learners add to a scenario, and what every mission in it begins with."""

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.env.episode.memory import (
    CONTACT_WITH,
    COVERED,
    FIRST_OBSERVATION,
    FIRST_TERM,
    LEARNERS,
    STATUS,
    Learners,
    Observing,
    Tables,
)
from uas_coverage_env.env.episode.observe import observe
from uas_coverage_env.env.episode.settings import MissionSettings
from uas_coverage_env.env.observation.nearest import NO_TARGET, neighbours_of, write_around
from uas_coverage_env.env.observation.scales import scales_of
from uas_coverage_env.scenario import Scenario
from uas_coverage_env.world import FLYING, Arena, WorldState
from uas_coverage_env.world.arena import ARENA


def tables_of(scenario: Scenario, ranges: NDArray[np.float64]) -> Tables:
    """What does not change as long as the scene does not.

    Args:
        scenario: As it is now.
        ranges: Of the actions.
    """
    return Tables(ranges, scales_of(scenario), neighbours_of(scenario))


def learners_sizes(settings: MissionSettings, action_size: int) -> dict[str, int]:
    """Sizes of the learners' arrays that do not depend on the scenario."""
    return {
        "A": action_size,
        "R": len(settings.reward),
        "P": FIRST_TERM + len(settings.reward),
        "V": settings.observation_size,
    }


def first_observation(
    arena: Arena,
    state: WorldState,
    tables: Tables,
    observing: Observing,
    sizes: dict[str, int],
) -> tuple[Learners, NDArray[np.float32]]:
    """What missions of a scenario begin with, always the same.

    Args:
        arena: The arena.
        state: The world at t = 0.
        tables: Of the scenario.
        observing: What is observed.
        sizes: See `learners_sizes`.

    Returns:
        The learners' arrays, and the observations, (U, V).
    """
    learners = first_learners(arena, state, sizes)
    first = FIRST_OBSERVATION.zeros(ARENA.sizes_of(arena, sizes))
    observe_scene(arena, state, tables, learners, observing, first.observation)
    return learners, first.observation


def first_learners(arena: Arena, state: WorldState, sizes: dict[str, int]) -> Learners:
    """The learners' arrays at t = 0, before anything is observed; arguments as above."""
    learners = LEARNERS.zeros(ARENA.sizes_of(arena, sizes))
    learners.targets[:] = NO_TARGET
    learners.candidates[:] = -1
    learners.report[:, CONTACT_WITH] = -1
    learners.report[:, STATUS] = state.uas["status"]
    learners.report[:, COVERED] = (~state.uncovered).sum()
    return learners


def observe_scene(
    arena: Arena,
    state: WorldState,
    tables: Tables,
    learners: Learners,
    observing: Observing,
    observation: NDArray[np.float32],
) -> None:
    """Observe a scene that is new to those that fly.

    Args:
        arena: The arena.
        state: The world now.
        tables: Of the scene.
        learners: The learners' arrays; what depends on the scene is written.
        observing: What is observed.
        observation: (U, V); the rows of UAS that fly are written.
    """
    write_around(state.uncovered, tables.neighbours, learners.around)
    flying = state.uas["status"] == FLYING
    observe(arena, state.as_observed(), tables, learners, observing, flying, observation)
