"""Ways past the fixed obstacles: what a straight leg crosses, and the corners to turn at.

Low obstacles are flown over, tall ones passed along the corners of their widened footprints, as in
a visibility graph (`corners.py`).
"""

import math

import numpy as np

from uas_coverage_env.compiled.kernels import inlined_kernel, kernel, lowest_bit, stack_array
from uas_coverage_env.compiled.views import rows_view, slice_view
from uas_coverage_env.geometry.segments import segment_meets, signed_distance
from uas_coverage_env.world.broad_phase import BLOCK, BOX, write_meetings

CREEP_M = 1e-3

SIGHT = 64
"""Of so many corners is kept whether they are in sight of a place."""

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


@inlined_kernel
def _ends_away(normals, offsets_m, x0, y0, x1, y1):
    """How far the ends of a leg are from a footprint, and whether both lie outside of one side."""
    from_m = to_m = -math.inf
    apart = False
    for h in range(offsets_m.shape[0]):
        d0 = normals[h, 0] * x0 + normals[h, 1] * y0 + offsets_m[h]
        d1 = normals[h, 0] * x1 + normals[h, 1] * y1 + offsets_m[h]
        from_m = max(from_m, d0)
        to_m = max(to_m, d1)
        apart |= (d0 >= 0.0) & (d1 >= 0.0)
    return from_m, to_m, apart


@inlined_kernel
def _entry(normals, offsets_m, inflation_m, x0, y0, x1, y1):
    """Fraction of the leg at which it enters an inflated footprint; 2 where it does not."""
    enters = 0.0
    leaves = 1.0
    misses = False
    for h in range(offsets_m.shape[0]):
        # selections rather than branches: every side is another case
        offset = offsets_m[h] - inflation_m
        d0 = normals[h, 0] * x0 + normals[h, 1] * y0 + offset
        d1 = normals[h, 0] * x1 + normals[h, 1] * y1 + offset
        at = d0 / (d0 - d1 if d0 != d1 else 1.0)
        misses |= (d0 >= 0.0) & (d1 >= 0.0)
        enters = max(enters, at if (d0 >= 0.0) & (d1 < 0.0) else 0.0)
        leaves = min(leaves, at if (d0 < 0.0) & (d1 >= 0.0) else 1.0)
    return 2.0 if misses | (enters >= leaves) else enters


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
    n_sides = obstacle.last_side - first
    sides = rows_view(normals, first, (n_sides, 3))
    away_m = rows_view(offsets_m, first, n_sides)
    d0, d1, apart = _ends_away(sides, away_m, x0, y0, x1, y1)
    over = min(d0, d1) <= -obstacle.wall_m
    if apart:
        return 2.0, over, d1 <= 0.0
    inflation_m = 0.0
    if d0 > -obstacle.wall_m:
        inflation_m = min(inflation_m, d0 - CREEP_M)
    if d1 > -obstacle.wall_m:
        inflation_m = min(inflation_m, d1 - CREEP_M)
    at = _entry(sides, away_m, inflation_m, x0, y0, x1, y1)
    return at, over, d1 <= 0.0


@kernel
def hides(obstacle, normals, offsets_m, x0, y0, x1, y1):
    """Whether a tall obstacle lies between two places.

    Not where the leg starts or ends above it: it has to pass over it anyway.
    """
    at, over, _ = crossing(obstacle, normals, offsets_m, x0, y0, x1, y1)
    return at <= 1.0 and not over


@kernel
def in_sight(obstacles, normals, offsets_m, x0, y0, x1, y1):
    """Whether no tall obstacle hides one place from another."""
    for o in range(obstacles.shape[0]):
        if obstacles[o].tall and hides(obstacles[o], normals, offsets_m, x0, y0, x1, y1):
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


@inlined_kernel
def _write_lengths(places_m, onward_m, first, x0, y0, tried, tried_m, length_m):
    """How long the ways over some corners are [m]; infinite up to the one that was tried last.

    A loop of its own, and the choice another one: so the processor does several at a time.
    """
    for n in range(onward_m.shape[0]):
        dx = places_m[n, 0] - x0
        dy = places_m[n, 1] - y0
        way_m = math.sqrt(dx * dx + dy * dy) + onward_m[n]
        later = (way_m > tried_m) | ((way_m == tried_m) & (first + n > tried))
        length_m[n] = way_m if later else math.inf


@inlined_kernel
def _leave_out_hidden(sight, length_m):
    for n in range(sight.shape[0]):
        length_m[n] = math.inf if sight[n] < 0.0 else length_m[n]


