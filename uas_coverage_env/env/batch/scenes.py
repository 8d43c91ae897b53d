"""Scenes that change in a batch: those lanes are laid out anew, as a single mission is."""

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.entities.state import STATE, WorldState
from uas_coverage_env.env.batch.memory import Missions
from uas_coverage_env.env.batch.pool import scene_arrays
from uas_coverage_env.env.batch.source import LaneMissions
from uas_coverage_env.env.episode.arrays import observe_scene
from uas_coverage_env.env.episode.memory import LEARNERS, TABLES, Learners, Observing, Tables
from uas_coverage_env.features.event import OfUas
from uas_coverage_env.scenario import Scenario
from uas_coverage_env.simulation.scenes import carried_over, changes_due, scene_after
from uas_coverage_env.world.arena import ARENA, Arena


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
    pool: LaneMissions,
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
    happens = (worlds.events["step"] == worlds.step).any(axis=1)
    again = (worlds.due_step == worlds.step).any(axis=1)
    scenes = SceneChanges(pool, observing)
    for k in np.flatnonzero(flew & (happens | again)).tolist():
        lane = SceneLane(
            lanes.scene[k : k + 1],
            lanes.changes[k],
            worlds._make(array[k] for array in worlds),
            learners._make(array[k] for array in learners),
            observation[k],
        )
        scenes.change(k, lane)


class SceneChanges:
    """What changes the scenes of lanes at one sample; scenes that are equal are laid out once.

    Args:
        pool: The scenes of lanes are put into it.
        observing: What is observed.
    """

    def __init__(self, pool: LaneMissions, observing: Observing) -> None:
        self._pool, self._observing = pool, observing
        self._made: dict[tuple[Any, ...], tuple[Scenario, Arena, Tables]] = {}

    def change(self, k: int, lane: SceneLane) -> bool:
        """Change the scene of a lane in which something has happened; says whether it changes.

        Args:
            k: Which lane.
            lane: What it flies; written where its scene changes.
        """
        pool, scene = self._pool, int(lane.scene[0])
        known = pool.scene_of(scene)
        sizes = ARENA.sizes_of(ARENA.mission(pool.arrays.arenas, scene))
        state = STATE.first_rows(lane.world, sizes)
        changes = changes_due(known, state)
        if not changes:
            return False
        n_before = int((lane.changes >= 0).sum())
        lane.changes[n_before : n_before + len(changes)] = changes
        known, arena, tables = self._after(scene, changes, state)
        lane.scene[0] = pool.put_scene(k, known, arena, tables)
        sizes = ARENA.sizes_of(arena)
        carried = carried_over(known, arena, state)
        state = STATE.first_rows(lane.world, sizes)
        for array, each in zip(state, carried, strict=True):
            array[:] = each
        learners = LEARNERS.first_rows(lane.learners, sizes)
        observation = lane.observation[: sizes["U"]]
        observe_scene(
            arena, state, tables, learners, self._observing, observation, pool.settings.version
        )
        return True

    def _after(
        self, scene: int, changes: Sequence[int], state: WorldState
    ) -> tuple[Scenario, Arena, Tables]:
        """The scene after changes, and its arrays."""
        known = self._pool.scene_of(scene)
        events = [change for change in changes if change < len(known.events)]
        of_uas = [e for e in events if isinstance(known.events[e], OfUas)]
        # lanes whose scenes have been equal so far share one scenario
        key = (
            id(known),
            int(state.step[0]),
            tuple(changes),
            tuple(state.events["uas"][of_uas].tolist()),
        )
        if key not in self._made:
            for change in changes:
                known = scene_after(known, change, state)
            self._made[key] = known, *_laid_out(self._pool, scene, known)
        return self._made[key]


def _laid_out(pool: LaneMissions, scene: int, known: Scenario) -> tuple[Arena, Tables]:
    """The arrays of what the scene of a mission has become, which was this one of the pool."""
    before = TABLES.mission(pool.arrays.tables, scene)
    return scene_arrays(known, pool.settings, pool.features, before)


def scenes_in(
    state: Mapping[str, NDArray[Any]], missions: Mapping[int, Scenario]
) -> dict[int, Scenario]:
    """The scenes of a checkpoint of a batch, where they have changed.

    Args:
        state: The arrays of the batch by name.
        missions: Lane -> the scenario that it flies, as it was at t = 0.

    Returns:
        Lane -> the scenario as it was at the checkpoint.

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
            possible &= event.changes_scene and 1 <= state.events[change].step <= state.step[0]
            of_uas = isinstance(event, OfUas)
            possible &= not of_uas or 0 <= state.events[change].uas < len(known.uas)
        else:
            w = change - n_events
            possible &= 0 <= w < len(known.waypoints) and bool(known.waypoints[w].again_after_s)
        if not possible:
            raise ValueError(f"{where} is {list(changes)}, which no mission here can have")
        known = scene_after(known, change, state)
    return known


def install_scenes(
    pool: LaneMissions,
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
        arrays = _laid_out(pool, int(scenario[lane]), known)
        scene[lane] = pool.put_scene(lane, known, *arrays)
