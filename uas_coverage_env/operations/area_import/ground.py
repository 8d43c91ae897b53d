"""The ground in and around a fence, on a lattice in local metres."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import maximum_filter

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class Ground:
    """The ground in and around a fence.

    Attributes:
        east_m: (E,) of the lattice [m].
        north_m: (N,) likewise [m].
        heights_m: (N, E) the highest ground up to half a step from each place, above that of
            take-off [m].
        inside: (N - 1, E - 1) the cells of the lattice that meet the fence or its surroundings.
    """

    east_m: FloatArray
    north_m: FloatArray
    heights_m: FloatArray
    inside: BoolArray

    @cached_property
    def tops_m(self) -> FloatArray:
        """(N - 1, E - 1) no ground in a cell, or one step around it, is higher [m]."""
        h = self.heights_m
        corners = np.maximum(np.maximum(h[:-1, :-1], h[1:, :-1]), np.maximum(h[:-1, 1:], h[1:, 1:]))
        return maximum_filter(corners, size=3, mode="nearest")

    def range_m(self, west: float, south: float, east: float, north: float) -> tuple[float, float]:
        """The lowest and the highest ground in a box and one step around it [m]."""
        columns = _between(self.east_m, west, east)
        rows = _between(self.north_m, south, north)
        part = self.heights_m[rows, columns]
        return float(part.min()), float(part.max())


def _between(lattice_m: FloatArray, low: float, high: float) -> slice:
    """The places of a lattice between two, and the next one on either side."""
    first, last = np.searchsorted(lattice_m, (low, high))
    return slice(max(int(first) - 1, 0), int(last) + 1)
