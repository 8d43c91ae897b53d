"""A way out from below what overhangs a UAS, and in below what overhangs its target.

Guidance flies over low obstacles and round tall ones; both begin with a climb, or end with a
descent, that an overhang makes impossible. So what is below an overhang is left, or reached, along
the shortest way through a grid to a place from which guidance can climb. That way is found if the
grid has one; a single convex obstacle can always be left at the altitude at which the UAS is.
"""

import math

import numpy as np

from uas_coverage_env.compiled.kernels import allocating_kernel, kernel
from uas_coverage_env.world.height import lowest_altitude
from uas_coverage_env.world.overhangs import is_below_overhang
from uas_coverage_env.world.places import may_be_at
from uas_coverage_env.world.routes import line_is_clear

LEG_TO_TARGET, LEG_TO_PLACE, TARGET_IS_PLACE = range(3)
"""What `past_overhangs` returns."""

_CELL_M = 2.0  # of the grid, at scale 1
_REACH = 20  # cells to each side: 40 m; both chosen by hand, `tests/autopilot/test_overhangs.py`
_SIDE = 2 * _REACH + 1
_N_CELLS = _SIDE**3
_MOST_PLACES = 4 * _SIDE  # of a way that are kept
_NEIGHBOURS = np.array(
    [
        (n, e, d)
        for n in (-1, 0, 1)
        for e in (-1, 0, 1)
        for d in (-1, 0, 1)
        if abs(n) + abs(e) + abs(d) == 1
    ]
)


@kernel
def _is_free(arena, i, x0, y0, z0, x, y, z):
    """Whether routes may lead through a place, or it is no nearer to anything than the start."""
    if -z > arena.rules[0].ceiling_m or -z < min(lowest_altitude(arena, i, x, y), -z0):
        return False
    return may_be_at(arena, i, x, y, z, (x0, y0, z0))


@allocating_kernel
def way_out(arena, i, x0, y0, z0, x1, y1, places_m):
    """The places along the way out from below the overhangs at a place.

    From (x0, y0, z0), which is not among them; of several ways the shortest to (x1, y1). Written
    to `places_m` (P, 3) [m], in order.

    Returns:
        How many places; 0 where the grid has no way.
    """
    cell_m = arena.rules[0].length_scale * _CELL_M
    before = np.full(_N_CELLS, -1, np.int32)
    queue = np.empty(_N_CELLS, np.int32)
    depth = np.zeros(_N_CELLS, np.int32)
    start = (_REACH * _SIDE + _REACH) * _SIDE + _REACH
    before[start] = start
    queue[0] = start
    head, tail = 0, 1
    best, best_m = -1, math.inf
    while head < tail:
        cell = queue[head]
        head += 1
        # what is found later is farther: it cannot be on a shorter way
        if depth[cell] * cell_m >= best_m:
            break
        a, b, c = cell // (_SIDE * _SIDE), cell // _SIDE % _SIDE, cell % _SIDE
        x = x0 + (a - _REACH) * cell_m
        y = y0 + (b - _REACH) * cell_m
        z = z0 + (c - _REACH) * cell_m
        if not is_below_overhang(arena, x, y, z):
            whole_m = depth[cell] * cell_m + math.hypot(x1 - x, y1 - y)
            if whole_m < best_m:
                best, best_m = cell, whole_m
            continue
        for n in range(_NEIGHBOURS.shape[0]):
            a1, b1, c1 = a + _NEIGHBOURS[n, 0], b + _NEIGHBOURS[n, 1], c + _NEIGHBOURS[n, 2]
            if not (0 <= a1 < _SIDE and 0 <= b1 < _SIDE and 0 <= c1 < _SIDE):
                continue
            following = (a1 * _SIDE + b1) * _SIDE + c1
            if before[following] >= 0:
                continue
            there_x = x0 + (a1 - _REACH) * cell_m
            there_y = y0 + (b1 - _REACH) * cell_m
            there_z = z0 + (c1 - _REACH) * cell_m
            if _is_free(arena, i, x0, y0, z0, there_x, there_y, there_z) and line_is_clear(
                arena, x, y, z, there_x, there_y, there_z
            ):
                before[following] = cell
                depth[following] = depth[cell] + 1
                queue[tail] = following
                tail += 1
    if best < 0:
        return 0
    count = min(depth[best], places_m.shape[0])
    cell = best
    for k in range(depth[best] - 1, -1, -1):
        if k < count:
            places_m[k, 0] = x0 + (cell // (_SIDE * _SIDE) - _REACH) * cell_m
            places_m[k, 1] = y0 + (cell // _SIDE % _SIDE - _REACH) * cell_m
            places_m[k, 2] = z0 + (cell % _SIDE - _REACH) * cell_m
        cell = before[cell]
    return count


@allocating_kernel
def past_overhangs(arena, i, x0, y0, z0, x1, y1, z1, place_m):
    """Where to fly first, where a place or a target lies below an overhang.

    The UAS is at (x0, y0, z0), its target at (x1, y1, z1).

    Returns:
        LEG_TO_TARGET: go on as if there was none; LEG_TO_PLACE: straight to the place, nothing is
        in between; TARGET_IS_PLACE: the place is to be taken for the target.
    """
    places_m = np.empty((_MOST_PLACES, 3))
    if is_below_overhang(arena, x0, y0, z0):
        count = way_out(arena, i, x0, y0, z0, x1, y1, places_m)
        for k in range(count - 1, -1, -1):
            x, y, z = places_m[k, 0], places_m[k, 1], places_m[k, 2]
            if k == 0 or line_is_clear(arena, x0, y0, z0, x, y, z):
                place_m[0], place_m[1], place_m[2] = x, y, z
                return LEG_TO_PLACE
        return LEG_TO_TARGET
    if is_below_overhang(arena, x1, y1, z1):
        count = way_out(arena, i, x1, y1, z1, x0, y0, places_m)
        for k in range(count):
            x, y, z = places_m[k, 0], places_m[k, 1], places_m[k, 2]
            place_m[0], place_m[1], place_m[2] = x, y, z
            if line_is_clear(arena, x0, y0, z0, x, y, z):
                return LEG_TO_PLACE
        if count > 0:
            return TARGET_IS_PLACE
    return LEG_TO_TARGET
