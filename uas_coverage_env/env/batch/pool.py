"""Scenarios to draw missions from, in arrays: the arenas, and what learners add to them."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.compiled.views import lane_view, pool_view
from uas_coverage_env.entities.state import STATE
from uas_coverage_env.env.actions.given import actions_of
from uas_coverage_env.env.batch.memory import DRAW, REST, MissionPool, SubEnvironments
from uas_coverage_env.env.batch.slots import Slots
from uas_coverage_env.env.batch.source import DrawnMission
from uas_coverage_env.env.episode.arrays import first_observation, learners_sizes, tables_of
from uas_coverage_env.env.episode.memory import (
    FIRST_OBSERVATION,
    LEARNERS,
    TABLES,
    FirstObservation,
    Tables,
)
from uas_coverage_env.env.episode.observe import observing_of
from uas_coverage_env.env.episode.settings import MissionSettings
from uas_coverage_env.features.feature import MissionFeature, fitted_to, in_slots
from uas_coverage_env.scenario import Scenario
from uas_coverage_env.scenario.room import Room
from uas_coverage_env.scenario.source import loaded_scenario
from uas_coverage_env.simulation.pool import pool_worlds
from uas_coverage_env.simulation.scenes import changes_scene
from uas_coverage_env.world.arena import ARENA, Arena, build_arena
from uas_coverage_env.world.events import goes_home

MEASURED_M = 0.0
"""Only what counts: nothing more is told."""


def scene_arrays(
    known: Scenario,
    settings: MissionSettings,
    features: Sequence[MissionFeature],
    before: Tables,
) -> tuple[Arena, Tables]:
    """The arrays of a mission whose scene has changed.

    Args:
        known: The scenario from now on.
        settings: How missions are flown and paid.
        features: One of each kind in the pool.
        before: The tables of the scene before.
    """
    slots = fitted_to(features, settings.features_in(known))
    arena = build_arena(known, measured_m=MEASURED_M, features=slots, judges_wrenches=True)
    return arena, tables_of(arena, known, before.ranges)


tables_at = pool_view(TABLES)
"""In a kernel, (`MissionPool.tables`, s) -> the tables of scenario s."""

first_learners_at = pool_view(LEARNERS)
"""In a kernel, (`MissionPool.learners`, s) -> the learners' arrays at the start of scenario s."""

first_observation_at = pool_view(FIRST_OBSERVATION)
"""In a kernel, (`MissionPool.first_observations`, s) -> what is seen at the start of scenario s."""

learners_of = lane_view(LEARNERS, sized_by=ARENA)
"""In a kernel, (learners, lane, `MissionPool.arenas`, s) -> those of a lane in scenario s."""


