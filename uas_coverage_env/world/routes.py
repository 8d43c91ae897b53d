"""Ways past the fixed obstacles: what a straight leg crosses, and the corners to turn at.

Low obstacles are flown over, tall ones passed along the corners of their widened footprints, as in
a visibility graph (`corners.py`).
"""

import math

from uas_coverage_env.compiled.kernels import inlined_kernel, kernel, stack_array
from uas_coverage_env.geometry.segments import segment_meets, signed_distance
from uas_coverage_env.world.broad_phase import BLOCK, BOX, write_meetings

CREEP_M = 1e-3

CLEAR, IN_SIGHT, ROUND_CORNER, NO_WAY = range(4)
"""A leg to the target itself, free; to the target, over low obstacles; to a corner; to the target,
over everything, because there is no way round."""


@inlined_kernel
def level_apart(obstacle, x0, y0, x1, y1):
    """Whether a segment, seen from above, misses the box in which the clearance is below near_m."""
    lower = obstacle.lower_m
    upper = obstacle.upper_m
    # no `or`: to know all takes less time than to guess wrong once
    return (
        (max(x0, x1) < lower[0])
        | (min(x0, x1) > upper[0])
        | (max(y0, y1) < lower[1])
        | (min(y0, y1) > upper[1])
    )


@inlined_kernel
def box_apart(obstacle, x0, y0, z0, x1, y1, z1):
    """The same in space."""
    return (
        level_apart(obstacle, x0, y0, x1, y1)
        | (max(z0, z1) < obstacle.lower_m[2])
        | (min(z0, z1) > obstacle.upper_m[2])
    )


@kernel
def _entry(normals, offsets_m, first, last, inflation_m, x0, y0, x1, y1):
    """Fraction of the leg at which it enters an inflated footprint; 2 where it does not."""
    enters = 0.0
    leaves = 1.0
    for h in range(first, last):
        offset = offsets_m[h] - inflation_m
        d0 = normals[h, 0] * x0 + normals[h, 1] * y0 + offset
        d1 = normals[h, 0] * x1 + normals[h, 1] * y1 + offset
        if d0 >= 0.0:
            if d1 >= 0.0:
                return 2.0
            enters = max(enters, d0 / (d0 - d1))
        elif d1 >= 0.0:
            leaves = min(leaves, d0 / (d0 - d1))
        if enters >= leaves:
            return 2.0
    return enters


@kernel
def crossing(obstacle, normals, offsets_m, x0, y0, x1, y1):
    """Where a horizontal leg crosses the widened footprint of an obstacle.

    A leg that starts or ends beside the walls, inside the margin, may leave or reach that place
    as long as it comes no closer to the walls.

    Returns:
        (fraction of the leg, over, ends): the fraction is 2 where the leg does not cross; `over`
        tells that the leg starts or ends above (or below) the obstacle itself, and `ends` that
        it ends in the widened footprint.
    """
    if level_apart(obstacle, x0, y0, x1, y1):
        return 2.0, False, False
    first = obstacle.first_side
    last = obstacle.last_side
    d0 = signed_distance(normals, offsets_m, first, last, x0, y0, 0.0)
    d1 = signed_distance(normals, offsets_m, first, last, x1, y1, 0.0)
    over = min(d0, d1) <= -obstacle.wall_m
    inflation_m = 0.0
    if d0 > -obstacle.wall_m:
        inflation_m = min(inflation_m, d0 - CREEP_M)
    if d1 > -obstacle.wall_m:
        inflation_m = min(inflation_m, d1 - CREEP_M)
    at = _entry(normals, offsets_m, first, last, inflation_m, x0, y0, x1, y1)
    return at, over, d1 <= 0.0


@kernel
def in_sight(obstacles, normals, offsets_m, x0, y0, x1, y1):
    """Whether no tall obstacle lies between two places.

    Obstacles above which the leg starts or ends do not count: it has to pass over them anyway.
    """
    for o in range(obstacles.shape[0]):
        if obstacles[o].tall:
            at, over, _ = crossing(obstacles[o], normals, offsets_m, x0, y0, x1, y1)
            if at <= 1.0 and not over:
                return False
    return True


@kernel
def obstructs(obstacle, normals, offsets_m, x0, y0, z0, x1, y1, z1):
    """Whether a line in space does not keep the distance of routes from an obstacle."""
    first = obstacle.first_kept
    last = obstacle.last_kept
    keep_m = min(
        obstacle.wall_m,
        signed_distance(normals, offsets_m, first, last, x0, y0, z0) - CREEP_M,
        signed_distance(normals, offsets_m, first, last, x1, y1, z1) - CREEP_M,
    )
    return segment_meets(normals, offsets_m, first, last, keep_m, x0, y0, z0, x1, y1, z1)


@inlined_kernel
def line_is_clear(arena, x0, y0, z0, x1, y1, z1):
    """Whether the straight line in space keeps the distance of routes from every obstacle."""
    meets = stack_array(BLOCK)
    columns = arena.obstacle_columns
    n_obstacles = arena.obstacles.shape[0]
    for first in range(0, n_obstacles, BLOCK):
        n = min(BLOCK, columns.shape[1] - first)
        write_meetings(columns, BOX, first, n, x0, y0, z0, x1, y1, z1, meets)
        for o in range(min(n, n_obstacles - first)):
            if meets[o] != 0.0 and obstructs(
                arena.obstacles[first + o], arena.normals, arena.offsets_m, x0, y0, z0, x1, y1, z1
            ):
                return False
    return True


