"""Obstacle avoidance (OCP_6)."""

from __future__ import annotations

from uas_coverage_baselines.milp_mpc.model.blocks.separation import from_obstacles
from uas_coverage_baselines.milp_mpc.model.milp import Milp
from uas_coverage_baselines.milp_mpc.model.problem import PlanningProblem, Variables


class Obstacles:
    """D_O(p(n)) >= delta_O,min: outside every fixed hull (Sec. III-C.4, eq. (OCP_6)).

    Via eq. (const_CS_out); the paper's b_O is `relaxed`, 1 where a face does not separate.

    | symbol | meaning | attribute |
    | --- | --- | --- |
    | O | fixed obstacles, convex hulls | `problem.obstacles` |
    | delta_O,min | smallest distance of a UAS | `problem.obstacle_clearance_m` (U, O) |
    | b_O(n) | 1: face h does not separate UAS and obstacle | columns `OBSTACLE.relaxed` |
    """

    def add_to(self, milp: Milp, v: Variables, problem: PlanningProblem) -> None:
        """Add columns and rows for every obstacle that can be reached."""
        for separation in from_obstacles(problem):
            separation.add_outside(milp, v)
