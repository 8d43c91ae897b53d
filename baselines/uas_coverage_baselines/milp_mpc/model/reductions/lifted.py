"""Window-lifted box rows: a visit one sample earlier or later keeps the UAS near, too.

If w is visited at m, then f · p(n) <= t_w + D(n - m, f) for m < n, and <= t_w + D(m - n, -f) for
m > n, D being the largest displacement (`Reach.displacement`). For waypoints no two of which can be
visited within the samples n-1, n, n+1 (cliques from travel times) and each of which is visited once
(`FirstVisit`), at most one of the b_w(m), m in {n-1, n, n+1}, is 1, so that

    f · p(n) <= S - sum_w sum_m (S - t_w - D)⁺ b_w(m)

holds for every flight with its visits. The terms with m = n are those of `AggregatedBoxes`, so the
row implies its rows: the same whole-number points from a tighter relaxation. Between the faces of a
box (diagonals) such rows hold as well; they are implied for whole numbers, not for fractions.
"""

from __future__ import annotations

import numpy as np

from uas_coverage_baselines.milp_mpc.model.milp import ABSENT, Milp
from uas_coverage_baselines.milp_mpc.model.problem import PlanningProblem, Variables
from uas_coverage_baselines.milp_mpc.model.reductions.travel import (
    exclusive,
    partition,
    steps_between,
    support_of_waypoints,
)
from uas_coverage_env.geometry import cylinder_faces

_WINDOW = 3


class LiftedBoxes:
    """Where a visit counts and what it says of the samples around it, for `AggregatedBoxes`."""

    def add_to(self, milp: Milp, v: Variables, problem: PlanningProblem) -> None:
        """Add rows for groups of waypoints at n = 0..N, along faces and diagonals."""
        directions, support = _directions(problem)
        limit = problem.waypoints_m @ directions.T + support  # (W, F)
        ahead = problem.reach.displacement(directions)[:, 1]
        back = problem.reach.displacement(-directions)[:, 1]
        steps = steps_between(problem)
        none = np.full((1, problem.n_waypoints), ABSENT)
        for uas, name in enumerate(problem.names):
            groups = partition(exclusive(steps[uas], _WINDOW))
            reach = problem.reach.support(directions)[uas]  # (N+1, F)
            beyond = reach[..., None] - limit.T  # (N+1, F, W)
            lifts = [beyond, beyond - ahead[uas][:, None], beyond - back[uas][:, None]]
            now = np.vstack([v.covers[uas], none])
            before, after = np.vstack([none, now[:-1]]), np.vstack([now[1:], none])
            coefficients = np.maximum(np.concatenate(lifts, axis=-1), 0.0)
            visits = np.hstack([now, before, after])
            visits = np.where(np.tile(groups, 3)[:, None, :], visits, ABSENT)[:, :, None, :]
            milp.subject_to(
                f"coverage.inside_any.{name}",
                (directions, v.position[uas, :, None, :]),
                (coefficients, visits),
                upper=reach,
                where=np.any((visits >= 0) & (coefficients > 0.0), axis=-1),
            )


def _directions(problem: PlanningProblem):
    """Faces of a waypoint's polyhedron; of a box the four horizontal diagonals, too."""
    faces = problem.waypoint_faces
    known, support = support_of_waypoints(problem)
    if problem.waypoint_sides > 4:
        return known, support
    diagonal = cylinder_faces(8)
    diagonal = diagonal[np.abs(diagonal).max(axis=1) < 1.0 - 1e-9]
    reach = problem.waypoint_reach_m[:, None]
    directions = np.vstack([faces, diagonal])
    return directions, reach * np.abs(directions).sum(axis=1)
