"""Plans that need no solver: what a UAS flies when no program gives it a plan.

One UAS without a plan must not ground the others: it follows the rest of its way out, or brakes
where it is, and the team is verified with that.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from uas_coverage_baselines.milp_mpc.blocks.battery_reserve import cost_per_s, short_s
from uas_coverage_baselines.milp_mpc.braking import brake
from uas_coverage_baselines.milp_mpc.construction import NEVER, Flight, target_cost
from uas_coverage_baselines.milp_mpc.problem import Plan, PlanningProblem
from uas_coverage_env.vehicle import (
    DOD,
    LIFT,
    PSI,
    TAU_X,
    TAU_Y,
    TAU_Z,
    VZ,
    WX,
    WY,
    WZ,
    compile_vehicle,
)

FloatArray = NDArray[np.float64]


def standby_plans(problem: PlanningProblem, uas: int, out: Plan | None, dt_s: float) -> list[Plan]:
    """Plans of one UAS alone: the rest of its way out, then braking at once.

    Args:
        problem: the decision.
        uas: row of the UAS.
        out: what is left of the last way out, beginning now; None where there is none.
        dt_s: sampling time.
    """
    name, N = problem.names[uas], problem.horizon
    record = compile_vehicle(problem.vehicles[uas], dt_s)[()]
    states, inputs = brake(record, problem.x0[uas], N)
    nothing = np.zeros((N, problem.n_scenario_waypoints), bool)
    plans = [_plan(problem, uas, np.vstack([problem.x0[uas], states]), inputs, nothing)]
    if out is not None and name in out.names:
        row = out.of(name)
        x, u, covers = out.x[row, : N + 1], out.u[row, :N], out.covers[row, :N]
        states, inputs = brake(record, x[-1], N - len(u))
        x, u = np.vstack([x, states]), np.vstack([u, inputs])
        covers = np.vstack([covers, nothing[: N - len(covers)]])
        plans.insert(0, _plan(problem, uas, x, u, covers))
    return plans


def as_flight(problem: PlanningProblem, uas: int, plan: Plan) -> Flight:
    """A UAS's own plan as a flight: what it covers when, and what it costs besides."""
    visit = visits(problem, plan)[0]
    gained = problem.waypoint_weight * np.maximum(problem.horizon - visit, 0)
    return Flight(plan.x[0, :, 0:3], visit, plan.objective + float(gained.sum()), 0.0)


def left_over_flights(problem: PlanningProblem, left: Plan, dt_s: float) -> list[Flight]:
    """What is left of the previous plan as flights; beyond its end at falling velocity."""
    result = []
    for row, name in enumerate(problem.names):
        path = problem.x0[row, None, :3]
        velocity = np.zeros(3)
        visit = np.full(problem.n_waypoints, NEVER, np.int64)
        if name in left.names:
            old = left.of(name)
            path, velocity = left.x[old, : problem.horizon + 1, 0:3], left.x[old, -1, 3:6]
            covers = left.covers[old][:, problem.waypoint_index]
            visit = np.where(covers.any(axis=0), covers.argmax(axis=0), NEVER)
        beyond = np.arange(1, problem.horizon + 2 - len(path))[:, None]
        path = np.vstack([path, path[-1] + 0.5 * dt_s * velocity * beyond])
        cost = float(target_cost(problem, row, path[None], visit[None])[0])
        result.append(Flight(path, visit, cost, 0.0))
    return result


def visits(problem: PlanningProblem, plan: Plan) -> NDArray[np.int64]:
    """(U, W) step at which the plan covers each of the problem's waypoints, `NEVER` if not."""
    covers = plan.covers[:, :, problem.waypoint_index]
    return np.where(covers.any(axis=1), covers.argmax(axis=1), NEVER)


def _plan(
    problem: PlanningProblem, uas: int, x: FloatArray, u: FloatArray, covers: NDArray[np.bool_]
) -> Plan:
    plan = Plan((problem.names[uas],), x[None], u[None], covers[None], 0.0, -np.inf)
    visit = visits(problem, plan)
    objective = _steadiness_cost(problem, uas, x, u)
    objective += cost_per_s(problem.only(uas)) * max(short_s(problem, uas, x[-1]), 0.0)
    objective += float(target_cost(problem, uas, x[None, :, :3], visit)[0])
    gained = problem.waypoint_weight * np.maximum(problem.horizon - visit[0], 0)
    return Plan(plan.names, plan.x, plan.u, plan.covers, objective - float(gained.sum()), -np.inf)


def _steadiness_cost(problem: PlanningProblem, uas: int, x: FloatArray, u: FloatArray) -> float:
    """Part I of the objective along states (N+1, 14) and inputs (N, 5), see `blocks.slack`."""
    w, vehicle = problem.weights, problem.vehicles[uas]
    limits, torque = vehicle.limits, vehicle.torque_max_Nm
    rate, yaw_rate = limits.rate_max_radps, limits.yaw_rate_max_radps
    inputs = np.abs(u[:, [LIFT, TAU_X, TAU_Y, TAU_Z]]).sum(axis=0)
    states = np.abs(x[1:, [WX, WY, WZ, PSI]]).sum(axis=0)
    cost = inputs @ np.array([w.lift / limits.lift_max_N, *(w.torque / t for t in torque[:3])])
    cost += states @ np.array([w.rate / rate, w.rate / rate, w.rate / yaw_rate, 0.0])
    cost += states[3] * w.yaw / limits.yaw_max_rad
    cost += float(np.abs(x[1:, VZ]).sum()) * w.climb / limits.v_down_max_mps
    hovering = problem.models[uas].E[DOD]
    in_any_case = x[0, DOD] + hovering * np.arange(1, len(x))
    return float(cost + w.energy / hovering * (x[1:, DOD] - in_any_case).sum())