class ScenarioPool:
    """One or many scenarios with any numbers of UAS, waypoints and obstacles.

    Args:
        scenario: Name of a shipped scenario, path of a scenario file, or a scenario; or a
            sequence of these.
        settings: How missions are flown and paid; None: as usual.
        features: One of each kind that there is to be room for; None: those that there are.
        lanes: How many fly them: each may get a scene of its own, behind the missions.

    Attributes:
        settings: As given.
        scenarios: (S,) as flown, with the time limit of the settings.
        actions: The kind of action, of the first scenario; kind and size are those of all.
        arrays: For kernels.
        sizes: The largest of every named size.
        n_uas: (S,).
        n_waypoints: (S,).
        features: One of each kind that any of the scenarios has.
        goes_home: Whether an event of any of them may send a UAS home.
        changes: Whether the scene of any of them may change.
        draws: False: kernels draw among these.

    Raises:
        ValueError: There is no scenario, or one is none of what is allowed.
    """

    def __init__(
        self,
        scenario: str | Path | Scenario | Sequence[str | Path | Scenario],
        settings: MissionSettings | None = None,
        features: Sequence[MissionFeature] | None = None,
        *,
        lanes: int = 0,
    ) -> None:
        if callable(scenario):
            raise ValueError(
                f"scenario is {scenario!r}; give scenarios here, nothing that draws them"
            )
        given = [scenario] if isinstance(scenario, str | Path | Scenario) else scenario
        settings = settings or MissionSettings()
        self.settings = settings
        self.scenarios = tuple(settings.limited(loaded_scenario(entry)) for entry in given)
        self.goes_home = any(goes_home(scenario) for scenario in self.scenarios)
        self.changes = any(changes_scene(scenario) for scenario in self.scenarios)
        owned = [settings.features_in(scenario) for scenario in self.scenarios]
        if features is None:
            self.features, slots = in_slots(owned)
        else:
            self.features = tuple(features)
            slots = [fitted_to(features, own) for own in owned]
        worlds = pool_worlds(
            self.scenarios, measured_m=MEASURED_M, slots=slots, judges_wrenches=True
        )
        actions = [actions_of(settings.kind, scenario) for scenario in self.scenarios]
        self.actions = actions[0]
        if any(each.kind != self.actions.kind for each in actions):
            raise ValueError(
                "some scenarios are planar and some are not, and actions have fewer numbers in the "
                "plane; fly them in two batches"
            )
        tables = [
            tables_of(ARENA.mission(worlds.arenas, s), scenario, each.ranges)
            for s, (scenario, each) in enumerate(zip(self.scenarios, actions, strict=True))
        ]
        own_sizes = learners_sizes(settings, self.actions.size)
        observing = observing_of(settings.observation, settings.version.observation)
        first = [
            first_observation(
                ARENA.mission(worlds.arenas, s),
                STATE.mission(worlds.starts, s),
                tables[s],
                observing,
                own_sizes,
                settings.version,
            )
            for s in range(len(self.scenarios))
        ]
        self.arrays = MissionPool(
            *worlds,
            TABLES.pool(tables),
            LEARNERS.pool([learners for learners, _ in first]),
            FIRST_OBSERVATION.pool([FirstObservation(observation) for _, observation in first]),
        )
        largest = {**STATE.largest(worlds.starts), **ARENA.largest(worlds.arenas)}
        if self.changes:
            # once all has happened
            largest["W"] = max(Room.of(scenario).n_waypoints for scenario in self.scenarios)
            largest["repeats"] = largest["W"] if largest["repeats"] else 0
        changes = largest["E"] + largest["repeats"] if self.changes else 0
        self.sizes = {**largest, **own_sizes, "changes": changes}
        self._known = [*self.scenarios, *self.scenarios[:1] * lanes]
        if self.changes and lanes:
            n = len(self._known)
            self._arenas, self._tables = Slots(ARENA, n), Slots(TABLES, n)
            for s in range(len(self)):
                self._put(s, ARENA.mission(worlds.arenas, s), tables[s])
        self.n_uas = ARENA.size(worlds.arenas, "U")
        self.n_waypoints = ARENA.size(worlds.arenas, "W")
        self.draws = False

    def __len__(self) -> int:
        return len(self.scenarios)

    def scene_of(self, scene: int) -> Scenario:
        """The scenario that is flown now where `lanes.scene` is this."""
        return self._known[scene]

    def put_scene(self, lane: int, known: Scenario, arena: Arena, tables: Tables) -> int:
        """Install what the scene of a lane has become.

        Args:
            lane: Which; below `lanes`.
            known: The scenario from now on.
            arena: Its arrays, see `scene_arrays`.
            tables: Likewise.

        Returns:
            Index in the pool of what it is.
        """
        now = len(self) + lane
        self._put(now, arena, tables)
        self._known[now] = known
        return now

    def _put(self, s: int, arena: Arena, tables: Tables) -> None:
        self._arenas.put(s, arena)
        self._tables.put(s, tables)
        self.arrays = self.arrays._replace(arenas=self._arenas.pool, tables=self._tables.pool)

    def chosen(self, given: Any, num_envs: int) -> NDArray[np.int64] | None:
        """(L,) indices of the scenarios that lanes are to fly; None: they are drawn.

        Raises:
            ValueError: There are no such scenarios, or not one for each lane.
        """
        if given is None:
            return None
        chosen = np.asarray(given)
        if chosen.shape != (num_envs,) or chosen.dtype.kind not in "iu":
            raise ValueError(
                f"scenarios are {given!r}; give an index for each of {num_envs} environments"
            )
        if chosen.min() < 0 or chosen.max() >= len(self):
            raise ValueError(
                f"scenarios go from {chosen.min()} to {chosen.max()}; "
                f"the pool has indices from 0 to {len(self) - 1}"
            )
        return chosen.astype(np.int64)

    def orders(
        self, begins: NDArray[np.bool_], lanes: SubEnvironments, chosen: Any
    ) -> NDArray[np.int64]:
        """See `LaneMissions`."""
        return np.where(begins, DRAW if chosen is None else chosen, REST)

    def kept(self) -> dict[str, NDArray[Any]]:
        """Nothing: seeds and numbers of missions say all."""
        return {}

    def redrawn(
        self, state: Mapping[str, NDArray[Any]], begun: NDArray[np.bool_]
    ) -> list[DrawnMission]:
        """See `LaneMissions`."""
        return []

    def install(self, missions: Sequence[DrawnMission]) -> None:
        """See `LaneMissions`."""

    def limits(self, begun: NDArray[np.bool_]) -> dict[str, Any]:
        """See `LaneMissions`."""
        return {}
