"""Ground that rises above the take-off places as obstacles: few upright boxes that hold it.

A box over everything is cut where that takes away most of what is air, again and again, until all
boxes fit or there are enough of them. Low ground gets none.
"""

from __future__ import annotations

import heapq
import itertools
import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from shapely.geometry import Polygon, box

from uas_coverage_env.files.errors import InputError
from uas_coverage_env.operations.area_import.ground import Ground

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]

LOW_M = 3.0
"""Ground that is less than that above the take-off places is taken for flat, as theirs."""

MOST_BOXES = 32
_FITS_M = 8.0
"""A box that is nowhere higher above the ground is not cut."""


@dataclass(frozen=True, eq=False)
class Hill:
    """A box of ground (x east, y north) and its top above the take-off places [m]."""

    footprint: Polygon
    top_m: float


@dataclass(frozen=True)
class _Part:
    """Rows and columns of cells."""

    top: int
    bottom: int
    left: int
    right: int

    @property
    def index(self) -> tuple[slice, slice]:
        return slice(self.top, self.bottom), slice(self.left, self.right)


def hills(ground: Ground, starts_m: FloatArray, free_m: float) -> list[Hill]:
    """Boxes that hold all ground of a fence higher than `LOW_M`, and no start.

    Args:
        ground: The ground.
        starts_m: (U, 2) east and north of the take-off places [m].
        free_m: Around these, nothing is an obstacle [m].

    Raises:
        InputError: The ground rises beside a start.
    """
    cutter = _Cutter(ground, starts_m, free_m)
    return [
        Hill(
            box(
                *(ground.east_m[part.left], ground.north_m[part.top]),
                *(ground.east_m[part.right], ground.north_m[part.bottom]),
            ),
            math.ceil(10.0 * cutter.top_m(part)) / 10.0,  # files round to less than that
        )
        for part in cutter.parts()
    ]


class _Cutter:
    def __init__(self, ground: Ground, starts_m: FloatArray, free_m: float) -> None:
        self._heights = np.where(ground.inside, ground.tops_m, 0.0)
        self._heights[self._heights <= LOW_M] = 0.0
        self._counts = ground.inside
        self._free = np.zeros_like(ground.inside)
        for n, (east_m, north_m) in enumerate(starts_m):
            rows = _meeting(ground.north_m, north_m - free_m, north_m + free_m)
            columns = _meeting(ground.east_m, east_m - free_m, east_m + free_m)
            rises_m = float(self._heights[rows, columns].max())
            if rises_m > 0.0:
                raise InputError(
                    f"the ground rises to {rises_m:.1f} m within {free_m:g} m of the take-off "
                    f"place of uas_{n + 1}; take off from where it is level"
                )
            self._free[rows, columns] = True

    def top_m(self, part: _Part) -> float:
        """Of the box over some cells."""
        return float(self._heights[part.index].max())

    def parts(self) -> Iterator[_Part]:
        """The high cells in parts, each under one box."""
        if not self._heights.any():
            return
        order = itertools.count()
        whole = self._trimmed(_Part(0, self._heights.shape[0], 0, self._heights.shape[1]))
        left = [(*self._rank(whole), next(order), whole)]
        kept = 0
        while left:
            rank, _, _, part = heapq.heappop(left)
            has_to = rank == 0
            if not has_to and (kept + len(left) + 1 >= MOST_BOXES or self._fits(part)):
                kept += 1
                yield part
                continue
            for half in self._cut(part, has_to):
                if self.top_m(half) > 0.0:
                    trimmed = self._trimmed(half)
                    heapq.heappush(left, (*self._rank(trimmed), next(order), trimmed))

    def _trimmed(self, part: _Part) -> _Part:
        """Without the rows and columns at its edges that are low."""
        high = self._heights[part.index] > 0.0
        rows, columns = (np.flatnonzero(high.any(axis=axis)) for axis in (1, 0))
        return _Part(
            part.top + int(rows[0]),
            part.top + int(rows[-1]) + 1,
            part.left + int(columns[0]),
            part.left + int(columns[-1]) + 1,
        )

    def _rank(self, part: _Part) -> tuple[int, float]:
        """First those that hold a start, then those with most air in them."""
        return (0 if self._free[part.index].any() else 1), -self._air(part)

    def _air(self, part: _Part) -> float:
        counted = self._counts[part.index]
        return float(self.top_m(part) * counted.sum() - self._heights[part.index][counted].sum())

    def _fits(self, part: _Part) -> bool:
        heights = self._heights[part.index][self._counts[part.index]]
        return not heights.size or float(heights.max() - heights.min()) <= _FITS_M

    def _cut(self, part: _Part, beside_start: bool) -> tuple[_Part, _Part]:
        """The two halves with least air in them; beside a start, cut along its surroundings."""
        cuts = [
            (float(air), axis, k + 1)
            for axis in (0, 1)
            for k, air in enumerate(self._air_of_cuts(part, axis))
        ]
        if beside_start:
            held = [np.flatnonzero(self._free[part.index].any(axis=1 - axis)) for axis in (0, 1)]
            edges = [{int(places[0]), int(places[-1]) + 1} for places in held]
            cuts = [cut for cut in cuts if cut[2] in edges[cut[1]]] or cuts
        _, axis, k = min(cuts)  # one cell is never cut: it fits, and holds no start if it is high
        if axis == 0:
            middle = part.top + k
            return (
                _Part(part.top, middle, part.left, part.right),
                _Part(middle, part.bottom, part.left, part.right),
            )
        middle = part.left + k
        return (
            _Part(part.top, part.bottom, part.left, middle),
            _Part(part.top, part.bottom, middle, part.right),
        )

    def _air_of_cuts(self, part: _Part, axis: int) -> FloatArray:
        """(n - 1,) volume of the two boxes for each cut across an axis, in cells times metres."""
        highest = self._heights[part.index].max(axis=1 - axis)
        counted = self._counts[part.index].sum(axis=1 - axis)
        before = np.maximum.accumulate(highest) * np.cumsum(counted)
        after = np.maximum.accumulate(highest[::-1]) * np.cumsum(counted[::-1])
        return (before[:-1] + after[::-1][1:]).astype(np.float64)


def _meeting(lines_m: FloatArray, low: float, high: float) -> slice:
    """The cells between the lines of a lattice that meet an interval."""
    first = int(np.searchsorted(lines_m, low, "right")) - 1
    last = int(np.searchsorted(lines_m, high, "left"))
    return slice(max(first, 0), max(min(last, len(lines_m) - 1), 1))
