"""Where a UAS is planned to be at any time, between samples too."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicHermiteSpline

from uas_coverage_env.flight import Flight
from uas_coverage_env.flight.record import LANDED
from uas_coverage_env.flight.take_offs import TAKE_OFF_HEIGHT_M
from uas_coverage_env.vehicle.layout import VX, VZ

FloatArray = NDArray[np.float64]

_SAME_M = 0.5


@dataclass(frozen=True, eq=False)
class Timeline:
    """The planned flight of one UAS, from where a take-off leads until a landing begins.

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

    def places_at_m(self, times_s: FloatArray) -> FloatArray:
        """(N, 3) at N times [m]."""
        return self._curve(np.clip(times_s, self.first_s, self.last_s))

    def velocities_at_mps(self, times_s: FloatArray) -> FloatArray:
        """(N, 3) at N times [m/s]."""
        return self._where_it_flies(times_s, 1)

    def accelerations_at_mps2(self, times_s: FloatArray) -> FloatArray:
        """(N, 3) at N times [m/s²]."""
        return self._where_it_flies(times_s, 2)

    def _where_it_flies(self, times_s: FloatArray, derivative: int) -> FloatArray:
        flies = (times_s >= self.first_s) & (times_s < self.last_s)
        within = np.clip(times_s, self.first_s, self.last_s)
        return np.where(flies[:, None], self._curve(within, derivative), 0.0)

    @cached_property
    def fastest_mps(self) -> float:
        """Its largest level speed at samples [m/s]."""
        return float(np.hypot(*self.velocities_mps[:, :2].T).max())

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
    low = -x[:, 2] < TAKE_OFF_HEIGHT_M
    if low.all():
        return None
    places_m, velocities_mps = x[:, :3].copy(), x[:, VX : VZ + 1].copy()
    places_m[low, 2], velocities_mps[low, 2] = -TAKE_OFF_HEIGHT_M, 0.0
    # over its places of take-off and landing it would only stand
    away = [np.hypot(*(places_m - places_m[end])[:, :2].T) > _SAME_M for end in (0, -1)]
    begins = max(int((~low | away[0]).argmax()) - 1, 0)
    ends = len(x) - max(int((~low | away[1])[::-1].argmax()) - 1, 0)
    velocities_mps[[begins, ends - 1]] = 0.0
    times_s = flight.scenario.dt_s * np.arange(len(x), dtype=np.float64)
    kept = slice(begins, ends)
    return Timeline(times_s[kept], places_m[kept], velocities_mps[kept])
