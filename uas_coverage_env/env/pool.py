"""Scenarios to draw missions from, in arrays: the arenas, and what learners add to them."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.borrow import borrow
from uas_coverage_env.env.actions import actions_of
from uas_coverage_env.env.episode import with_max_steps
from uas_coverage_env.env.layout import K_WAYPOINTS, OBSERVATION_SIZE
from uas_coverage_env.env.nearest import NO_TARGET, count_company, neighbours_of
from uas_coverage_env.env.observation import look, scales_of
from uas_coverage_env.kernels import kernel, lending_kernel
from uas_coverage_env.scenario import Scenario, load_scenario
from uas_coverage_env.world.pool import (
    arena_of,
    begin,
    end_to_end,
    lanes_of,
    n_of,
    pool_arenas,
    state_of,
)

_LOOKS = ("first_candidates", "first_company", "first_observation")
_SPANNED = ("ranges", "scales", "neighbours", *_LOOKS)

SPANS_DTYPE = np.dtype((np.record, np.dtype([(field, "i8", (2,)) for field in _SPANNED])))
"""Where a scenario lies in each table: its first row, and the row after its last."""


class LearnerTables(NamedTuple):
    """What learners need beside the arenas, of S scenarios end to end."""

    ranges: NDArray[np.void]
    """(all UAS,) of RANGES_DTYPE: what the numbers of an action mean."""
    scales: NDArray[np.void]
    """(all UAS,) of SCALES_DTYPE: what the numbers of an observation are divided by."""
    neighbours: NDArray[np.void]
    """(all waypoints,) of NEIGHBOURS_DTYPE."""
    first_candidates: NDArray[np.int64]
    """(all UAS, K_WAYPOINTS) what missions begin with, also the next two."""
    first_company: NDArray[np.float32]
    """(all waypoints, 2)."""
    first_observation: NDArray[np.float32]
    """(all UAS, OBSERVATION_SIZE)."""
    spans: NDArray[np.void]
    """(S,) of SPANS_DTYPE."""


@lending_kernel
def tables_of(tables, s):
    """Ranges, scales and neighbours of scenario s, in a kernel: borrowed views."""
    at = tables.spans[s]
    return (
        borrow(tables.ranges, at.ranges[0], (at.ranges[1] - at.ranges[0],)),
        borrow(tables.scales, at.scales[0], (at.scales[1] - at.scales[0],)),
        borrow(tables.neighbours, at.neighbours[0], (at.neighbours[1] - at.neighbours[0],)),
    )


@lending_kernel
def first_look_of(tables, s):
    """Candidates, company and observation at the start of scenario s, likewise."""
    at = tables.spans[s]
    n_uas = at.first_candidates[1] - at.first_candidates[0]
    n_waypoints = at.first_company[1] - at.first_company[0]
    return (
        borrow(tables.first_candidates, at.first_candidates[0], (n_uas, K_WAYPOINTS)),
        borrow(tables.first_company, at.first_company[0], (n_waypoints, 2)),
        borrow(tables.first_observation, at.first_observation[0], (n_uas, OBSERVATION_SIZE)),
    )


@kernel
def _look_first(arenas, tables, worlds, s, targets, candidates, company, observation):
    """Write what is seen at the start of scenario s; it is the same in all its missions."""
    arena = arena_of(arenas, s)
    _, scales, neighbours = tables_of(tables, s)
    state = state_of(worlds, 0, arena.uas.shape[0], arena.waypoints.shape[0])
    begin(arenas, s, state)
    count_company(state.uncovered, neighbours, company)
    for i in range(arena.uas.shape[0]):
        look(
            arena, state, scales[i], company, i, targets, arena.rules[0].max_steps,
            candidates[i], observation[i],
        )  # fmt: skip


class ScenarioPool:
    """One or many scenarios with any numbers of UAS, waypoints and obstacles.

    Args:
        scenario: Name of a shipped scenario, path of a scenario file, or a scenario; or a
            sequence of these.
        action: A name of `ACTION_NAMES`.
        max_cycles: Steps after which missions are cut; None: as each scenario has it.

    Attributes:
        scenarios: (S,) as flown, cut to `max_cycles`.
        actions: The kind of action, of the first scenario; kind and size are those of all.
        arenas: For kernels, see `world.pool`.
        tables: For kernels.
        n_uas: (S,).
        n_waypoints: (S,).

    Raises:
        ValueError: There is no scenario, or an argument is none of what is allowed.
    """

    def __init__(
        self,
        scenario: str | Path | Scenario | Sequence[str | Path | Scenario],
        *,
        action: str = "velocity",
        max_cycles: int | None = None,
    ) -> None:
        given = [scenario] if isinstance(scenario, str | Path | Scenario) else scenario
        self.scenarios = tuple(_loaded(entry, max_cycles) for entry in given)
        self.arenas = pool_arenas(self.scenarios, measured_m=0.0)  # only what counts
        self.n_uas = n_of(self.arenas, "uas")
        self.n_waypoints = n_of(self.arenas, "waypoints")
        actions = [actions_of(action, scenario) for scenario in self.scenarios]
        self.actions = actions[0]
        blocks = {
            "ranges": [entry.ranges for entry in actions],
            "scales": [scales_of(scenario) for scenario in self.scenarios],
            "neighbours": [neighbours_of(scenario) for scenario in self.scenarios],
        }
        spans = np.zeros(len(self.scenarios), dtype=SPANS_DTYPE)
        arrays = {}
        for field, rows in blocks.items():
            arrays[field], spans[field] = end_to_end(rows)
        unseen: dict[str, Any] = {field: np.zeros((0, 0)) for field in _LOOKS}
        looks = self._first_looks(LearnerTables(**arrays, spans=spans, **unseen))
        for field, rows in looks.items():
            arrays[field], spans[field] = end_to_end(rows)
        self.tables = LearnerTables(**arrays, spans=spans)

    def _first_looks(self, tables: LearnerTables) -> dict[str, list[NDArray]]:
        worlds = lanes_of(1, self.arenas)
        looks: dict[str, list[NDArray]] = {field: [] for field in _LOOKS}
        for s, (n_uas, n_waypoints) in enumerate(zip(self.n_uas, self.n_waypoints, strict=True)):
            first = (
                np.full((n_uas, K_WAYPOINTS), -1),
                np.zeros((n_waypoints, 2), np.float32),
                np.zeros((n_uas, OBSERVATION_SIZE), np.float32),
            )
            _look_first(self.arenas, tables, worlds, s, np.full(n_uas, NO_TARGET), *first)
            for rows, array in zip(looks.values(), first, strict=True):
                rows.append(array)
        return looks

    def __len__(self) -> int:
        return len(self.scenarios)


def _loaded(scenario: str | Path | Scenario, max_cycles: int | None) -> Scenario:
    if not isinstance(scenario, Scenario):
        scenario = load_scenario(scenario)
    return scenario if max_cycles is None else with_max_steps(scenario, max_cycles)
