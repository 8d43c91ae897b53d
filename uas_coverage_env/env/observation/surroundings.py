"""What lies around a UAS: free ways to obstacles and fence."""

import math

from uas_coverage_env.compiled.kernels import inlined_kernel, kernel, stack_array
from uas_coverage_env.compiled.views import rows_view, slice_view
from uas_coverage_env.env.observation.block import Feature, Group, ObservationBlock
from uas_coverage_env.env.observation.relative import within
from uas_coverage_env.env.observation.scales import HEIGHT_M, N_RAYS, RAY_M
from uas_coverage_env.geometry.segments import signed_distance
from uas_coverage_env.vehicle import layout as S
from uas_coverage_env.world.broad_phase import (
    BLOCK,
    HULL_HALF,
    HULL_MIDDLE,
    MIDDLE,
    PER_HALF,
    halves_away,
)

_FEATURES = (
    Feature(
        "rays",
        N_RAYS,
        0,
        1,
        "1 - free way / 80 m to obstacle or fence: N, NE, …, NW, up, down",
    ),
    Feature("clearance", 1, -1, 1, "clearance from the nearest fixed obstacle / 20 m"),
    Feature("fence", 1, -1, 1, "distance to the fence beyond its margin / 20 m"),
)

_AT = Group("surroundings", 1, _FEATURES).columns

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

_WITHIN_BOX = 1.000001
"""So many times as far from the middle of a box as its walls: inside, whatever is rounded."""

_N, _NE, _E, _SE, _S, _SW, _W, _NW, _UP, _DOWN = range(N_RAYS)


@kernel
def _ray_to_hull(normals, offsets_m, first, last, x, y, z, dx, dy, dz, free_m):
    """How far a ray goes before it enters a hull, at most free_m."""
    faces = rows_view(normals, first, (last - first, 3))
    away_m = rows_view(offsets_m, first, last - first)
    enters_m = 0.0
    leaves_m = free_m
    misses = False
    for h in range(away_m.shape[0]):
        # selections rather than branches: every face is another case
        d = faces[h, 0] * x + faces[h, 1] * y + faces[h, 2] * z + away_m[h]
        slope = faces[h, 0] * dx + faces[h, 1] * dy + faces[h, 2] * dz
        at_m = -d / slope
        outside = d > 0.0
        misses |= outside & (slope >= 0.0)
        enters_m = max(enters_m, at_m if outside & (slope < 0.0) else 0.0)
        leaves_m = min(leaves_m, at_m if (not outside) & (slope > 0.0) else free_m)
    return free_m if misses | (enters_m >= leaves_m) else enters_m


@kernel
def free_way(arena, x, y, z, dx, dy, dz, free_m):
    """How far a ray in any direction is free of fixed obstacles and fence, at most free_m [m].

    Args:
        arena: The arena.
        x: North of its origin [m].
        y: East of it [m].
        z: Down of it [m].
        dx: Unit vector of its direction, north.
        dy: East.
        dz: Down.
        free_m: How far it looks [m].
    """
    normals, offsets_m, rules = arena.normals, arena.offsets_m, arena.rules[0]
    for h in range(rules.fence_first, rules.fence_last):
        slope = normals[h, 0] * dx + normals[h, 1] * dy + normals[h, 2] * dz
        if slope > 0.0:
            d = normals[h, 0] * x + normals[h, 1] * y + normals[h, 2] * z + offsets_m[h]
            free_m = min(free_m, max(0.0, -d) / slope)
    for o in range(arena.obstacles.shape[0]):
        first, last = arena.obstacles[o].first_face, arena.obstacles[o].last_face
        free_m = _ray_to_hull(normals, offsets_m, first, last, x, y, z, dx, dy, dz, free_m)
    return free_m


@inlined_kernel
def _both_ways(inside_m, slope, free_m, ahead, behind):
    """Shorten two opposite rays where a plane cuts them, inside_m away; slope is the first's."""
    way_m = inside_m / abs(slope)
    free_m[ahead] = min(free_m[ahead], way_m if slope > 0.0 else RAY_M)
    free_m[behind] = min(free_m[behind], way_m if slope < 0.0 else RAY_M)


@inlined_kernel
def _rays_to_fence(normals, offsets_m, first, last, x, y, z, free_m):
    """Write how far the rays go before they leave the fence; returns how far away that is."""
    faces = rows_view(normals, first, (last - first, 3))
    away_m = rows_view(offsets_m, first, last - first)
    for ray in range(N_RAYS):
        free_m[ray] = RAY_M
    outermost = -math.inf
    for h in range(away_m.shape[0]):
        d = faces[h, 0] * x + faces[h, 1] * y + faces[h, 2] * z + away_m[h]
        outermost = max(outermost, d)
        if d < -_BEYOND_M:
            continue
        inside_m = max(0.0, -d)
        north = faces[h, 0]
        east = faces[h, 1]
        diagonal_north = north * _DIAGONAL
        diagonal_east = east * _DIAGONAL
        _both_ways(inside_m, north, free_m, _N, _S)
        _both_ways(inside_m, diagonal_north + diagonal_east, free_m, _NE, _SW)
        _both_ways(inside_m, east, free_m, _E, _W)
        _both_ways(inside_m, diagonal_east - diagonal_north, free_m, _SE, _NW)
        _both_ways(inside_m, faces[h, 2], free_m, _DOWN, _UP)
    return -outermost


