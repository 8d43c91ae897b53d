"""The geometry of a plan, checked once more before it is flown.

The solver's rows say the same through binaries and big M; here the plan's positions are measured
against hulls, cylinders and fence directly, with the geometry that the world judges with.
"""

from __future__ import annotations

from itertools import chain, combinations, pairwise

import numpy as np
from numpy.typing import NDArray

from uas_coverage_baselines.milp_mpc.model.height import too_low_m
from uas_coverage_baselines.milp_mpc.model.problem import Plan, PlanningProblem
from uas_coverage_env.geometry.round_shapes import closed_cylinder_faces
from uas_coverage_env.geometry.segments import cylinder_clearance, segment_clearance

FloatArray = NDArray[np.float64]
_TOLERANCE_M = 1e-4
_START_M = 1e-3  # the plan must begin where the UAS is


def first_trouble(problem: PlanningProblem, plan: Plan) -> str | None:
    """Why the plan must not be flown, None where nothing is wrong.

    The distance at the first sample is given, not planned: a UAS that is too close there may
    leave, but comes no closer on its way to the second sample.
    """
    if not np.isfinite(plan.x).all() or not np.isfinite(plan.u).all():
        return "the plan is not finite"
    missing = [name for name in problem.names if name not in plan.names]
    if missing:
        return f"no plan for {missing[0]}"
    paths = [plan.x[plan.of(name), :, 0:3] for name in problem.names]
    troubles = (_trouble_alone(problem, row, path) for row, path in enumerate(paths))
    pairs = (
        trouble_between(problem, i, j, paths[i], paths[j])
        for i, j in combinations(range(problem.n_uas), 2)
    )
    return next((trouble for trouble in chain(troubles, pairs) if trouble is not None), None)


def _trouble_alone(problem: PlanningProblem, row: int, path: FloatArray) -> str | None:
    """Where a UAS begins, the fence, the least height, the obstacles and what moves."""
    name = problem.names[row]
    if np.abs(path[0] - problem.x0[row, :3]).max() > _START_M:
        return f"{name} is not where its plan begins"
    outside = (problem.fence.face_distances(path) + problem.fence_margin_m)[1:].max()
    if outside > _TOLERANCE_M:
        return f"{name} leaves the fence's margin by {outside:.3g} m"
    if problem.min_height_m and (low := too_low_m(problem, row, path).max()) > _TOLERANCE_M:
        return f"{name} is {low:.3g} m below the least height"
    clearances = problem.obstacle_clearance_m[row] - _TOLERANCE_M
    # an obstacle one of whose faces separates the whole path needs no look at the segments
    near = np.flatnonzero(problem.hulls.apart_m(path) < clearances)
    for o in near:
        obstacle, hull = problem.obstacles[o]
        at_start = float(hull.signed_distance(path[0])) - _TOLERANCE_M
        for step, (p, q) in enumerate(pairwise(path)):
            d = segment_clearance(hull.normals, hull.offsets_m, 0, hull.n_faces, *p, *q)
            if d < (clearances[o] if step else min(clearances[o], at_start)):
                return f"{name} comes within {d:.3g} m of {obstacle}"
    for m, moving in enumerate(problem.moving):
        relative = path - moving.position_m[: len(path)]
        clearance = problem.moving_clearance_m[row, m] - _TOLERANCE_M
        d = _too_close(problem, relative, clearance, moving.radius_m, moving.half_height_m)
        if d is not None:
            return f"{name} comes within {d:.3g} m of {moving.name}"
    return None


def trouble_between(
    problem: PlanningProblem, i: int, j: int, path_i: FloatArray, path_j: FloatArray
) -> str | None:
    """How two UAS come too close on their paths (n+1, 3), None where they do not."""
    d = _too_close(problem, path_i - path_j, problem.separation_m[i, j] - _TOLERANCE_M, 0.0, 0.0)
    if d is None:
        return None
    return f"{problem.names[i]} and {problem.names[j]} come within {d:.3g} m"


def _too_close(
    problem: PlanningProblem,
    relative: FloatArray,
    clearance_m: float,
    radius_m: float,
    half_height_m: float,
) -> float | None:
    """The first clearance of a closed cylinder that is too small, along a path relative to it."""
    # the rows measure round shapes by these faces, so at the start they are what counts
    faces = closed_cylinder_faces(problem.obstacle_sides)
    size = np.full(len(faces), radius_m)
    size[-2:] = half_height_m
    beyond = relative @ faces.T - size
    if beyond.min(axis=0).max() >= clearance_m:
        return None  # one face separates the whole path
    at_start = float(beyond[0].max()) - _TOLERANCE_M
    for step, (p, q) in enumerate(pairwise(relative)):
        d = cylinder_clearance(radius_m, half_height_m, *p, *q)
        if d < (clearance_m if step else min(clearance_m, at_start)):
            return d
    return None
