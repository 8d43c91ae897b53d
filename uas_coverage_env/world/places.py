"""Where a UAS may be: inside the fence, and as far from the fixed obstacles as commands keep."""

from uas_coverage_env.compiled.kernels import inlined_kernel, kernel
from uas_coverage_env.geometry.segments import signed_distance
from uas_coverage_env.world.routes import CREEP_M, box_apart

_ROUTES_INSIDE_M = 0.5
"""Routes that set out from a given place keep so much more of the fence than is a breach, at scale
1 [m]."""


@inlined_kernel
def inside_fence_m(arena, x, y, z):
    """How far inside the geofence a place is; negative outside [m]."""
    first, last = arena.rules[0].fence_first, arena.rules[0].fence_last
    return -signed_distance(arena.normals, arena.offsets_m, first, last, x, y, z)


@inlined_kernel
def _from_obstacle_m(arena, obstacle, x, y, z):
    """Distance of a place from what commands keep clear of of an obstacle [m]."""
    first, last = obstacle.first_kept, obstacle.last_kept
    return signed_distance(arena.normals, arena.offsets_m, first, last, x, y, z)


@kernel
def may_be_at(arena, i, x, y, z, start_m=None):
    """Whether UAS i keeps clear of fence and fixed obstacles at a place.

    Without a start, of what counts as a breach. With one, the place (north, east, down) [m] from
    which a route sets out: as far as routes keep, or no nearer than the start is.
    """
    rules = arena.rules[0]
    inside_m = rules.fence_margin_m
    if start_m is not None:
        start_inside_m = inside_fence_m(arena, start_m[0], start_m[1], start_m[2])
        inside_m = min(inside_m + rules.length_scale * _ROUTES_INSIDE_M, start_inside_m)
    if inside_fence_m(arena, x, y, z) < inside_m:
        return False
    for o in range(arena.obstacles.shape[0]):
        obstacle = arena.obstacles[o]
        if box_apart(obstacle, x, y, z, x, y, z):
            continue
        kept_m = arena.uas[i].radius_m + obstacle.safe_distance_m
        if start_m is not None:
            now_m = _from_obstacle_m(arena, obstacle, start_m[0], start_m[1], start_m[2])
            kept_m = min(obstacle.wall_m, now_m - CREEP_M)
        if _from_obstacle_m(arena, obstacle, x, y, z) < kept_m:
            return False
    return True