@inlined_kernel
def _obstruct(normals, offsets_m, first, last, x, y, z, along_m, half_m, direction, free_m, rays):
    """Shorten two opposite rays at a hull.

    Args:
        normals: (F, 3) all planes.
        offsets_m: (F,) [m].
        first: First face of the hull.
        last: The one after its last.
        x: North of the UAS [m].
        y: East of it [m].
        z: Down of it [m].
        along_m: How far ahead the middle of the box around the hull is [m].
        half_m: How far the box reaches from there, ahead and back [m].
        direction: Ahead: north, east, down.
        free_m: (N_RAYS,) [m] written.
        rays: Indices of the ray in this direction, and of the other.
    """
    dx, dy, dz = direction
    ahead, behind = rays
    if along_m + half_m >= 0.0 and along_m - half_m < free_m[ahead]:
        free_m[ahead] = _ray_to_hull(
            normals, offsets_m, first, last, x, y, z, dx, dy, dz, free_m[ahead]
        )
    if along_m - half_m <= 0.0 and -along_m - half_m < free_m[behind]:
        free_m[behind] = _ray_to_hull(
            normals, offsets_m, first, last, x, y, z, -dx, -dy, -dz, free_m[behind]
        )


@kernel
def _rays_in_box(normals, offsets_m, first, last, x, y, z, free_m):
    """Shorten all rays of a UAS that is inside the box around a hull.

    Inside of the hull itself, where it is lost, a ray that leaves through the nearest face is free.
    """
    face = first
    away_m = -math.inf
    for h in range(first, last):
        d = normals[h, 0] * x + normals[h, 1] * y + normals[h, 2] * z + offsets_m[h]
        if d > away_m:
            away_m = d
            face = h
    for ray in range(N_RAYS):
        dx, dy, dz = _RAYS[ray]
        slope = normals[face, 0] * dx + normals[face, 1] * dy + normals[face, 2] * dz
        if away_m <= -slope * free_m[ray]:
            free_m[ray] = _ray_to_hull(
                normals, offsets_m, first, last, x, y, z, dx, dy, dz, free_m[ray]
            )


@inlined_kernel
def _look_for_obstacles(columns, first, n, x, y, z, beyond, in_reach):
    """Which obstacles may be near, and the boxes of which the rays may meet.

    Args:
        columns: (N_COLUMNS, C) see `obstacle_columns`.
        first: Index of the first obstacle.
        n: Number of columns, at most BLOCK.
        x: North of the UAS [m].
        y: East of it [m].
        z: Down of it [m].
        beyond: (n or more,) written: so many times as far from the middle of an obstacle's larger
            box as its walls.
        in_reach: (n or more,) written: 1 where a ray may meet its hull's box, 0 elsewhere.
    """
    middle_x = slice_view(columns[MIDDLE], first, n)
    middle_y = slice_view(columns[MIDDLE + 1], first, n)
    middle_z = slice_view(columns[MIDDLE + 2], first, n)
    per_half_x = slice_view(columns[PER_HALF], first, n)
    per_half_y = slice_view(columns[PER_HALF + 1], first, n)
    per_half_z = slice_view(columns[PER_HALF + 2], first, n)
    for o in range(n):
        beyond[o] = max(
            halves_away(x, x, middle_x[o], per_half_x[o]),
            halves_away(y, y, middle_y[o], per_half_y[o]),
            halves_away(z, z, middle_z[o], per_half_z[o]),
        )
    # a loop of its own: of one that reads all twelve columns the compiler thinks, for less than
    # twenty obstacles, that vector instructions would not pay
    hull_x = slice_view(columns[HULL_MIDDLE], first, n)
    hull_y = slice_view(columns[HULL_MIDDLE + 1], first, n)
    hull_z = slice_view(columns[HULL_MIDDLE + 2], first, n)
    half_x = slice_view(columns[HULL_HALF], first, n)
    half_y = slice_view(columns[HULL_HALF + 1], first, n)
    half_z = slice_view(columns[HULL_HALF + 2], first, n)
    for o in range(n):
        north_m = hull_x[o] - x
        east_m = hull_y[o] - y
        down_m = hull_z[o] - z
        half_both_m = half_x[o] + half_y[o]
        level = abs(down_m) <= half_z[o]
        along_north = abs(east_m) <= half_y[o]
        along_east = abs(north_m) <= half_x[o]
        diagonal = (abs(north_m - east_m) <= half_both_m) | (abs(north_m + east_m) <= half_both_m)
        crossed = along_north | along_east | diagonal
        near = (abs(north_m) - half_x[o] < _BEYOND_M) & (abs(east_m) - half_y[o] < _BEYOND_M)
        below = along_north & along_east & (abs(down_m) - half_z[o] < _BEYOND_M)
        in_reach[o] = 1.0 if (level & crossed & near) | below else 0.0


