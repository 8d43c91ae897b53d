"""Plans that need no solver: what a UAS flies when no program gives it a plan.

One UAS without a plan must not ground the others: it follows the rest of its backup trajectory, or
brakes where it is, and the team is verified with that.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from uas_coverage_baselines.braking import brake
from uas_coverage_baselines.milp_mpc.model.appraisal import Appraisal
from uas_coverage_baselines.milp_mpc.model.ocp import OCP, Block
from uas_coverage_baselines.milp_mpc.model.problem import Plan, PlanningProblem
from uas_coverage_env.vehicle import compile_vehicle

FloatArray = NDArray[np.float64]


def fallback_plans(
    problem: PlanningProblem,
    uas: int,
    backup: Plan | None,
    dt_s: float,
    blocks: Sequence[Block] = OCP,
) -> list[Plan]:
    """Plans of one UAS alone: the rest of its backup trajectory, then braking at once.

    Args:
        problem: the decision.
        uas: row of the UAS.
        backup: what is left of the last backup trajectory, beginning now; None where there is none.
        dt_s: sampling time.
        blocks: of the OCP, by which they are priced.
    """
    appraisal = Appraisal(problem.only(uas), blocks)
    name, N = problem.names[uas], problem.horizon
    record = compile_vehicle(problem.vehicles[uas], dt_s)[()]
    states, inputs = brake(record, problem.x0[uas], N)
    nothing = np.zeros((N, problem.n_scenario_waypoints), bool)
    plans = [_plan(appraisal, name, np.vstack([problem.x0[uas], states]), inputs, nothing)]
    if backup is not None and name in backup.names:
        row = backup.of(name)
        x, u, covers = backup.x[row, : N + 1], backup.u[row, :N], backup.covers[row, :N]
        states, inputs = brake(record, x[-1], N - len(u))
        x, u = np.vstack([x, states]), np.vstack([u, inputs])
        covers = np.vstack([covers, nothing[: N - len(covers)]])
        plans.insert(0, _plan(appraisal, name, x, u, covers))
    return plans


def _plan(
    appraisal: Appraisal, name: str, x: FloatArray, u: FloatArray, covers: NDArray[np.bool_]
) -> Plan:
    plan = Plan((name,), x[None], u[None], covers[None], 0.0, -np.inf)
    return replace(plan, objective=appraisal.objective(plan))
