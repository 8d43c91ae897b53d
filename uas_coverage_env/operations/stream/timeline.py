"""Where a UAS is planned to be at any time, between samples too."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicHermiteSpline

from uas_coverage_env.flight import Flight
from uas_coverage_env.flight.record import LANDED
from uas_coverage_env.operations.tracks import LIFT_M
from uas_coverage_env.vehicle import VX, VZ

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Timeline:
    """The planned flight of one UAS, no lower than a take-off leads and a landing begins.

    Attributes:
        times_s: (T,) of the samples [s].
        places_m: (T, 3) north, east, down [m].
        velocities_mps: (T, 3) [m/s].
    """

    times_s: FloatArray
    places_m: FloatArray
    velocities_mps: FloatArray

    @property
    def first_s(self) -> float:
        """When the UAS sets off [s]."""
        return float(self.times_s[0])

    @property
    def last_s(self) -> float:
        """When it begins to land [s]."""
        return float(self.times_s[-1])

    def place_m(self, time_s: float) -> FloatArray:
        """(3,) at a time; before and after, where it begins and ends [m]."""
        return self._curve(min(max(time_s, self.first_s), self.last_s))

    def velocity_mps(self, time_s: float) -> FloatArray:
        """(3,) at a time; at rest before and after [m/s]."""
        if not self.first_s <= time_s < self.last_s:
            return np.zeros(3)
        return self._curve(time_s, 1)

    @cached_property
    def _curve(self) -> CubicHermiteSpline:
        return CubicHermiteSpline(self.times_s, self.places_m, self.velocities_mps)


def timeline_of(flight: Flight, uas: int) -> Timeline | None:
    """The timeline of a UAS; None where it stays on the ground.

    Args:
        flight: In which the UAS has landed.
        uas: Its index.
    """
    flying = np.flatnonzero(flight.mode[:, uas] < LANDED)
    x = flight.x[: flying[-1] + 1, uas] if len(flying) else np.empty((0, VZ + 1))
    low = -x[:, 2] < LIFT_M
    if low.all():
        return None
    places_m, velocities_mps = x[:, :3].copy(), x[:, VX : VZ + 1].copy()
    places_m[low, 2], velocities_mps[low, 2] = -LIFT_M, 0.0
    velocities_mps[[0, -1]] = 0.0
    times_s = flight.scenario.dt_s * np.arange(len(x), dtype=np.float64)
    return Timeline(times_s, places_m, velocities_mps)
