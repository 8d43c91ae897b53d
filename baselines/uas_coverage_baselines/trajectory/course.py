"""What is flown: a UAS's planned states and inputs, verified by the world's own tests.

A course that lands is its own backup trajectory. One that comes near to where something moves is
followed for some steps only, and braked then.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from uas_coverage_baselines.braking import brake
from uas_coverage_baselines.trajectory.fleet import Fleet
from uas_coverage_baselines.trajectory.flight_model import excess, fly_inputs, reduced_state
from uas_coverage_baselines.trajectory.program import PlannedFlight
from uas_coverage_baselines.trajectory.space import apart_m, spare_of_rules_m
from uas_coverage_env.vehicle import layout as S

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

BRAKING_S = 14.0
"""Braking from any speed has ended after this time."""

_LIMIT_USED = 1.001  # the world tolerates 1 %
_ROUNDING_M = 1e-6
_AS_PLANNED = 1e-6  # of states
_DOD_RESERVE = 2e-3


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


def course_of(fleet: Fleet, uas: int, begin: int, x: FloatArray, flight: PlannedFlight) -> Course:
    """A flight as the world flies it."""
    states, inputs, _ = fly_inputs(fleet.arena.vehicles[uas], x, flight.u)
    return Course(begin, states, inputs, True)


def trouble_alone(fleet: Fleet, uas: int, x: FloatArray, flight: PlannedFlight) -> str | None:
    """Why a flight must not be flown, None where nothing is wrong; other UAS are left aside.

    Limits are not looked at where the UAS is beyond one already: no plan led it there.

    Args:
        fleet: The mission.
        uas: Index of the UAS.
        x: (14,) its state.
        flight: From there.
    """
    states, _, used = fly_inputs(fleet.arena.vehicles[uas], x, flight.u)
    if not np.isfinite(states).all():
        return "not finite"
    is_beyond = excess(fleet.programs[uas].model, reduced_state(x)) > 0.0
    if used.max() > _LIMIT_USED and not is_beyond:
        return "beyond a limit of the vehicle"
    path_m = np.ascontiguousarray(states[:, :3])
    if float(spare_of_rules_m(fleet.programs[uas].space, path_m, True)) < -_ROUNDING_M:
        return "too near to an obstacle or the fence"
    landing = fleet.programs[uas].landing
    if np.linalg.norm(path_m[-1] - landing.home_m) > landing.distance_m:
        return "does not come home"
    if np.linalg.norm(states[-1, S.VX : S.VZ + 1]) > landing.speed_mps:
        return "does not land"
    if states[-1, S.DOD] > float(fleet.brief.uas[uas].dod_max) - _DOD_RESERVE:
        return "the battery does not last"
    return None


def are_apart(fleet: Fleet, i: int, j: int, one: Course, other: Course) -> bool:
    """Whether two courses that begin now keep the distance of the rules, or come no nearer."""
    steps = max(len(one.u), len(other.u))
    a, b = one.path_m(steps), other.path_m(steps)
    away = a[0] - b[0]
    now_m = max(float(np.hypot(away[0], away[1])), abs(float(away[2])))
    keep_m = min(fleet.keep_m(i, j), now_m - 1e-3)
    return float(apart_m(a, b, 0.0, 0.0)) >= keep_m - _ROUNDING_M


def braked(fleet: Fleet, uas: int, course: Course, followed: int) -> Course:
    """A course followed for some steps, then braked to a hover."""
    steps = int(np.ceil(BRAKING_S / fleet.brief.dt_s))
    states, inputs = brake(fleet.arena.vehicles[uas], course.x[followed], steps)
    return Course(
        course.begin,
        np.vstack([course.x[: followed + 1], states]),
        np.vstack([course.u[:followed], inputs]),
        False,
    )


def hover_inputs(fleet: Fleet, uas: int, x: FloatArray) -> FloatArray:
    """(5,) inputs that brake, and hold a hover."""
    return brake(fleet.arena.vehicles[uas], np.ascontiguousarray(x), 1)[1][0]
