"""Coming home with charge left: DoD_max as a constraint of the plan's end."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from uas_coverage_baselines.milp_mpc.model.milp import Milp
from uas_coverage_baselines.milp_mpc.model.problem import (
    PlanningProblem,
    Trajectories,
    Variables,
    WayHome,
)
from uas_coverage_env.geometry import cylinder_faces
from uas_coverage_env.planning.reserves import MILP_RESERVE, milp_braking_s
from uas_coverage_env.vehicle import LinearModel, VehicleParams
from uas_coverage_env.vehicle import layout as S
from uas_coverage_env.vehicle.range import (
    dod_per_s,
    flight_seconds,
    level_seconds,
    speeds_of,
    vertical_seconds,
)

FloatArray = NDArray[np.float64]
_BATTERY = [S.DOD, S.U_TH]


def settling_s(vehicle: VehicleParams, dt_s: float) -> float:
    """What the reserve holds back beyond the flight home itself [s]."""
    return milp_braking_s(vehicle, dt_s) + MILP_RESERVE.landing_s


class BatteryReserve:
    """DoD(N) + what flying home from p(N) takes <= DoD_max, per UAS.

    The paper bounds DoD by the cutoff and leaves coming home to the return mode's threshold
    (Sec. III-C.6); this is the terminal set that makes DoD_max a constraint. The flight home is
    timed at nearly full speed with a detour, the descent and the landing one after the other
    (`MILP_RESERVE`), the horizontal norm from above by H_P faces (eq. (const_Vec_ub)): a row per
    face and sense of the climb,

        DoD(N) / rate + f · (p(N) - p_home) <= DoD_max / rate - landing - allowance + short,

    in seconds of cruising. DoD(N) is written in Delta T, which the dynamics make it a function of,
    so that the rows are the same whether the battery's states have columns or not.

    Where an obstacle shades home (`WayHome`), p_home is the corner at which the way home turns, and
    the time from there is taken off the room.

    It never makes the OCP infeasible: short >= 0 is bounded by what the left side exceeds the right
    one by at most, over all reachable p(N) and all Delta T within its limits, so that every point
    of the other rows has a `short` that fits. It is zero wherever it can be: a second of it costs
    more than all coverage that is left to gain and all distance from home together. So a plan that
    comes home in time is preferred to any that does not, and a UAS that is too late already flies
    home as well as it can. Where nothing reachable is too far there are no rows at all.
    """

    def add_to(self, milp: Milp, v: Variables, problem: PlanningProblem) -> None:
        """Add the rows and the cost of each UAS whose reserve could fall short."""
        for uas, name in enumerate(problem.names):
            vehicle, model = problem.vehicles[uas], problem.models[uas]
            faces, rate = _time_faces(problem, uas), _rate(problem, uas)
            start, gain = _last_dod(model, problem.x0[uas, _BATTERY], problem.horizon)
            room = _room_s(problem, uas) - start / rate + faces @ _towards_m(problem, uas)
            thrust = vehicle.limits.delta_thrust_max_N, vehicle.limits.delta_thrust_min_N
            most = np.maximum(gain * thrust[0], gain * thrust[1]).sum() / rate
            excess = problem.reach.support(faces)[uas, -1] + most - room
            if (excess <= 0.0).all():
                continue
            short = milp.variables(f"reserve.{name}.short", (1,), lower=0.0, upper=excess.max())
            milp.subject_to(
                f"reserve.{name}",
                (faces, v.position[uas, -1][None, :]),
                (gain / rate, v.u[uas, :, S.DELTA_THRUST][None, :]),
                (-1.0, short[None, :]),
                upper=room,
                where=excess > 0.0,
            )
            milp.minimize(cost_per_s(problem), short)

    def cost_along(self, problem: PlanningProblem, uas: int, flights: Trajectories) -> FloatArray:
        """(S,) what falls short costs, 0 where states are not known."""
        cost = np.zeros(len(flights.positions_m))
        if flights.x is None:
            return cost
        for row, x in enumerate(flights.x):
            cost[row] = cost_per_s(problem.only(uas)) * max(short_s(problem, uas, x[-1]), 0.0)
        return cost


def cost_per_s(problem: PlanningProblem) -> float:
    """Cost of a second by which the reserve falls short; more than a plan can gain otherwise."""
    distance = sum(target.weight * 100.0 for target in problem.targets if target is not None)
    return 10.0 + problem.horizon * (float(problem.waypoint_weight.sum()) + distance)


def short_s(problem: PlanningProblem, uas: int, x: FloatArray, allowance: bool = True) -> float:
    """By how much charge falls short of the way home from a state; negative where some is left [s].

    Args:
        problem: the decision.
        uas: row of the UAS.
        x: (14,) the state.
        allowance: whether it still has to brake to a hover.
    """
    way_s = float((_time_faces(problem, uas) @ (x[:3] - _towards_m(problem, uas))).max())
    spent_s = float(x[S.DOD]) / _rate(problem, uas)
    result = spent_s + way_s - _room_s(problem, uas)
    return result if allowance else result - _braking_s(problem, uas)


def straight_seconds_home(vehicle: VehicleParams, away_m: FloatArray) -> float:
    """Flight time home as the reserve takes it [s]; how far on the safe side: docs/range.md.

    Args:
        vehicle: that flies.
        away_m: (3,) from its home to where it is, or back.
    """
    way_m, height_m = float(np.hypot(away_m[0], away_m[1])), abs(float(away_m[2]))
    return flight_seconds(MILP_RESERVE, speeds_of(vehicle), 0.0, way_m, 0.0, height_m)


def seconds_onward(vehicle: VehicleParams, way_m: float, height_m: float) -> float:
    """Flight time of a part of the way home that is not its end [s].

    Args:
        vehicle: that flies.
        way_m: its horizontal length.
        height_m: between its ends.
    """
    seconds = flight_seconds(MILP_RESERVE, speeds_of(vehicle), 0.0, way_m, 0.0, height_m)
    return seconds - MILP_RESERVE.landing_s


def _rate(problem: PlanningProblem, uas: int) -> float:
    """Depth of discharge that a second of flight takes, at the end of the way home [1/s]."""
    return dod_per_s(problem.vehicles[uas], float(problem.dod_max[uas]))


def _room_s(problem: PlanningProblem, uas: int) -> float:
    """Seconds of cruising in a battery that is full, less landing and allowance."""
    full_s = float(problem.dod_max[uas]) / _rate(problem, uas)
    way = _way_home(problem, uas)
    onward_s = 0.0 if way is None else way.onward_s
    return full_s - MILP_RESERVE.landing_s - _braking_s(problem, uas) - onward_s


def _braking_s(problem: PlanningProblem, uas: int) -> float:
    return milp_braking_s(problem.vehicles[uas], problem.dt_s)


def _way_home(problem: PlanningProblem, uas: int) -> WayHome | None:
    return problem.ways_home[uas] if problem.ways_home else None


def _towards_m(problem: PlanningProblem, uas: int) -> FloatArray:
    """(3,) where the next leg home ends."""
    way = _way_home(problem, uas)
    return problem.home_m[uas] if way is None else way.corner_m


def _time_faces(problem: PlanningProblem, uas: int) -> FloatArray:
    """Rows whose largest value along the way from home is the time it takes [s/m].

    (2 H_P, 3), one for each sense of a climb; (H_P, 3) in the plane.
    """
    speeds = speeds_of(problem.vehicles[uas])
    # the faces measure the norm from below by at most this factor
    level = cylinder_faces(problem.physical_sides) / np.cos(np.pi / problem.physical_sides)
    level = level_seconds(MILP_RESERVE, speeds, level)
    if problem.planar:
        return level
    down = np.array([0.0, 0.0, vertical_seconds(speeds, 0.0, 1.0)])
    return np.vstack([level + down, level - down])


def _last_dod(model: LinearModel, battery: FloatArray, horizon: int) -> tuple[float, FloatArray]:
    """DoD(N) = start + gain · Delta T, from the battery's rows of the dynamics; gain (N,)."""
    A, B, E = model.A[np.ix_(_BATTERY, _BATTERY)], model.B[_BATTERY, S.DELTA_THRUST], model.E
    gain, later = np.empty(horizon), np.eye(2)
    start = battery
    for n in range(horizon):
        start = A @ start + E[_BATTERY]
        gain[horizon - 1 - n] = later[0] @ B
        later = later @ A
    return float(start[0]), gain
