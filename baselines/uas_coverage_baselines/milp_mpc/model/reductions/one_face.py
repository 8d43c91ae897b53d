"""One binary per shape, interval and face: c alone, without b.

The OCP has, for a face h and the samples at both ends of an interval,

    d_h(n) >= delta - M b_h(n),   b_h(n) <= c_h(n - 1),   b_h(n) <= c_h(n),   sum_h c_h(n) <= F - 1.

b_h(n) occurs in no cost and otherwise only in sum_h b_h(n) <= F - 1, which follows from b <= c.
M >= 0, so the largest b_h(n) that is allowed is the best one: b_h(n) = min(c_h(n - 1), c_h(n)).
Put in (Fourier-Motzkin elimination of b), the rows are

    d_h(n) >= delta - M c_h(n - 1)   and   d_h(n) >= delta - M c_h(n):

the same feasible flights, for fractions of c as well, with fewer columns and rows.
"""

from __future__ import annotations

from itertools import chain

from uas_coverage_baselines.milp_mpc.model.blocks.separation import (
    from_each_other,
    from_moving_obstacles,
    from_obstacles,
)
from uas_coverage_baselines.milp_mpc.model.milp import Milp
from uas_coverage_baselines.milp_mpc.model.problem import PlanningProblem, Variables


class OneFacePerInterval:
    """In place of `Collision`, `Obstacles`, `MovingObstacles` and `CornerCutting` together."""

    def add_to(self, milp: Milp, v: Variables, problem: PlanningProblem) -> None:
        """Add columns and rows over every interval whose separation is not certain."""
        for separation in chain(
            from_obstacles(problem), from_moving_obstacles(problem), from_each_other(problem)
        ):
            separation.add_one_face(milp, v)
