"""Home low down, where the wind is too strong to fly against at the height of roofs.

The mean wind grows with height, so what cannot be flown against up there often can below. A UAS
that makes little headway on its way home, or would at the altitude to which guidance would climb,
descends, and passes beside the roofs that would hold it up.
"""

import math

from uas_coverage_env.autopilot.belief import LEAST_GROUND_MPS, speed_along, wind_growth
from uas_coverage_env.compiled.kernels import kernel, stack_array
from uas_coverage_env.geometry import signed_distance
from uas_coverage_env.vehicle import X, Y, Z
from uas_coverage_env.world.obstacles import NODE_MARGIN_M
from uas_coverage_env.world.routes import crossing
from uas_coverage_env.world.state import WIND

LITTLE_MPS = 2.0
"""Headway below which a UAS flies low: of a wind that is known to about a metre per second."""

_HERE_M = 2.0
"""A place so near has been reached."""


@kernel
def _headway_mps(arena, i, belief, north_m, east_m, share):
    """Ground speed along a leg at full airspeed, in a share of the wind believed in [m/s]."""
    length_m = math.hypot(north_m, east_m)
    return speed_along(
        arena.vehicles[i].reference_max_mps, share * belief[WIND], share * belief[WIND + 1],
        north_m / length_m, east_m / length_m,
    )  # fmt: skip


@kernel
def makes_little_headway(arena, i, x, belief, x1, y1, altitude_m):
    """Whether a UAS gets ahead too slowly on a leg that guidance would fly at an altitude.

    Args:
        arena: The arena.
        i: Index of the UAS.
        x: (14,) its state.
        belief: (N_BELIEF,) of its inner loop.
        x1: Where the leg ends, north [m].
        y1: Likewise, east [m].
        altitude_m: At which it would be flown [m].
    """
    north_m, east_m = x1 - x[X], y1 - x[Y]
    if math.hypot(north_m, east_m) < _HERE_M:
        return False
    share = wind_growth(max(altitude_m, -x[Z]), -x[Z])
    return _headway_mps(arena, i, belief, north_m, east_m, share) < LITTLE_MPS


@kernel
def _seconds(arena, i, belief, x0, y0, x1, y1):
    """Time that a leg takes in the wind believed in [s]."""
    length_m = math.hypot(x1 - x0, y1 - y0)
    if length_m < _HERE_M:
        return 0.0
    headway_mps = _headway_mps(arena, i, belief, x1 - x0, y1 - y0, 1.0)
    return length_m / min(max(headway_mps, LEAST_GROUND_MPS), arena.uas[i].speed_mps)


@kernel
def _is_free(arena, x0, y0, x1, y1, z):
    """Whether a leg crosses no widened footprint and ends outside of all, inside the fence."""
    rules = arena.rules[0]
    first, last = rules.fence_first, rules.fence_last
    within_m = rules.fence_margin_m + NODE_MARGIN_M
    if signed_distance(arena.normals, arena.offsets_m, first, last, x1, y1, z) > -within_m:
        return False
    for o in range(arena.obstacles.shape[0]):
        at, over, ends = crossing(
            arena.obstacles[o], arena.normals, arena.offsets_m, x0, y0, x1, y1
        )
        if at <= 1.0 and (ends or not over):
            return False
    return True


@kernel
def beside_roofs(arena, i, x, belief, x1, y1):
    """Where to fly to pass beside the first obstacle that a leg home crosses.

    Args:
        arena: The arena.
        i: Index of the UAS.
        x: (14,) its state.
        belief: (N_BELIEF,) of its inner loop.
        x1: Where the leg ends, north [m].
        y1: Likewise, east [m].

    Returns:
        North and east [m] of the corner of its widened box by which the UAS is home first; of the
        end of the leg where it crosses nothing, or no corner can be flown to.
    """
    nearest, crossed = 2.0, -1
    for o in range(arena.obstacles.shape[0]):
        obstacle = arena.obstacles[o]
        at, _, ends = crossing(obstacle, arena.normals, arena.offsets_m, x[X], x[Y], x1, y1)
        if at < nearest and not ends:
            nearest, crossed = at, o
    if crossed < 0:
        return x1, y1
    obstacle = arena.obstacles[crossed]
    corner_x, corner_y, onward_s = stack_array(4), stack_array(4), stack_array(4)
    for c in range(4):
        north, east = 2 * (c // 2) - 1, 2 * (c % 2) - 1
        out_m = obstacle.wall_m + NODE_MARGIN_M
        corner_x[c] = obstacle.hull_middle_m[0] + north * (obstacle.hull_half_m[0] + out_m)
        corner_y[c] = obstacle.hull_middle_m[1] + east * (obstacle.hull_half_m[1] + out_m)
        at, _, _ = crossing(
            obstacle, arena.normals, arena.offsets_m, corner_x[c], corner_y[c], x1, y1
        )
        onward_s[c] = math.inf
        if at > 1.0:
            onward_s[c] = _seconds(arena, i, belief, corner_x[c], corner_y[c], x1, y1)
    # from the corners behind it on along its sides
    for _ in range(2):
        for c in range(4):
            for beside in (c ^ 1, c ^ 2):
                side_s = _seconds(
                    arena, i, belief, corner_x[c], corner_y[c], corner_x[beside], corner_y[beside]
                )
                onward_s[c] = min(onward_s[c], side_s + onward_s[beside])
    best_s, best_x, best_y = math.inf, x1, y1
    for c in range(4):
        seconds = _seconds(arena, i, belief, x[X], x[Y], corner_x[c], corner_y[c]) + onward_s[c]
        here = math.hypot(corner_x[c] - x[X], corner_y[c] - x[Y]) < _HERE_M
        if (
            seconds < best_s
            and not here
            and _is_free(arena, x[X], x[Y], corner_x[c], corner_y[c], x[Z])
        ):
            best_s, best_x, best_y = seconds, corner_x[c], corner_y[c]
    return best_x, best_y
