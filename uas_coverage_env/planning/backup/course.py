"""A course: states and inputs of one UAS, to be flown as they are; and how near two of them come.

A course that lands is its own backup trajectory. Any other is followed for some steps only, and
braked then to a hover, which can be held.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.compiled.kernels import allocating_kernel
from uas_coverage_env.geometry.round_shapes import outside_upright_m
from uas_coverage_env.geometry.segments import cylinder_clearance
from uas_coverage_env.planning.backup.braking import brake
from uas_coverage_env.vehicle import layout as S

FloatArray = NDArray[np.float64]

ROUNDING_M = 1e-6
"""By so much a distance may be smaller than what is to be kept [m]."""

NO_NEARER_M = 1e-3
"""What is too near already may come nearer by so much, which is rounding [m]."""

_AS_PLANNED = 1e-6  # of states


@dataclass(frozen=True)
class Course:
    """States and inputs of one UAS from a sample of the mission on.

    Attributes:
        begin: The sample.
        x: (N+1, 14).
        u: (N, 5).
        lands: Whether it ends at home, landed; else hovering.
    """

    begin: int
    x: FloatArray
    u: FloatArray
    lands: bool

    @property
    def end(self) -> int:
        """The last sample."""
        return self.begin + len(self.u)

    def rest(self, step: int) -> Course:
        """What is left at a sample; hovers go on."""
        done = min(step - self.begin, len(self.u))
        return Course(step, self.x[done:], self.u[done:], self.lands)

    def begins_at(self, x: FloatArray) -> bool:
        """Whether a UAS in this state (14,) flies what was planned; its battery is left out."""
        return bool(np.abs(self.x[0, : S.DOD] - x[: S.DOD]).max() <= _AS_PLANNED)

    def path_m(self, steps: int) -> FloatArray:
        """(K+1, 3) positions, K at most `steps`; a hover is held, a UAS that has landed is gone."""
        path_m = self.x[: steps + 1, :3]
        missing = steps + 1 - len(path_m)
        if missing > 0 and not self.lands:
            path_m = np.vstack([path_m, np.broadcast_to(path_m[-1], (missing, 3))])
        return np.ascontiguousarray(path_m)


def braked(vehicle: NDArray[np.void], course: Course, followed: int, steps: int) -> Course:
    """A course followed for some steps, then braked to a hover.

    Args:
        vehicle: Record of VEHICLE_DTYPE.
        course: What is followed.
        followed: For how many steps.
        steps: Of braking, and of the hover that it ends in.
    """
    states, inputs = brake(vehicle, np.ascontiguousarray(course.x[followed]), steps)
    return Course(
        course.begin,
        np.vstack([course.x[: followed + 1], states]),
        np.vstack([course.u[:followed], inputs]),
        False,
    )


def are_apart(one: Course, other: Course, keep_m: float) -> bool:
    """Whether two courses that begin now keep a distance, or come no nearer than they are."""
    steps = max(len(one.u), len(other.u))
    a, b = one.path_m(steps), other.path_m(steps)
    now_m = float(outside_upright_m(a[0] - b[0]))
    return float(apart_m(a, b, 0.0, 0.0)) >= min(keep_m, now_m - NO_NEARER_M) - ROUNDING_M


@allocating_kernel
def apart_m(path_m, other_m, radius_m, half_height_m):
    """Smallest distance of a path from a closed cylinder on another, between samples too: exact.

    Beyond the end of the shorter path nothing is measured. Two UAS: radius and height 0.
    """
    smallest = np.inf
    for n in range(min(len(path_m), len(other_m)) - 1):
        a, b = path_m[n] - other_m[n], path_m[n + 1] - other_m[n + 1]
        smallest = min(
            smallest,
            cylinder_clearance(radius_m, half_height_m, a[0], a[1], a[2], b[0], b[1], b[2]),
        )
    return smallest
