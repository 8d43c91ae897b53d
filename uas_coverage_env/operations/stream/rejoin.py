"""A vehicle that was away comes back to its place: on a straight line that is checked first."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.operations.stream.around import Around
from uas_coverage_env.operations.stream.link import VehicleLink

FloatArray = NDArray[np.float64]

_SPEED_MPS, _MPS2 = 4.0, 1.0
_SAME_M = 2.0
_THERE_M = 0.2


class WayBack:
    """The way of one vehicle.

    Attributes:
        place_m: (3,) its target now; None: it has not come back yet [m].
        velocity_mps: (3,) of that [m/s].
        is_blocked: Whether the straight way is not clear: it hovers.
        is_there: Whether it has come back.
    """

    def __init__(self) -> None:
        self.place_m: FloatArray | None = None
        self.velocity_mps = np.zeros(3)
        self.is_blocked = self.is_there = False
        self._speed_mps = 0.0
        self._sets_off = False

    def go_on(
        self,
        link: VehicleLink,
        to_m: FloatArray,
        around: Around,
        others_m: Mapping[str, FloatArray],
        passed_s: float,
        *,
        stands: bool,
    ) -> None:
        """Move the target on.

        Args:
            link: The vehicle.
            to_m: (3,) its place [m].
            around: What it has to be clear of.
            others_m: (3,) where other vehicles are, by name [m].
            passed_s: Since the last call [s].
            stands: Whether plan time does; until then it hovers where it is.
        """
        assert link.place_m is not None
        if self.place_m is None:
            speed_mps = float(np.linalg.norm(link.velocity_mps))
            self.place_m = link.place_m + link.velocity_mps * (speed_mps / 5.0)
        self.velocity_mps = np.zeros(3)
        if not self._sets_off:
            if not stands:
                return
            self.is_blocked = not around.is_clear(link.name, link.place_m, to_m, others_m)
            if self.is_blocked:
                return
            self._sets_off = True
            if link.off_m(self.place_m) > _SAME_M:
                self.place_m = link.place_m
        way_m = to_m - self.place_m
        left_m = float(np.linalg.norm(way_m))
        self.is_there = left_m < _THERE_M and link.off_m(to_m) < _SAME_M
        if left_m < 1e-3:
            return
        speed_mps = min(self._speed_mps + _MPS2 * passed_s, _SPEED_MPS)
        self._speed_mps = min(speed_mps, math.sqrt(2.0 * _MPS2 * left_m))
        step_m = min(self._speed_mps * passed_s, left_m)
        self.place_m = self.place_m + way_m * (step_m / left_m)
        self.velocity_mps = way_m * (self._speed_mps / left_m) if step_m < left_m else np.zeros(3)
