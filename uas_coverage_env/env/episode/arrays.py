"""The arrays that learners add to a mission, made ready; and what every mission begins with."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.entities.state import FLYING
from uas_coverage_env.env.actions.given import Actions
from uas_coverage_env.env.episode.memory import (
    FIRST_OBSERVATION,
    LEARNERS,
    SCRATCH,
    Learners,
    Observing,
    Scratch,
    Tables,
)
from uas_coverage_env.env.episode.observe import observe_with
from uas_coverage_env.env.episode.settings import MissionSettings
from uas_coverage_env.env.observation.nearest import neighbours_of, write_around
from uas_coverage_env.env.observation.scales import scales_of
from uas_coverage_env.env.observation.waypoints import fixed_of
from uas_coverage_env.env.report import CONTACT_WITH, COVERED, FIRST_TERM, STATUS
from uas_coverage_env.env.versions import Version
from uas_coverage_env.scenario import Scenario
from uas_coverage_env.world import Arena, WorldState
from uas_coverage_env.world.arena import ARENA


def tables_of(arena: Arena, scenario: Scenario, ranges: NDArray[np.float64]) -> Tables:
    """What does not change as long as the scene does not.

    Args:
        arena: The arena.
        scenario: As it is now.
        ranges: Of the actions.
    """
    scales = scales_of(scenario)
    return Tables(ranges, scales, neighbours_of(scenario), fixed_of(arena, scales))


def learners_sizes(settings: MissionSettings, action_size: int) -> dict[str, int]:
    """Sizes of the learners' arrays that do not depend on the scenario."""
    return {
        "A": action_size,
        "R": len(settings.reward),
        "P": FIRST_TERM + len(settings.reward),
        "V": settings.observation_size,
    }


class EpisodeArrays(NamedTuple):
    """What learners add to the arrays of a mission."""

    sizes: dict[str, int]
    """Of every name."""
    tables: Tables
    learners: Learners
    scratch: Scratch


def arrays_of(
    arena: Arena, scenario: Scenario, settings: MissionSettings, actions: Actions
) -> EpisodeArrays:
    """New arrays for a scene.

    Args:
        arena: The arena.
        scenario: As it is now.
        settings: How it is flown and paid.
        actions: The kind of action, scaled to the fleet.
    """
    sizes = ARENA.sizes_of(arena, learners_sizes(settings, actions.size))
    return EpisodeArrays(
        sizes, tables_of(arena, scenario, actions.ranges), LEARNERS.zeros(sizes),
        SCRATCH.zeros(sizes),
    )  # fmt: skip


def first_observation(
    arena: Arena,
    state: WorldState,
    tables: Tables,
    observing: Observing,
    sizes: dict[str, int],
    version: Version,
) -> tuple[Learners, NDArray[np.float32]]:
    """What missions of a scenario begin with, always the same.

    Args:
        arena: The arena.
        state: The world at t = 0.
        tables: Of the scenario.
        observing: What is observed.
        sizes: See `learners_sizes`.
        version: Of the environment.

    Returns:
        The learners' arrays, and the observations, (U, V).
    """
    sizes = ARENA.sizes_of(arena, sizes)
    learners, first = LEARNERS.zeros(sizes), FIRST_OBSERVATION.zeros(sizes)
    report_start(state, learners)
    observe_scene(arena, state, tables, learners, observing, first.observation, version)
    return learners, first.observation


def report_start(state: WorldState, learners: Learners) -> None:
    """Report the start of a mission: nothing has happened yet."""
    learners.report[:, CONTACT_WITH] = -1
    learners.report[:, STATUS] = state.uas["status"]
    learners.report[:, COVERED] = (~state.uncovered).sum()


def observe_scene(
    arena: Arena,
    state: WorldState,
    tables: Tables,
    learners: Learners,
    observing: Observing,
    observation: NDArray[np.float32],
    version: Version,
) -> None:
    """Observe a scene that is new to those that fly.

    Args:
        arena: The arena.
        state: The world now.
        tables: Of the scene.
        learners: The learners' arrays; what depends on the scene is written.
        observing: What is observed.
        observation: (U, V); the rows of UAS that fly are written.
        version: Of the environment.
    """
    write_around(state.uncovered, tables.neighbours, learners.around)
    flying = state.uas["status"] == FLYING
    observe = observe_with(version.observation)
    observe(arena, state.as_observed(), tables, learners, observing, flying, observation)
