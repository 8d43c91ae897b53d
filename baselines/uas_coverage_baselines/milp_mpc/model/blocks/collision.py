"""Collision avoidance between UAS (OCP_3, collision part)."""

from __future__ import annotations

from uas_coverage_baselines.milp_mpc.model.blocks.separation import from_each_other
from uas_coverage_baselines.milp_mpc.model.milp import Milp
from uas_coverage_baselines.milp_mpc.model.problem import PlanningProblem, Variables


class Collision:
    """|p_i(n) - p_j(n)| >= delta_C,min for every pair (Sec. III-C.2), as a closed cylinder.

    Via eq. (const_Vec_lb): far enough horizontally beyond one of H_O faces, or vertically.

    | symbol | meaning | attribute |
    | --- | --- | --- |
    | delta_C,min | smallest distance of a pair | `problem.separation_m` (U, U) |
    | b_h(n) | 1: face h does not separate the pair | columns `collision.relaxed` |
    | H_O | sides of the closed cylinder | `problem.obstacle_sides` |
    """

    def add_to(self, milp: Milp, v: Variables, problem: PlanningProblem) -> None:
        """Add columns and rows for every pair that can meet."""
        for separation in from_each_other(problem):
            separation.add_outside(milp, v)