@kernel
def _next_corner(arena, target, x0, y0):
    """The corner in sight over which the way to a target is the shortest; -1 where there is none.

    The shortest way is tried first, then the next: mostly the first or second corner is in sight.
    """
    nodes_m = arena.nodes_m
    onward_m = arena.node_distance_m
    tried = -1
    tried_m = -math.inf
    while True:
        shortest_m = math.inf
        corner = -1
        for n in range(nodes_m.shape[0]):
            dx = nodes_m[n, 0] - x0
            dy = nodes_m[n, 1] - y0
            length_m = math.sqrt(dx * dx + dy * dy) + onward_m[target, n]
            later = (length_m > tried_m) | ((length_m == tried_m) & (n > tried))
            if later & (length_m < shortest_m):
                shortest_m = length_m
                corner = n
        if corner < 0 or in_sight(
            arena.obstacles, arena.normals, arena.offsets_m, x0, y0, nodes_m[corner, 0],
            nodes_m[corner, 1],
        ):  # fmt: skip
            return corner
        tried = corner
        tried_m = shortest_m


@inlined_kernel
def _round(arena, corner, target, x0, y0):
    """The way to a target round a corner: north and east of the corner, and its length [m]."""
    north_m = arena.nodes_m[corner, 0]
    east_m = arena.nodes_m[corner, 1]
    way_m = math.hypot(north_m - x0, east_m - y0) + arena.node_distance_m[target, corner]
    return north_m, east_m, way_m


@inlined_kernel
def route(arena, target, x0, y0, z0, x1, y1, z1):
    """The next leg on the shortest way to a target past the fixed obstacles.

    Args:
        arena: The mission.
        target: Row of `node_distance_m`: a waypoint, or W + the UAS for its start.
        x0: North of the UAS [m].
        y0: East of the UAS [m].
        z0: Down of the UAS [m].
        x1: North of the target [m].
        y1: East of the target [m].
        z1: Down of the target [m].

    Returns:
        (north [m], east [m], length of the whole way [m], leg): where the next leg ends, and
        which of CLEAR, IN_SIGHT, ROUND_CORNER and NO_WAY it is.
    """
    obstacles = arena.obstacles
    normals = arena.normals
    offsets_m = arena.offsets_m
    straight_m = math.hypot(x1 - x0, y1 - y0)
    if line_is_clear(arena, x0, y0, z0, x1, y1, z1):
        return x1, y1, straight_m, CLEAR
    if in_sight(obstacles, normals, offsets_m, x0, y0, x1, y1):
        return x1, y1, straight_m, IN_SIGHT
    corner = _next_corner(arena, target, x0, y0)
    if corner < 0:
        return x1, y1, straight_m, NO_WAY
    north_m, east_m, way_m = _round(arena, corner, target, x0, y0)
    return north_m, east_m, way_m, ROUND_CORNER


@kernel
def leg_from_corner(arena, target, x0, y0, z0, x1, y1, z1):
    """`route` from a corner of routes itself: (north [m], east [m], leg) of its next leg."""
    if line_is_clear(arena, x0, y0, z0, x1, y1, z1):
        return x1, y1, CLEAR
    obstacles, normals, offsets_m = arena.obstacles, arena.normals, arena.offsets_m
    if in_sight(obstacles, normals, offsets_m, x0, y0, x1, y1):
        return x1, y1, IN_SIGHT
    shortest_m, corner = math.inf, -1
    for n in range(arena.nodes_m.shape[0]):
        north_m, east_m = arena.nodes_m[n, 0], arena.nodes_m[n, 1]
        on_m = math.hypot(north_m - x0, east_m - y0)
        length_m = on_m + arena.node_distance_m[target, n]
        # not the corner itself
        if (
            on_m > CREEP_M
            and length_m < shortest_m
            and in_sight(obstacles, normals, offsets_m, x0, y0, north_m, east_m)
        ):
            shortest_m, corner = length_m, n
    if corner < 0:
        return x1, y1, NO_WAY
    return arena.nodes_m[corner, 0], arena.nodes_m[corner, 1], ROUND_CORNER


@inlined_kernel
def shortest_way(arena, target, x0, y0, z0, x1, y1, z1):
    """The first three of `route`, for callers that do not need the next leg.

    The tall obstacles are asked first: they are few, and mostly none is in the way.
    """
    in_view = in_sight(arena.obstacles, arena.normals, arena.offsets_m, x0, y0, x1, y1)
    if not in_view and not line_is_clear(arena, x0, y0, z0, x1, y1, z1):
        corner = _next_corner(arena, target, x0, y0)
        if corner >= 0:
            return _round(arena, corner, target, x0, y0)
    dx = x1 - x0
    dy = y1 - y0
    return x1, y1, math.sqrt(dx * dx + dy * dy)