@inlined_kernel
def _rays_to_obstacle(obstacle, normals, offsets_m, x, y, z, free_m):
    """Shorten the rays that meet an obstacle; most miss the box around it."""
    first = obstacle.first_face
    last = obstacle.last_face
    half_north_m = obstacle.hull_half_m[0]
    half_east_m = obstacle.hull_half_m[1]
    north_m = obstacle.hull_middle_m[0] - x
    east_m = obstacle.hull_middle_m[1] - y
    down_m = obstacle.hull_middle_m[2] - z
    half_both_m = half_north_m + half_east_m
    level = abs(down_m) <= obstacle.hull_half_m[2]
    along_north = abs(east_m) <= half_east_m
    along_east = abs(north_m) <= half_north_m
    if level & along_north & along_east:
        _rays_in_box(normals, offsets_m, first, last, x, y, z, free_m)
        return
    if level & along_north:
        _obstruct(
            normals, offsets_m, first, last, x, y, z,
            north_m, half_north_m, (1.0, 0.0, 0.0), free_m, (_N, _S),
        )  # fmt: skip
    if level & along_east:
        _obstruct(
            normals, offsets_m, first, last, x, y, z,
            east_m, half_east_m, (0.0, 1.0, 0.0), free_m, (_E, _W),
        )  # fmt: skip
    if level & (abs(north_m - east_m) <= half_both_m):
        _obstruct(
            normals, offsets_m, first, last, x, y, z, (north_m + east_m) * _DIAGONAL,
            half_both_m * _DIAGONAL, (_DIAGONAL, _DIAGONAL, 0.0), free_m, (_NE, _SW),
        )  # fmt: skip
    if level & (abs(north_m + east_m) <= half_both_m):
        _obstruct(
            normals, offsets_m, first, last, x, y, z, (east_m - north_m) * _DIAGONAL,
            half_both_m * _DIAGONAL, (-_DIAGONAL, _DIAGONAL, 0.0), free_m, (_SE, _NW),
        )  # fmt: skip
    if along_north & along_east:
        _obstruct(
            normals, offsets_m, first, last, x, y, z,
            down_m, obstacle.hull_half_m[2], (0.0, 0.0, 1.0), free_m, (_DOWN, _UP),
        )  # fmt: skip


@inlined_kernel
def write(arena, state, tables, learners, i, parameters, row):
    """Write the group, see `ObservationBlock`."""
    normals = arena.normals
    offsets_m = arena.offsets_m
    rules = arena.rules[0]
    x = state.x[i, S.X]
    y = state.x[i, S.Y]
    z = state.x[i, S.Z]
    free_m = stack_array(N_RAYS)
    inside_m = _rays_to_fence(
        normals, offsets_m, rules.fence_first, rules.fence_last, x, y, z, free_m
    )
    clearance_m = HEIGHT_M
    beyond = stack_array(BLOCK)
    in_reach = stack_array(BLOCK)
    columns = arena.obstacle_columns
    n_obstacles = arena.obstacles.shape[0]
    for first in range(0, n_obstacles, BLOCK):
        n = min(BLOCK, columns.shape[1] - first)
        _look_for_obstacles(columns, first, n, x, y, z, beyond, in_reach)
        for o in range(min(n, n_obstacles - first)):
            obstacle = arena.obstacles[first + o]
            if beyond[o] < _WITHIN_BOX:
                out_m = signed_distance(
                    normals, offsets_m, obstacle.first_face, obstacle.last_face, x, y, z
                )
                clearance_m = min(clearance_m, out_m)
            if in_reach[o] != 0.0:
                _rays_to_obstacle(obstacle, normals, offsets_m, x, y, z, free_m)
    for ray in range(N_RAYS):
        row[_AT.rays + ray] = within(1.0 - free_m[ray] * (1.0 / RAY_M), 0.0, 1.0)
    row[_AT.clearance] = within(clearance_m * (1.0 / HEIGHT_M), -1.0, 1.0)
    row[_AT.fence] = within((inside_m - rules.fence_margin_m) * (1.0 / HEIGHT_M), -1.0, 1.0)


SURROUNDINGS = ObservationBlock("surroundings", 1, _FEATURES, write)
