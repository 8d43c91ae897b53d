"""A vehicle that was away comes back to its place: straight, or along its path, checked first."""

from __future__ import annotations

import math
from collections.abc import Mapping
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.operations.stream.link import VehicleLink
from uas_coverage_env.operations.stream.surroundings import SwarmSurroundings
from uas_coverage_env.operations.stream.timeline import Timeline

FloatArray = NDArray[np.float64]

_SPEED_MPS, _MPS2 = 4.0, 1.0
_SAME_M = 2.0
_THERE_M = 0.2
_LOOKS_BACK_S, _EVERY_S = 20.0, 0.5


class WayBack:
    """The way of one vehicle.

    Attributes:
        place_m: (3,) its target now; None: it has not come back yet [m].
        velocity_mps: (3,) of that [m/s].
        is_blocked: Whether neither way is clear: it hovers.
        is_there: Whether it has come back.
    """

    def __init__(self) -> None:
        self.place_m: FloatArray | None = None
        self.velocity_mps = np.zeros(3)
        self.is_blocked = self.is_there = False
        self._speed_mps = 0.0
        self._way_m: list[FloatArray] = []

    def go_on(
        self,
        link: VehicleLink,
        plan: Timeline,
        plan_s: float,
        around: SwarmSurroundings,
        others_m: Mapping[str, FloatArray],
        passed_s: float,
        *,
        stands: bool,
    ) -> None:
        """Move the target on.

        Args:
            link: The vehicle.
            plan: Its plan.
            plan_s: The time of the plan at which all wait for it [s].
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
        if not self._way_m:
            if not stands:
                return
            self._way_m = _clear_way(link, plan, plan_s, around, others_m)
            self.is_blocked = not self._way_m
            if self.is_blocked:
                return
            if link.off_m(self.place_m) > _SAME_M:
                self.place_m = link.place_m
        if len(self._way_m) > 1 and np.linalg.norm(self._way_m[0] - self.place_m) < _THERE_M:
            self._way_m.pop(0)
        to_m = self._way_m[-1]
        left_m = float(np.linalg.norm(to_m - self.place_m))
        self.is_there = left_m < _THERE_M and link.off_m(to_m) < _SAME_M
        way_m = self._way_m[0] - self.place_m
        leg_m = float(np.linalg.norm(way_m))
        if leg_m < 1e-3:
            return
        speed_mps = min(self._speed_mps + _MPS2 * passed_s, _SPEED_MPS)
        self._speed_mps = min(speed_mps, math.sqrt(2.0 * _MPS2 * left_m))
        step_m = min(self._speed_mps * passed_s, leg_m)
        self.place_m = self.place_m + way_m * (step_m / leg_m)
        self.velocity_mps = way_m * (self._speed_mps / leg_m) if step_m < left_m else np.zeros(3)


def _clear_way(
    link: VehicleLink,
    plan: Timeline,
    plan_s: float,
    around: SwarmSurroundings,
    others_m: Mapping[str, FloatArray],
) -> list[FloatArray]:
    """Places on the way straight to its place, or else by its path; empty: neither is clear."""
    assert link.place_m is not None
    path_m = plan.places_at_m(np.arange(plan_s - _LOOKS_BACK_S, plan_s, _EVERY_S))
    path_m = np.vstack([path_m, plan.place_m(plan_s)])
    nearest = int(np.linalg.norm(path_m - link.place_m, axis=1).argmin())
    for way_m in (path_m[-1:], path_m[nearest:]):
        legs = pairwise([link.place_m, *way_m])
        if all(around.is_clear(link.name, a, b, others_m) for a, b in legs):
            return list(way_m)
    return []
