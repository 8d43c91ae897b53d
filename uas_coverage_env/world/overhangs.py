"""What a UAS can be below: obstacles that are wider above than where it flies."""

import math

import numpy as np

from uas_coverage_env.compiled.kernels import kernel
from uas_coverage_env.geometry import ConvexPolytope
from uas_coverage_env.world.routes import level_apart, obstructs

_ROOM_BELOW_M = 0.5
_UPRIGHT = 1e-6
_ON_FACE_M = 1e-3
_ABOVE_ROOF_M = 0.1


def overhangs(hull: ConvexPolytope, ground_m: float, scale: float) -> bool:
    """Whether a face looks down from more than half a metre above the lowest altitude, at scale 1.

    Args:
        hull: The hull of an obstacle.
        ground_m: The lowest altitude [m].
        scale: Of lengths, see `vehicle.scale`.
    """
    looks_down = hull.normals[:, 2] > _UPRIGHT
    on_face = np.abs(hull.face_distances(hull.vertices_m)[:, looks_down]) < _ON_FACE_M
    altitudes_m = np.where(on_face, -hull.vertices_m[:, 2:], -math.inf)
    return bool((altitudes_m > ground_m + scale * _ROOM_BELOW_M).any())


@kernel
def _hangs_over(arena, obstacle, x, y, z):
    """Whether the way straight up from a place to the roof of an obstacle meets the obstacle."""
    if not obstacle.overhangs or level_apart(obstacle, x, y, x, y) or -z >= obstacle.roof_m:
        return False
    up_m = -obstacle.roof_m - _ABOVE_ROOF_M
    return obstructs(obstacle, arena.normals, arena.offsets_m, x, y, z, x, y, up_m)


@kernel
def is_below_overhang(arena, x, y, z):
    """Whether a UAS at a place cannot climb over some obstacle, as that is above it itself."""
    if arena.rules[0].overhangs:
        for o in range(arena.obstacles.shape[0]):
            if _hangs_over(arena, arena.obstacles[o], x, y, z):
                return True
    return False


@kernel
def widest_overhang_m(arena, x, y, z):
    """Of what is above a place: (the larger side of its box, and its roof above the place) [m]."""
    across_m, climb_m = 0.0, 0.0
    for o in range(arena.obstacles.shape[0]):
        obstacle = arena.obstacles[o]
        if _hangs_over(arena, obstacle, x, y, z):
            half_m = obstacle.hull_half_m
            across_m = max(across_m, 2.0 * (max(half_m[0], half_m[1]) + obstacle.wall_m))
            climb_m = max(climb_m, obstacle.roof_m + z)
    return across_m, max(climb_m, 0.0)