@inlined_kernel
def forget_corners(sight):
    """Begin at another place: of no corner is known whether it is in sight."""
    for n in range(sight.shape[0]):
        sight[n] = 0.0


@inlined_kernel
def _sees_corner(arena, corner, x0, y0, sight):
    """Whether a corner is in sight; of the first ones that is kept, 1 for yes and -1 for no."""
    kept = corner < sight.shape[0]
    if kept and sight[corner] != 0.0:
        return sight[corner] > 0.0
    sees = in_sight(
        arena.obstacles, arena.normals, arena.offsets_m, x0, y0, arena.nodes_m[corner, 0],
        arena.nodes_m[corner, 1],
    )  # fmt: skip
    if kept:
        sight[corner] = 1.0 if sees else -1.0
    return sees


@kernel
def next_corner(arena, target, x0, y0, sight):
    """The corner in sight over which the way to a target is the shortest; -1 where there is none.

    The shortest way is tried first, then the next: mostly the first or second corner is in sight.
    `sight` is what is known of the corners from this place, see `forget_corners`; written.
    """
    nodes_m = arena.nodes_m
    onward_m = arena.node_distance_m[target]
    length_m = stack_array(BLOCK)
    tried = -1
    tried_m = -math.inf
    while True:
        shortest_m = math.inf
        corner = -1
        for first in range(0, nodes_m.shape[0], BLOCK):
            n = min(BLOCK, nodes_m.shape[0] - first)
            _write_lengths(
                rows_view(nodes_m, first, (n, 2)), rows_view(onward_m, first, n), first, x0, y0,
                tried, tried_m, length_m,
            )  # fmt: skip
            if first == 0:
                _leave_out_hidden(slice_view(sight, 0, min(n, SIGHT)), length_m)
            for k in range(n):
                if length_m[k] < shortest_m:
                    shortest_m = length_m[k]
                    corner = first + k
        if corner < 0 or _sees_corner(arena, corner, x0, y0, sight):
            return corner
        tried = corner
        tried_m = shortest_m


@inlined_kernel
def way_round(arena, corner, target, x0, y0):
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
    obstacles, normals, offsets_m = arena.obstacles, arena.normals, arena.offsets_m
    straight_m = math.hypot(x1 - x0, y1 - y0)
    if line_is_clear(arena, x0, y0, z0, x1, y1, z1):
        return x1, y1, straight_m, CLEAR
    if in_sight(obstacles, normals, offsets_m, x0, y0, x1, y1):
        return x1, y1, straight_m, IN_SIGHT
    sight = stack_array(SIGHT)
    forget_corners(sight)
    corner = next_corner(arena, target, x0, y0, sight)
    if corner < 0:
        return x1, y1, straight_m, NO_WAY
    north_m, east_m, way_m = way_round(arena, corner, target, x0, y0)
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
        sight = stack_array(SIGHT)
        forget_corners(sight)
        corner = next_corner(arena, target, x0, y0, sight)
        if corner >= 0:
            return way_round(arena, corner, target, x0, y0)
    dx = x1 - x0
    dy = y1 - y0
    return x1, y1, math.sqrt(dx * dx + dy * dy)


@inlined_kernel
def hidden_ones(obstacles, normals, offsets_m, x0, y0, x1, y1, n):
    """Which of several places are not `in_sight` of one, as the bits of a number.

    Most obstacles lie aside of most of them: one place and the other beyond the same side, which
    is asked for all others at once.

    Args:
        obstacles: (O,) of OBSTACLE_DTYPE.
        normals: (F, 3) all planes.
        offsets_m: (F,) [m].
        x0: North of the one place [m].
        y0: East of it [m].
        x1: (K,) north of the others [m], at most 62.
        y1: (K,) east of them [m].
        n: How many there are; what lies behind in `x1` and `y1` are numbers, too.
    """
    all_ones = (1 << n) - 1
    hidden = 0
    for o in range(obstacles.shape[0]):
        if not obstacles[o].tall:
            continue
        apart = 0
        for h in range(obstacles[o].first_side, obstacles[o].last_side):
            north, east, offset_m = normals[h, 0], normals[h, 1], offsets_m[h]
            if north * x0 + east * y0 + offset_m >= 0.0:
                for c in range(x1.shape[0]):
                    beyond = north * x1[c] + east * y1[c] + offset_m >= 0.0
                    apart |= np.int64(beyond) << c
        bits = all_ones & ~(apart | hidden)
        while bits != 0:
            c = lowest_bit(bits)
            bits &= bits - 1
            if hides(obstacles[o], normals, offsets_m, x0, y0, x1[c], y1[c]):
                hidden |= 1 << c
    return hidden
