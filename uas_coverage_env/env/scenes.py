"""Scenes that change in a batch: those lanes are laid out anew, as a single mission is."""

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.env.batch_memory import Missions
from uas_coverage_env.env.drawn import DrawnPool
from uas_coverage_env.env.memory import LEARNERS, TABLES, Learners, Observing
from uas_coverage_env.env.pool import ScenarioPool
from uas_coverage_env.env.start import look_around
from uas_coverage_env.scenario import Scenario
from uas_coverage_env.scenario.events import OfUas
from uas_coverage_env.simulation.scenes import carried_over, changes_due, scene_after
from uas_coverage_env.world.arena import ARENA
from uas_coverage_env.world.state import STATE, WorldState


class SceneLane(NamedTuple):
    """What a lane flies, in arrays with room for the largest mission."""

    scene: NDArray[np.int64]
    """(1,) index in the pool."""
    changes: NDArray[np.int64]
    """See `SubEnvironments.changes`."""
    world: WorldState
    learners: Learners
    observation: NDArray[np.float32]
    """(U, V)."""


def change_scenes(
    pool: ScenarioPool | DrawnPool,
    missions: Missions,
    flew: NDArray[np.bool_],
    observing: Observing,
    observation: NDArray[np.float32],
) -> None:
    """Let happen at this sample what changes scenes, as `World.change_scene` does.

    Args:
        pool: The scenes of lanes are put into it.
        missions: Written where a scene changes.
        flew: (L,) which lanes have flown the step to this sample.
        observing: What is observed.
        observation: (L, U, V); written where a scene changes.
    """
    worlds, learners, lanes = missions.worlds, missions.learners, missions.lanes
    happens = (worlds.event_step == worlds.step).any(axis=1)
    again = (worlds.due_step == worlds.step).any(axis=1)
    for k in np.flatnonzero(flew & (happens | again)).tolist():
        lane = SceneLane(
            lanes.scene[k : k + 1],
            lanes.changes[k],
            worlds._make(array[k] for array in worlds),
            learners._make(array[k] for array in learners),
            observation[k],
        )
        change_scene(pool, k, lane, observing)


def change_scene(
    pool: ScenarioPool | DrawnPool, k: int, lane: SceneLane, observing: Observing
) -> bool:
    """The same for one lane, in which an event happens or a waypoint is asked for again.

    Args:
        pool: See above.
        k: Which lane.
        lane: What it flies; written where its scene changes.
        observing: What is observed.

    Returns:
        Whether it changes.
    """
    scene = int(lane.scene[0])
    known = pool.scene_of(scene)
    sizes = ARENA.sizes_of(ARENA.mission(pool.arrays.arenas, scene))
    state = STATE.first_rows(lane.world, sizes)
    changes = changes_due(known, state)
    if not changes:
        return False
    n_before = int((lane.changes >= 0).sum())
    lane.changes[n_before : n_before + len(changes)] = changes
    for change in changes:
        known = scene_after(known, change, state)
    scene = lane.scene[0] = pool.put_scene(k, scene, known)
    arena = ARENA.mission(pool.arrays.arenas, scene)
    sizes = ARENA.sizes_of(arena)
    carried = carried_over(known, arena, state)
    state = STATE.first_rows(lane.world, sizes)
    for array, each in zip(state, carried, strict=True):
        array[:] = each
    tables = TABLES.mission(pool.arrays.tables, scene)
    learners = LEARNERS.first_rows(lane.learners, sizes)
    look_around(arena, state, tables, learners, observing, lane.observation[: sizes["U"]])
    return True


def scenes_in(
    state: Mapping[str, NDArray[Any]], missions: Mapping[int, Scenario]
) -> dict[int, Scenario]:
    """The scenes of a batch that was put aside, where they have changed.

    Args:
        state: The arrays of the batch by name.
        missions: Lane -> the scenario that it flies, as it was at t = 0.

    Returns:
        Lane -> the scenario as it was when the batch was put aside.

    Raises:
        ValueError: No mission can have changed like this.
    """
    changed = {}
    for lane, known in missions.items():
        changes = state["changes"][lane].tolist()
        n = sum(change >= 0 for change in changes)
        if n:
            world = WorldState(*(state[name][lane] for name in WorldState._fields))
            changed[lane] = _scene_after_all(known, changes[:n], world, f"changes[{lane}]")
    return changed


def _scene_after_all(
    known: Scenario, changes: Sequence[int], state: WorldState, where: str
) -> Scenario:
    n_events = len(known.events)
    for k, change in enumerate(changes):
        possible = change not in changes[:k]
        if 0 <= change < n_events:
            event = known.events[change]
            possible &= event.changes_scene and 1 <= state.event_step[change] <= state.step[0]
            of_uas = isinstance(event, OfUas)
            possible &= not of_uas or 0 <= state.event_uas[change] < len(known.uas)
        else:
            w = change - n_events
            possible &= 0 <= w < len(known.waypoints) and bool(known.waypoints[w].again_after_s)
        if not possible:
            raise ValueError(f"{where} is {list(changes)}, which no mission here can have")
        known = scene_after(known, change, state)
    return known


def install_scenes(
    pool: ScenarioPool | DrawnPool,
    scenario: NDArray[np.int64],
    scene: NDArray[np.int64],
    changed: Mapping[int, Scenario],
) -> None:
    """Put the scenes of `scenes_in` into a pool.

    Args:
        pool: Of the batch.
        scenario: (L,) index in the pool of the mission.
        scene: (L,) index of what is flown now; written.
        changed: Lane -> the scenario that it flies now.
    """
    scene[:] = scenario
    for lane, known in changed.items():
        scene[lane] = pool.put_scene(lane, int(scenario[lane]), known)
