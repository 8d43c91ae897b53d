"""Scenarios to draw missions from, in arrays: the arenas, and what learners add to them."""

from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from uas_coverage_env.env.actions import actions_of
from uas_coverage_env.env.episode import with_max_steps
from uas_coverage_env.env.nearest import neighbours_of
from uas_coverage_env.env.observation import scales_of
from uas_coverage_env.scenario import Scenario, load_scenario
from uas_coverage_env.world.borrow import borrow
from uas_coverage_env.world.pool import end_to_end, n_of, pool_arenas

_SPANNED = ("ranges", "scales", "neighbours")

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
    spans: NDArray[np.void]
    """(S,) of SPANS_DTYPE."""


@njit(cache=True, error_model="numpy")
def tables_of(tables, s):
    """Ranges, scales and neighbours of scenario s, in a kernel: borrowed views."""
    at = tables.spans[s]
    return (
        borrow(tables.ranges, at.ranges[0], (at.ranges[1] - at.ranges[0],)),
        borrow(tables.scales, at.scales[0], (at.scales[1] - at.scales[0],)),
        borrow(tables.neighbours, at.neighbours[0], (at.neighbours[1] - at.neighbours[0],)),
    )


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
        self.arenas = pool_arenas(self.scenarios)
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
        self.tables = LearnerTables(**arrays, spans=spans)

    def __len__(self) -> int:
        return len(self.scenarios)


def _loaded(scenario: str | Path | Scenario, max_cycles: int | None) -> Scenario:
    if not isinstance(scenario, Scenario):
        scenario = load_scenario(scenario)
    return scenario if max_cycles is None else with_max_steps(scenario, max_cycles)
