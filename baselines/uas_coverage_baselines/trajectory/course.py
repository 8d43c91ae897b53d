"""What is flown: a UAS's planned flight as a course, verified by the world's own tests."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from uas_coverage_baselines.trajectory.fleet import Fleet
from uas_coverage_baselines.trajectory.flight_model import excess, fly_inputs, reduced_state
from uas_coverage_baselines.trajectory.program import PlannedFlight
from uas_coverage_baselines.trajectory.space import spare_of_rules_m
from uas_coverage_env.planning.backup import course as backup_course
from uas_coverage_env.planning.backup.braking import brake
from uas_coverage_env.planning.backup.course import ROUNDING_M, Course
from uas_coverage_env.vehicle import layout as S

FloatArray = NDArray[np.float64]

_LIMIT_USED = 1.001  # the world tolerates 1 %
_DOD_RESERVE = 2e-3


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
    if float(spare_of_rules_m(fleet.programs[uas].space, path_m, True)) < -ROUNDING_M:
        return "too near to an obstacle or the fence"
    landing = fleet.programs[uas].landing
    if np.linalg.norm(path_m[-1] - landing.home_m) > landing.distance_m:
        return "does not come home"
    if np.linalg.norm(states[-1, S.VX : S.VZ + 1]) > landing.speed_mps:
        return "does not land"
    if states[-1, S.DOD] > fleet.brief.dod_landed[uas] - _DOD_RESERVE:
        return "the battery does not last"
    return None


def are_apart(fleet: Fleet, i: int, j: int, one: Course, other: Course) -> bool:
    """Whether two courses that begin now keep the distance of the rules, or come no nearer."""
    return backup_course.are_apart(one, other, fleet.keep_m(i, j))


def hover_inputs(fleet: Fleet, uas: int, x: FloatArray) -> FloatArray:
    """(5,) inputs that brake, and hold a hover."""
    return brake(fleet.arena.vehicles[uas], np.ascontiguousarray(x), 1)[1][0]
