"""What lies around a UAS: free ways to obstacles and fence, compiled."""

import math

from uas_coverage_env.env.layout import HEIGHT_M, N_RAYS, RAY_M
from uas_coverage_env.env.relative import within
from uas_coverage_env.kernels import inlined_kernel, kernel, room
from uas_coverage_env.vehicle import X, Y, Z

_BEYOND_M = RAY_M + 1e-6
"""A plane at this distance is out of reach of all rays, whatever is rounded [m]."""

_DIAGONAL = math.sqrt(0.5)
_RAYS = (
    (1.0, 0.0, 0.0),
    (_DIAGONAL, _DIAGONAL, 0.0),
    (0.0, 1.0, 0.0),
    (-_DIAGONAL, _DIAGONAL, 0.0),
    (-1.0, 0.0, 0.0),
    (-_DIAGONAL, -_DIAGONAL, 0.0),
    (0.0, -1.0, 0.0),
    (_DIAGONAL, -_DIAGONAL, 0.0),
    (0.0, 0.0, -1.0),
    (0.0, 0.0, 1.0),
)


@kernel
def _farthest_face(normals, offsets_m, first, last, x, y, z):
    """The face plane that a point is farthest out of, and how far [m]."""
    farthest = first
    largest = -math.inf
    for h in range(first, last):
        d = normals[h, 0] * x + normals[h, 1] * y + normals[h, 2] * z + offsets_m[h]
        if d > largest:
            largest = d
            farthest = h
    return farthest, largest


@kernel
def _ray_to_hull(normals, offsets_m, first, last, x, y, z, dx, dy, dz, free_m):
    """How far a ray goes before it enters a hull, at most free_m."""
    enters_m = 0.0
    leaves_m = free_m
    for h in range(first, last):
        d = normals[h, 0] * x + normals[h, 1] * y + normals[h, 2] * z + offsets_m[h]
        slope = normals[h, 0] * dx + normals[h, 1] * dy + normals[h, 2] * dz
        if d > 0.0:
            if slope >= 0.0:
                return free_m
            enters_m = max(enters_m, -d / slope)
        elif slope > 0.0:
            leaves_m = min(leaves_m, -d / slope)
        if enters_m >= leaves_m:
            return free_m
    return enters_m


@inlined_kernel
def _rays_to_fence(normals, offsets_m, first, last, x, y, z, row, k):
    """Write how far the rays go before they leave the fence; returns how far away that is."""
    free_m = room(N_RAYS)
    for ray in range(N_RAYS):
        free_m[ray] = RAY_M
    outermost = -math.inf
    for h in range(first, last):
        d = normals[h, 0] * x + normals[h, 1] * y + normals[h, 2] * z + offsets_m[h]
        outermost = max(outermost, d)
        if d < -_BEYOND_M:
            continue
        for ray in range(N_RAYS):
            dx, dy, dz = _RAYS[ray]
            slope = normals[h, 0] * dx + normals[h, 1] * dy + normals[h, 2] * dz
            if slope > 0.0:
                free_m[ray] = min(free_m[ray], max(0.0, -d / slope))
    for ray in range(N_RAYS):
        row[k + ray] = free_m[ray]
    return -outermost


@inlined_kernel
def _out_of_sight(obstacle, x, y, z):
    """Whether the obstacle is surely farther than rays and clearance reach."""
    # its box reaches near_m farther than the hull in every direction
    beyond_m = max(0.0, RAY_M - obstacle.near_m)
    lower = obstacle.lower_m
    upper = obstacle.upper_m
    return (
        x < lower[0] - beyond_m
        or x > upper[0] + beyond_m
        or y < lower[1] - beyond_m
        or y > upper[1] + beyond_m
        or z < lower[2] - beyond_m
        or z > upper[2] + beyond_m
    )


@inlined_kernel
def surroundings(arena, state, i, row, k):
    """Write what lies around UAS i: rays, nearest obstacle, fence; returns the next column."""
    normals = arena.normals
    offsets_m = arena.offsets_m
    rules = arena.rules[0]
    x = state.x[i, X]
    y = state.x[i, Y]
    z = state.x[i, Z]
    inside_m = _rays_to_fence(
        normals, offsets_m, rules.fence_first, rules.fence_last, x, y, z, row, k
    )
    clearance_m = HEIGHT_M
    for o in range(arena.obstacles.shape[0]):
        obstacle = arena.obstacles[o]
        if _out_of_sight(obstacle, x, y, z):
            continue
        first = obstacle.first_face
        last = obstacle.last_face
        face, away_m = _farthest_face(normals, offsets_m, first, last, x, y, z)
        clearance_m = min(clearance_m, away_m)
        if away_m > _BEYOND_M:
            continue
        for ray in range(N_RAYS):
            dx, dy, dz = _RAYS[ray]
            slope = normals[face, 0] * dx + normals[face, 1] * dy + normals[face, 2] * dz
            # most rays do not even reach the plane of this face
            if away_m <= -slope * row[k + ray]:
                row[k + ray] = _ray_to_hull(
                    normals, offsets_m, first, last, x, y, z, dx, dy, dz, row[k + ray]
                )
    for ray in range(k, k + N_RAYS):
        row[ray] = within(1.0 - row[ray] / RAY_M, 0.0, 1.0)
    k += N_RAYS
    row[k] = within(clearance_m / HEIGHT_M, -1.0, 1.0)
    row[k + 1] = within((inside_m - rules.fence_margin_m) / HEIGHT_M, -1.0, 1.0)
    return k + 2
