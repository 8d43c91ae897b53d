"""Moving obstacles (OCP_6, the moving part)."""

from __future__ import annotations

from uas_coverage_baselines.milp_mpc.model.blocks.separation import from_moving_obstacles
from uas_coverage_baselines.milp_mpc.model.milp import Milp
from uas_coverage_baselines.milp_mpc.model.problem import PlanningProblem, Variables


class MovingObstacles:
    """Outside the closed cylinder predicted by p_o(n+1) = p_o(n) + v_o dt (Sec. III-C.4).

    Via eq. (const_Vec_lb) with an H_O-sided cylinder: the polygon's faces touch the circle, so
    beyond one of them is beyond the circle.

    | symbol | meaning | attribute |
    | --- | --- | --- |
    | p_o(n) | predicted centre | `problem.moving`: `position_m` (N+1, 3) |
    | delta_O,min | smallest distance of a UAS | `problem.moving_clearance_m` (U, M) |
    | b_O(n) | 1: face h does not separate UAS and obstacle | columns `OBSTACLE.relaxed` |
    | H_O | sides of the closed cylinder | `problem.obstacle_sides` |
    """

    def add_to(self, milp: Milp, v: Variables, problem: PlanningProblem) -> None:
        """Add columns and rows for every moving obstacle that can be reached."""
        for separation in from_moving_obstacles(problem):
            separation.add_outside(milp, v)
