"""A map of letters: what `run --watch` shows, on any terminal and without a display."""

import numpy as np
from numpy.typing import NDArray
from rich.text import Text

from uas_coverage_env.entities.state import LOST
from uas_coverage_env.scenario import Scenario
from uas_coverage_env.world import SwarmState

_MOST_COLUMNS = 72
_LEAST_ROWS, _LEAST_COLUMNS = 4, 16
# The frame and the legend, and below the map the line with the progress, which may be broken once.
_OTHER_ROWS, _OTHER_COLUMNS = 5, 2
_UAS_SIGNS = "123456789ABCDEFGHIJKLMNOPQRSTUVWXYZ"
_LEGEND = "1.. UAS   x lost   o open   . covered   # obstacle   @ moving obstacle   ^ north"


class AsciiMap:
    """The scenario from above, north up; the fixed part is drawn once.

    Args:
        scenario: What is drawn.
        columns: Of the terminal.
        rows: Of the terminal.
    """

    def __init__(self, scenario: Scenario, columns: int, rows: int) -> None:
        corners_m = scenario.fence.vertices_m[:, :2]
        self._low_m = corners_m.min(axis=0)
        self._span_m = np.ptp(corners_m, axis=0)
        self._shape = _shape(self._span_m[0] / self._span_m[1], columns, rows)
        self.change(scenario)

    def change(self, scenario: Scenario) -> None:
        """Draw this scenario from now on, which has the same fence."""
        self._scenario = scenario
        self._waypoints_m = np.array([waypoint.position_m for waypoint in scenario.waypoints])
        self._ground = np.full(self._shape, " ")
        centres_m = self._centres_m()
        for hull in scenario.hulls:
            points_m = np.concatenate(
                [centres_m, np.full((*self._shape, 1), hull.vertices_m[:, 2].mean())], axis=2
            )
            self._ground[hull.signed_distance(points_m) <= 0.0] = "#"

    @property
    def scenario(self) -> Scenario:
        """What is drawn."""
        return self._scenario

    def drawn(self, swarm: SwarmState) -> Text:
        """The map at one sample."""
        cells = self._ground.copy()
        for position_m, uncovered in zip(self._waypoints_m, swarm.uncovered, strict=True):
            self._put(cells, position_m, "o" if uncovered else ".")
        for position_m in swarm.moving_position_m:
            self._put(cells, position_m, "@")
        for i, (x, status) in enumerate(zip(swarm.x, swarm.status, strict=True)):
            sign = _UAS_SIGNS[i % len(_UAS_SIGNS)]
            self._put(cells, x, "x" if status == LOST else sign)
        lines = ["".join(row) for row in cells]
        edge = "+" + "-" * self._shape[1] + "+"
        return Text("\n".join([edge, *(f"|{line}|" for line in lines), edge, _LEGEND]))

    def _put(self, cells: NDArray[np.str_], position_m: NDArray[np.float64], sign: str) -> None:
        parts = (position_m[:2] - self._low_m) / self._span_m
        row, column = (np.array([1.0 - parts[0], parts[1]]) * self._shape).astype(int)
        if 0 <= row < self._shape[0] and 0 <= column < self._shape[1]:  # none outside is drawn
            cells[row, column] = sign

    def _centres_m(self) -> NDArray[np.float64]:
        """(rows, columns, 2) [m] the middle of each character, north and east."""
        rows, columns = self._shape
        north_m = self._low_m[0] + self._span_m[0] * (1.0 - (np.arange(rows) + 0.5) / rows)
        east_m = self._low_m[1] + self._span_m[1] * (np.arange(columns) + 0.5) / columns
        return np.stack(np.meshgrid(north_m, east_m, indexing="ij"), axis=2)


def _shape(north_by_east: float, columns: int, rows: int) -> tuple[int, int]:
    """Rows and columns of the map that fit into a terminal, in the proportions of the area."""
    most_columns = max(_LEAST_COLUMNS, min(_MOST_COLUMNS, columns - _OTHER_COLUMNS))
    most_rows = max(_LEAST_ROWS, rows - _OTHER_ROWS)
    # a character is about twice as high as it is wide
    wanted = round(most_columns * north_by_east / 2)
    if wanted <= most_rows:
        return max(_LEAST_ROWS, wanted), most_columns
    return most_rows, max(_LEAST_COLUMNS, min(most_columns, round(2 * most_rows / north_by_east)))
