"""Plans that need no solver: what a UAS flies when no program gives it a plan.

One UAS without a plan must not ground the others: it follows the rest of its way out, or brakes
where it is, and the team is verified with that.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from uas_coverage_baselines.milp_mpc.appraisal import Appraisal, gains, visits
from uas_coverage_baselines.milp_mpc.braking import brake
from uas_coverage_baselines.milp_mpc.construction import Flight
from uas_coverage_baselines.milp_mpc.ocp import OCP, Block
from uas_coverage_baselines.milp_mpc.problem import NEVER, Plan, PlanningProblem, Trajectories
from uas_coverage_env.vehicle import compile_vehicle

FloatArray = NDArray[np.float64]


def standby_plans(
    problem: PlanningProblem,
    uas: int,
    out: Plan | None,
    dt_s: float,
    blocks: Sequence[Block] = OCP,
) -> list[Plan]:
    """Plans of one UAS alone: the rest of its way out, then braking at once.

    Args:
        problem: the decision.
        uas: row of the UAS.
        out: what is left of the last way out, beginning now; None where there is none.
        dt_s: sampling time.
        blocks: of the OCP, by which they are priced.
    """
    appraisal = Appraisal(problem.only(uas), blocks)
    name, N = problem.names[uas], problem.horizon
    record = compile_vehicle(problem.vehicles[uas], dt_s)[()]
    states, inputs = brake(record, problem.x0[uas], N)
    nothing = np.zeros((N, problem.n_scenario_waypoints), bool)
    plans = [_plan(appraisal, name, np.vstack([problem.x0[uas], states]), inputs, nothing)]
    if out is not None and name in out.names:
        row = out.of(name)
        x, u, covers = out.x[row, : N + 1], out.u[row, :N], out.covers[row, :N]
        states, inputs = brake(record, x[-1], N - len(u))
        x, u = np.vstack([x, states]), np.vstack([u, inputs])
        covers = np.vstack([covers, nothing[: N - len(covers)]])
        plans.insert(0, _plan(appraisal, name, x, u, covers))
    return plans


def as_flight(problem: PlanningProblem, uas: int, plan: Plan) -> Flight:
    """A UAS's own plan as a flight: what it covers when, and what it costs besides."""
    visit = visits(problem, plan)[0]
    gained = float(gains(problem, visit).sum())
    return Flight(plan.x[0, :, 0:3], visit, plan.objective + gained, 0.0)


def left_over_flights(
    problem: PlanningProblem, left: Plan, dt_s: float, blocks: Sequence[Block] = OCP
) -> list[Flight]:
    """What is left of the previous plan as flights; beyond its end at falling velocity."""
    appraisal, result = Appraisal(problem, blocks), []
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
        cost = float(appraisal.costs(row, Trajectories(path[None], visit[None]))[0])
        (price,) = appraisal.prices_of_paths(row, [(path, visit)])
        result.append(Flight(path, visit, cost + price.cost, price.excess))
    return result


def _plan(
    appraisal: Appraisal, name: str, x: FloatArray, u: FloatArray, covers: NDArray[np.bool_]
) -> Plan:
    plan = Plan((name,), x[None], u[None], covers[None], 0.0, -np.inf)
    return replace(plan, objective=appraisal.objective(plan))
