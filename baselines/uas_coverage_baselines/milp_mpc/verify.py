"""The geometry of a plan, checked once more before it is flown.

The solver's rows say the same through binaries and big M; here the plan's positions are measured
against hulls, cylinders and fence directly, with the geometry that the world judges with.
"""

from __future__ import annotations

from itertools import combinations, pairwise

import numpy as np

from uas_coverage_baselines.milp_mpc.problem import Plan, PlanningProblem
from uas_coverage_env.geometry import cylinder_clearance, segment_clearance

_TOLERANCE_M = 1e-4
_START_M = 1e-3  # the plan must begin where the UAS is


def first_trouble(problem: PlanningProblem, plan: Plan) -> str | None:
    """Why the plan must not be flown, None where nothing is wrong.

    Distances at the first sample are given, not planned, and not judged; a UAS that is too close
    there may leave, so segments are judged from the second sample on and by the first one's end.
    """
    if not np.isfinite(plan.x).all() or not np.isfinite(plan.u).all():
        return "the plan is not finite"
    for row, name in enumerate(problem.names):
        if name not in plan.names:
            return f"no plan for {name}"
        path = plan.x[plan.of(name), :, 0:3]
        if np.abs(path[0] - problem.x0[row, :3]).max() > _START_M:
            return f"{name} is not where its plan begins"
        outside = (problem.fence.signed_distance(path[1:]) + problem.fence_margin_m).max()
        if outside > _TOLERANCE_M:
            return f"{name} leaves the fence's margin by {outside:.3g} m"
        for o, (obstacle, hull) in enumerate(problem.obstacles):
            clearance = problem.obstacle_clearance_m[row, o] - _TOLERANCE_M
            for p, q in pairwise(path[1:]):
                d = segment_clearance(hull.normals, hull.offsets_m, 0, hull.n_faces, *p, *q)
                if d < clearance:
                    return f"{name} comes within {d:.3g} m of {obstacle}"
        for m, moving in enumerate(problem.moving):
            clearance = problem.moving_clearance_m[row, m] - _TOLERANCE_M
            relative = path - moving.position_m[: len(path)]
            for p, q in pairwise(relative[1:]):
                d = cylinder_clearance(moving.radius_m, moving.half_height_m, *p, *q)
                if d < clearance:
                    return f"{name} comes within {d:.3g} m of {moving.name}"
    for i, j in combinations(range(problem.n_uas), 2):
        first, second = (plan.x[plan.of(problem.names[k]), :, 0:3] for k in (i, j))
        relative = first - second
        for p, q in pairwise(relative[1:]):
            d = cylinder_clearance(0.0, 0.0, *p, *q)
            if d < problem.separation_m[i, j] - _TOLERANCE_M:
                return f"{problem.names[i]} and {problem.names[j]} come within {d:.3g} m"
    return None
