"""The least height above the ground, outside of a UAS's landing zone.

Roofs need nothing here: the problem's obstacles are raised by what is missing above them.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from uas_coverage_baselines.milp_mpc.model.problem import PlanningProblem
from uas_coverage_env.planning.backup.braking import pushed
from uas_coverage_env.vehicle import compile_vehicle
from uas_coverage_env.vehicle import layout as S

FloatArray = NDArray[np.float64]
_ROUNDING_M = 1e-3


def least_heights_m(problem: PlanningProblem, uas: int, steps: int) -> FloatArray:
    """The height that a UAS has to have outside of its landing zone, at each step.

    Where it is too low already, or sinks too fast to stop in time, that is what it reaches by
    climbing at once: there is always a flight that does.

    Args:
        problem: the decision.
        uas: row of the UAS.
        steps: how many.

    Returns:
        (steps+1,).
    """
    x, least_m = problem.x0[uas], np.full(steps + 1, problem.min_height_m)
    if _in_zone(problem, uas, x[:3]) or (-x[S.Z] >= problem.min_height_m and x[S.VZ] <= 0.0):
        return least_m
    vehicle = problem.vehicles[uas]
    record = compile_vehicle(vehicle, problem.dt_s)[()]
    climbing, _ = pushed(record, x, 0.0, 0.0, -vehicle.limits.v_up_max_mps, steps, steps)
    return np.minimum(least_m, -climbing[:, S.Z] - _ROUNDING_M)


def too_low_m(problem: PlanningProblem, uas: int, path: FloatArray) -> FloatArray:
    """By how much a UAS is too low at each sample of flights.

    Args:
        problem: the decision.
        uas: row of the UAS.
        path: (..., n+1, 3) from where it is now.

    Returns:
        (..., n+1), not negative; 0 at the first sample, which is given.
    """
    if not problem.min_height_m:
        return np.zeros(path.shape[:-1])
    low_m = np.maximum(least_heights_m(problem, uas, path.shape[-2] - 1) + path[..., S.Z], 0.0)
    low_m[_in_zone(problem, uas, path)] = 0.0
    low_m[..., 0] = 0.0
    return low_m


def _in_zone(problem: PlanningProblem, uas: int, position: FloatArray) -> NDArray[np.bool_]:
    away = position - problem.home_m[uas]
    return np.asarray(np.hypot(away[..., S.X], away[..., S.Y]) <= problem.landing_zone_m)
