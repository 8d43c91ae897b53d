"""Scenarios to draw missions from, in arrays: the arenas, and what learners add to them."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.compiled.memory import Pool
from uas_coverage_env.compiled.views import lane_view, pool_view
from uas_coverage_env.env.actions import actions_of
from uas_coverage_env.env.memory import FIRST_OBSERVATION, LEARNERS, TABLES, FirstObservation
from uas_coverage_env.env.observe import observing_of
from uas_coverage_env.env.settings import MissionSettings
from uas_coverage_env.env.start import first_observation, learners_sizes, tables_of
from uas_coverage_env.scenario import Scenario, loaded_scenario
from uas_coverage_env.simulation.pool import pool_worlds
from uas_coverage_env.world.arena import ARENA
from uas_coverage_env.world.disturbance import Disturbance, fitted_to, in_slots
from uas_coverage_env.world.events import goes_home
from uas_coverage_env.world.state import STATE


def check_scene(scenario: Scenario) -> None:
    """Refuse a scenario whose scene changes.

    Raises:
        ValueError: It does; the scenes of a batch are laid out once.
    """
    for event in scenario.events:
        if event.changes_scene:
            raise ValueError(
                f"scenario {scenario.name!r} has an event {event.kind!r}, which changes the "
                f"scene: batches do not fly that; take parallel_env, env or gymnasium.make"
            )
    if scenario.asks_again:
        raise ValueError(
            f"scenario {scenario.name!r} has waypoints with again_after_s, by which the scene "
            f"changes: batches do not fly that; take parallel_env, env or gymnasium.make"
        )


class MissionPool(NamedTuple):
    """All that missions of S scenarios need, for kernels."""

    arenas: Pool
    """Of `ARENA`."""
    starts: Pool
    """Of `STATE`: the worlds at t = 0."""
    tables: Pool
    """Of `TABLES`."""
    learners: Pool
    """Of `LEARNERS`: at t = 0."""
    first_observations: Pool
    """Of `FIRST_OBSERVATION`: at t = 0."""


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
        disturbances: One of each kind that there is to be room for; None: those that act.

    Attributes:
        settings: As given.
        scenarios: (S,) as flown, with the time limit of the settings.
        actions: The kind of action, of the first scenario; kind and size are those of all.
        arrays: For kernels.
        sizes: The largest of every named size.
        n_uas: (S,).
        n_waypoints: (S,).
        disturbances: One of each kind that acts in any of the scenarios.
        goes_home: Whether an event of any of them may send a UAS home.

    Raises:
        ValueError: There is no scenario, or one is none of what is allowed.
    """

    def __init__(
        self,
        scenario: str | Path | Scenario | Sequence[str | Path | Scenario],
        settings: MissionSettings | None = None,
        disturbances: Sequence[Disturbance] | None = None,
    ) -> None:
        if callable(scenario):
            raise ValueError(
                f"scenario is {scenario!r}; give scenarios here, nothing that draws them"
            )
        given = [scenario] if isinstance(scenario, str | Path | Scenario) else scenario
        settings = settings or MissionSettings()
        self.settings = settings
        self.scenarios = tuple(settings.limited(loaded_scenario(entry)) for entry in given)
        for each in self.scenarios:
            check_scene(each)
        self.goes_home = any(goes_home(scenario) for scenario in self.scenarios)
        acting = [settings.disturbances_in(scenario) for scenario in self.scenarios]
        if disturbances is None:
            self.disturbances, slots = in_slots(acting)
        else:
            self.disturbances = tuple(disturbances)
            slots = [fitted_to(disturbances, own) for own in acting]
        worlds = pool_worlds(self.scenarios, measured_m=0.0, slots=slots)  # only what counts
        actions = [actions_of(settings.action, scenario) for scenario in self.scenarios]
        self.actions = actions[0]
        tables = [tables_of(*both) for both in zip(self.scenarios, actions, strict=True)]
        own_sizes = learners_sizes(settings, self.actions.size)
        observing = observing_of(settings.observation)
        first = [
            first_observation(
                ARENA.mission(worlds.arenas, s),
                STATE.mission(worlds.starts, s),
                tables[s],
                observing,
                own_sizes,
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
        self.sizes = {**largest, **own_sizes}
        self.n_uas = ARENA.size(worlds.arenas, "U")
        self.n_waypoints = ARENA.size(worlds.arenas, "W")

    def __len__(self) -> int:
        return len(self.scenarios)

    def chosen(self, given: Any, num_envs: int) -> NDArray[np.int64] | None:
        """(L,) indices of the scenarios that lanes are to fly; None: they are drawn.

        Raises:
            ValueError: There are no such scenarios, or not one for each lane.
        """
        if given is None:
            return None
        chosen = np.asarray(given)
        if chosen.shape != (num_envs,) or chosen.dtype.kind not in "iu":
            raise ValueError(f"scenarios are {given!r}; give an index for each of {num_envs} lanes")
        if chosen.min() < 0 or chosen.max() >= len(self):
            raise ValueError(
                f"scenarios go from {chosen.min()} to {chosen.max()}; "
                f"the pool has indices from 0 to {len(self) - 1}"
            )
        return chosen.astype(np.int64)
