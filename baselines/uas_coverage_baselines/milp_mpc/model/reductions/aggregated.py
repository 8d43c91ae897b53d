"""Aggregated coverage rows: one per UAS, step and direction over many waypoints.

For a set of waypoints no two of which can be visited at the same sample (disjoint boxes, found by
`travel`), with S the reachable set's support and t_w the waypoint's, the rows

    f · p(n) <= S - (S - t_w)⁺ b_w(n)   for each w      (one row per waypoint, `coverage.inside`)
    f · p(n) <= S - sum_w (S - t_w)⁺ b_w(n)             (this one)

have the same whole-number points. If at most one b_w is 1 they read alike. If two were 1, either
form would put p(n) into both boxes (f · p <= t_v - (S - t_w)⁺ <= t_v in every direction), which are
disjoint: neither has such a point. For fractions the aggregated row implies each of the others.
"""

from __future__ import annotations

import numpy as np

from uas_coverage_baselines.milp_mpc.model.milp import ABSENT, Milp
from uas_coverage_baselines.milp_mpc.model.problem import PlanningProblem, Variables
from uas_coverage_baselines.milp_mpc.model.reductions.travel import (
    exclusive,
    partition,
    steps_between,
)


class AggregatedBoxes:
    """Where a visit counts, in place of `VisitBoxes`."""

    def add_to(self, milp: Milp, v: Variables, problem: PlanningProblem) -> None:
        """Add rows for groups of waypoints, of which there is one unless boxes overlap."""
        faces = problem.waypoint_faces
        limit = problem.waypoints_m @ faces.T + problem.waypoint_reach_m[:, None]  # (W, F)
        steps = steps_between(problem)
        for uas, name in enumerate(problem.names):
            groups = partition(exclusive(steps[uas], 1))
            reach = problem.reach.support(faces)[uas, :-1]  # (N, F)
            beyond = np.maximum(reach[..., None] - limit.T, 0.0)  # (N, F, W)
            visits = np.where(groups[:, None, :], v.covers[uas], ABSENT)[:, :, None, :]
            milp.subject_to(
                f"coverage.inside_any.{name}",
                (faces, v.position[uas, :-1, None, :]),
                (beyond, visits),
                upper=reach,
                where=np.any((visits >= 0) & (beyond > 0.0), axis=-1),
            )
