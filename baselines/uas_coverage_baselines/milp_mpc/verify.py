"""The geometry of a plan, checked once more before it is flown.

The solver's rows say the same through binaries and big M; here the plan's positions are measured
against hulls, cylinders and fence directly, with the geometry that the world judges with.
"""

from __future__ import annotations

from itertools import combinations, pairwise

import numpy as np

from uas_coverage_baselines.milp_mpc.problem import Plan, PlanningProblem
from uas_coverage_env.geometry import closed_cylinder_faces, cylinder_clearance, segment_clearance

_TOLERANCE_M = 1e-4
_START_M = 1e-3  # the plan must begin where the UAS is


def first_trouble(problem: PlanningProblem, plan: Plan) -> str | None:
    """Why the plan must not be flown, None where nothing is wrong.

    The distance at the first sample is given, not planned: a UAS that is too close there may
    leave, but comes no closer on its way to the second sample.
    """
    if not np.isfinite(plan.x).all() or not np.isfinite(plan.u).all():
        return "the plan is not finite"
    # the rows measure round shapes by these faces, so at the start they are what counts
    faces = closed_cylinder_faces(problem.obstacle_sides)
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
            at_start = float(hull.signed_distance(path[0])) - _TOLERANCE_M
            for step, (p, q) in enumerate(pairwise(path)):
                d = segment_clearance(hull.normals, hull.offsets_m, 0, hull.n_faces, *p, *q)
                if d < (clearance if step else min(clearance, at_start)):
                    return f"{name} comes within {d:.3g} m of {obstacle}"
        for m, moving in enumerate(problem.moving):
            clearance = problem.moving_clearance_m[row, m] - _TOLERANCE_M
            relative = path - moving.position_m[: len(path)]
            size = np.full(len(faces), moving.radius_m)
            size[-2:] = moving.half_height_m
            at_start = float((faces @ relative[0] - size).max()) - _TOLERANCE_M
            for step, (p, q) in enumerate(pairwise(relative)):
                d = cylinder_clearance(moving.radius_m, moving.half_height_m, *p, *q)
                if d < (clearance if step else min(clearance, at_start)):
                    return f"{name} comes within {d:.3g} m of {moving.name}"
    for i, j in combinations(range(problem.n_uas), 2):
        first, second = (plan.x[plan.of(problem.names[k]), :, 0:3] for k in (i, j))
        relative = first - second
        clearance = problem.separation_m[i, j] - _TOLERANCE_M
        at_start = float((faces @ relative[0]).max()) - _TOLERANCE_M
        for step, (p, q) in enumerate(pairwise(relative)):
            d = cylinder_clearance(0.0, 0.0, *p, *q)
            if d < (clearance if step else min(clearance, at_start)):
                return f"{problem.names[i]} and {problem.names[j]} come within {d:.3g} m"
    return None
