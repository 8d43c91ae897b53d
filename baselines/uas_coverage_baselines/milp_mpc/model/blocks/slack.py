"""Slack variables and their cost (OCP_4, part I of the objective)."""

from __future__ import annotations

import numpy as np

from uas_coverage_baselines.milp_mpc.model.milp import ABSENT, Milp
from uas_coverage_baselines.milp_mpc.model.problem import PlanningProblem, Trajectories, Variables
from uas_coverage_env.vehicle import layout as S


class Slack:
    """-a_s <= a <= a_s, with a_s penalised: steady flight and little energy (Sec. III-C.1, OCP_4).

    Penalised are |L|, |tau|, |omega|, |psi| and DoD (which is its own absolute value), each
    normalised by its largest value; DoD by what a step of hovering takes.

    | symbol | meaning | attribute |
    | --- | --- | --- |
    | x_s, u_s | slack variables of absolute values | columns `slack.NAME` |
    | W_u, W_x | cost coefficients | `problem.weights`: all but `climb` |
    | | ours, 0 by default: of the climb rate | `problem.weights.climb` |
    """

    def add_to(self, milp: Milp, v: Variables, problem: PlanningProblem) -> None:
        """Add slack columns, their rows and part I of the objective."""
        w = problem.weights
        limit, torque = problem.limit, problem.torque_max_Nm
        for name, columns, weight, largest in (
            ("lift", v.u[:, :, S.LIFT], w.lift, limit("lift_max_N")),
            ("torque_x", v.u[:, :, S.TAU_X], w.torque, torque(0)),
            ("torque_y", v.u[:, :, S.TAU_Y], w.torque, torque(1)),
            ("torque_z", v.u[:, :, S.TAU_Z], w.torque, torque(2)),
            ("rate_x", v.x[:, 1:, S.WX], w.rate, limit("rate_max_radps")),
            ("rate_y", v.x[:, 1:, S.WY], w.rate, limit("rate_max_radps")),
            ("rate_z", v.x[:, 1:, S.WZ], w.rate, limit("yaw_rate_max_radps")),
            ("yaw", v.x[:, 1:, S.PSI], w.yaw, limit("yaw_max_rad")),
            ("climb", v.x[:, 1:, S.VZ], w.climb, limit("v_down_max_mps")),
        ):
            if weight == 0.0 or (columns == ABSENT).all():
                continue
            slack = milp.variables(f"slack.{name}", columns.shape, lower=0.0)
            for side, sign in (("above", -1.0), ("below", 1.0)):
                milp.subject_to(
                    f"slack.{name}_{side}",
                    (1.0, slack[..., None]),
                    (sign, columns[..., None]),
                    lower=0.0,
                )
            milp.minimize(weight / largest[:, None], slack)
        hovering = np.array([model.E[S.DOD] for model in problem.models])
        milp.minimize(w.energy / hovering[:, None], v.x[:, 1:, S.DOD])
        # what hovering takes in any case: left out, so that J is what the plan can influence
        steps = np.arange(1, problem.horizon + 1)
        in_any_case = problem.x0[:, S.DOD, None] + hovering[:, None] * steps
        milp.add_constant(-float((w.energy / hovering[:, None] * in_any_case).sum()))

    def cost_along(self, problem: PlanningProblem, uas: int, flights: Trajectories) -> np.ndarray:
        """(S,) part I of the objective, 0 where states and inputs are not known."""
        cost = np.zeros(len(flights.positions_m))
        if flights.x is None or flights.u is None:
            return cost
        for row, (x, u) in enumerate(zip(flights.x, flights.u, strict=True)):
            cost[row] = _steadiness_cost(problem, uas, x, u)
        return cost


def _steadiness_cost(problem: PlanningProblem, uas: int, x: np.ndarray, u: np.ndarray) -> float:
    """Part I of the objective along states (N+1, 14) and inputs (N, 5), see `Slack`."""
    w, vehicle = problem.weights, problem.vehicles[uas]
    limits, torque = vehicle.limits, vehicle.torque_max_Nm
    rate, yaw_rate = limits.rate_max_radps, limits.yaw_rate_max_radps
    inputs = np.abs(u[:, [S.LIFT, S.TAU_X, S.TAU_Y, S.TAU_Z]]).sum(axis=0)
    states = np.abs(x[1:, [S.WX, S.WY, S.WZ, S.PSI]]).sum(axis=0)
    cost = inputs @ np.array([w.lift / limits.lift_max_N, *(w.torque / t for t in torque[:3])])
    cost += states @ np.array([w.rate / rate, w.rate / rate, w.rate / yaw_rate, 0.0])
    cost += states[-1] * w.yaw / limits.yaw_max_rad
    cost += float(np.abs(x[1:, S.VZ]).sum()) * w.climb / limits.v_down_max_mps
    hovering = problem.models[uas].E[S.DOD]
    in_any_case = x[0, S.DOD] + hovering * np.arange(1, len(x))
    return float(cost + w.energy / hovering * (x[1:, S.DOD] - in_any_case).sum())
