"""Corner cutting: nothing is jumped over between samples."""

from __future__ import annotations

from itertools import chain

from uas_coverage_baselines.milp_mpc.model.blocks.separation import (
    from_each_other,
    from_moving_obstacles,
    from_obstacles,
)
from uas_coverage_baselines.milp_mpc.model.milp import Milp
from uas_coverage_baselines.milp_mpc.model.problem import PlanningProblem, Variables


class CornerCutting:
    """b(n) + b(n+1) <= 2 c(n), sum of c(n) <= N_f - 1: one face stays active (Sec. III-C.4).

    A face that separates at both ends of a step separates along the straight segment between
    them. The paper asks this of fixed obstacles; moving obstacles and pairs of UAS can be jumped
    over just as well, so they get the same rows (docs/deviations.md), unless the problem says
    otherwise (`corners_of_all`). c is `crossed`.

    Two exact reductions: the sum row is written as b(n) <= c(n) and b(n+1) <= c(n), which says
    the same of whole numbers and cuts off fractions; and b need not be whole where c is, because
    c_h(n) = 0 for one face h forces b_h to 0 at both ends, which is all that b is asked for.

    | symbol | meaning | attribute |
    | --- | --- | --- |
    | b_O(n) | 1: face h does not separate at sample n | columns `OBSTACLE.relaxed` |
    | c_O(n) | 1: face h does not separate at both ends | columns `OBSTACLE.crossed` |
    | N_FO | what has these rows | all, or fixed ones: `problem.corners_of_all` |
    """

    def add_to(self, milp: Milp, v: Variables, problem: PlanningProblem) -> None:
        """Add columns and rows over every interval whose separation is not certain."""
        for separation in chain(
            from_obstacles(problem), from_moving_obstacles(problem), from_each_other(problem)
        ):
            separation.add_same_face(milp)
