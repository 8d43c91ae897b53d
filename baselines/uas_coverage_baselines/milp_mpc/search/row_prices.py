"""Which rows hold a plan where it is, by name, and what each of them costs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from uas_coverage_baselines.milp_mpc.model.appraisal import visits
from uas_coverage_baselines.milp_mpc.model.ocp import OCP, Block
from uas_coverage_baselines.milp_mpc.model.problem import Plan, PlanningProblem
from uas_coverage_baselines.milp_mpc.model.reductions.formulations import FORMULATIONS
from uas_coverage_baselines.milp_mpc.search.restricted import RestrictedMilp
from uas_coverage_baselines.milp_mpc.solvers import SolverLimits
from uas_coverage_baselines.milp_mpc.solvers.highs import solve

_EXACTLY = SolverLimits(relative_gap=1e-6, absolute_gap=1e-6)
_NOTHING = 1e-7


def row_prices(
    problem: PlanningProblem, plan: Plan, blocks: Sequence[Block] = OCP
) -> Mapping[str, float]:
    """The rows that bind, by name, with their duals: what a unit of room would take off J.

    The program is the OCP as the blocks write it, with the plan's visits and sides of obstacles,
    and other whole columns at their best, so that it is a linear one.

    Args:
        problem: the decision.
        plan: for it.
        blocks: of the OCP.

    Returns:
        Name of an inequality -> its dual, never 0, largest first; empty where the program has no
        solution.
    """
    program = RestrictedMilp(problem, blocks, formulation=FORMULATIONS["corner"])
    built = program.built
    lower, upper = built.lower.copy(), built.upper.copy()
    columns, values = program.start(plan.x[:, :, :3], visits(problem, plan))
    lower[columns] = upper[columns] = values
    best = solve(built, _EXACTLY, lower=lower, upper=upper).values
    if best is None:
        return {}
    lower[built.integer] = upper[built.integer] = best[built.integer]
    duals = solve(built, _EXACTLY, lower=lower, upper=upper).duals
    if duals is None:
        return {}
    duals = np.where(built.row_lower < built.row_upper, duals, 0.0)
    names = program.row_names()
    order = np.argsort(-np.abs(duals), kind="stable")
    return {names[row]: float(duals[row]) for row in order if abs(duals[row]) > _NOTHING}
