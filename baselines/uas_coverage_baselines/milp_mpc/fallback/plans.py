"""Plans that need no solver: what a UAS flies when no program gives it a plan.

One UAS without a plan must not ground the others: it follows the rest of its backup trajectory, or
brakes where it is, and the team is verified with that.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from uas_coverage_baselines.milp_mpc.fallback.backup import course_of
from uas_coverage_baselines.milp_mpc.model.appraisal import Appraisal
from uas_coverage_baselines.milp_mpc.model.ocp import OCP, Block
from uas_coverage_baselines.milp_mpc.model.problem import Plan, PlanningProblem
from uas_coverage_env.planning.backup.course import Course, braked
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
    here = Course(0, problem.x0[uas, None], np.zeros((0, 5)), False)
    nothing = np.zeros((N, problem.n_scenario_waypoints), bool)
    plans = [_plan(appraisal, name, braked(record, here, 0, N), nothing)]
    if backup is not None and name in backup.names:
        left, covers = course_of(backup, name), backup.covers[backup.of(name), :N]
        followed = min(len(left.u), N)
        covers = np.vstack([covers, nothing[followed:]])
        plans.insert(
            0, _plan(appraisal, name, braked(record, left, followed, N - followed), covers)
        )
    return plans


def _plan(appraisal: Appraisal, name: str, course: Course, covers: NDArray[np.bool_]) -> Plan:
    plan = Plan((name,), course.x[None], course.u[None], covers[None], 0.0, -np.inf)
    return replace(plan, objective=appraisal.objective(plan))
