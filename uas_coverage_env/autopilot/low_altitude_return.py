"""Home low down, where the wind is too strong to fly against at the height of roofs.

The mean wind grows with height, so what cannot be flown against up there often can below. A UAS
that makes little headway on its way home, or would at the altitude to which guidance would climb,
descends. A roof in its way it passes where it is sooner past it: over it in the stronger wind, or
beside it in the weaker. From above a roof it may have to go leeward first, away from home.
"""

import math

from uas_coverage_env.autopilot.belief import estimated_speed, speed_along, wind_growth
from uas_coverage_env.compiled.kernels import kernel, stack_array
from uas_coverage_env.entities.state import WIND
from uas_coverage_env.vehicle import layout as S
from uas_coverage_env.world.height import lowest_altitude
from uas_coverage_env.world.obstacles import NODE_MARGIN_M
from uas_coverage_env.world.places import inside_fence_m
from uas_coverage_env.world.routes import crossing

LITTLE_MPS = 2.0
"""Headway below which a UAS flies low: of a wind that is known to about a metre per second. What
flying low is worth: docs/wind_and_models.md."""

_HERE_M = 2.0  # a place so near has been reached, at scale 1


@kernel
def _headway_mps(arena, i, x, belief, x1, y1, altitude_m):
    """Ground speed at full airspeed along a leg, at an altitude or where the UAS is higher."""
    north_m, east_m = x1 - x[S.X], y1 - x[S.Y]
    length_m = math.hypot(north_m, east_m)
    if length_m < arena.rules[0].length_scale * _HERE_M:
        return math.inf
    share = wind_growth(max(altitude_m, -x[S.Z]), -x[S.Z])
    return speed_along(
        arena.vehicles[i].reference_max_mps, share * belief[WIND], share * belief[WIND + 1],
        north_m / length_m, east_m / length_m,
    )  # fmt: skip


@kernel
def _seconds(arena, i, belief, x0, y0, x1, y1, share):
    """Time that a leg takes in a share of the wind believed in [s]."""
    north_m, east_m = x1 - x0, y1 - y0
    length_m = math.hypot(north_m, east_m)
    if length_m < arena.rules[0].length_scale * _HERE_M:
        return 0.0
    return length_m / estimated_speed(
        arena.vehicles[i].reference_max_mps, arena.uas[i].speed_mps,
        share * belief[WIND], share * belief[WIND + 1], north_m / length_m, east_m / length_m,
    )  # fmt: skip


@kernel
def _is_free(arena, x0, y0, x1, y1, z):
    """Whether a leg crosses no widened footprint and ends outside of all, inside the fence."""
    if inside_fence_m(arena, x1, y1, z) < (
        arena.rules[0].fence_margin_m + arena.rules[0].length_scale * NODE_MARGIN_M
    ):
        return False
    for o in range(arena.obstacles.shape[0]):
        at, over, ends = crossing(
            arena.obstacles[o], arena.normals, arena.offsets_m, x0, y0, x1, y1
        )
        if at <= 1.0 and (ends or not over):
            return False
    return True


@kernel
def _over_s(arena, i, x, belief, x1, y1, obstacle, needed_m, low_share):
    """Time to the end of a leg that climbs to needed_m, and is low once behind an obstacle [s]."""
    climb_m = max(needed_m + x[S.Z], 0.0)
    back, _, _ = crossing(obstacle, arena.normals, arena.offsets_m, x1, y1, x[S.X], x[S.Y])
    past = 1.0 - min(back, 1.0)
    past_x, past_y = x[S.X] + past * (x1 - x[S.X]), x[S.Y] + past * (y1 - x[S.Y])
    over_share = wind_growth(max(needed_m, -x[S.Z]), -x[S.Z])
    return (
        climb_m / arena.uas[i].climb_mps
        + _seconds(arena, i, belief, x[S.X], x[S.Y], past_x, past_y, over_share)
        + _seconds(arena, i, belief, past_x, past_y, x1, y1, low_share)
    )


@kernel
def _beside_roof(arena, i, x, belief, x1, y1, needed_m):
    """Where to fly to pass beside the first obstacle that a leg home crosses; see `low_way`.

    Returns:
        North and east [m] of the corner of its widened box by which the UAS is at the end first;
        of the end where it is sooner over the obstacle, or no corner can be flown to.
    """
    scale = arena.rules[0].length_scale
    nearest, crossed = 2.0, -1
    for o in range(arena.obstacles.shape[0]):
        obstacle = arena.obstacles[o]
        at, _, ends = crossing(obstacle, arena.normals, arena.offsets_m, x[S.X], x[S.Y], x1, y1)
        if at < nearest and not ends:
            nearest, crossed = at, o
    if crossed < 0:
        return x1, y1
    obstacle = arena.obstacles[crossed]
    low_m = max(-arena.uas[i].home_m[2], lowest_altitude(arena, i, x[S.X], x[S.Y]))
    low = 1.0 / wind_growth(-x[S.Z], low_m)
    # from above it, the wind up here is to be flown through first
    first = 1.0 if nearest <= 0.0 else low
    corner_x, corner_y, onward_s = stack_array(4), stack_array(4), stack_array(4)
    for c in range(4):
        north, east = 2 * (c // 2) - 1, 2 * (c % 2) - 1
        out_m = obstacle.wall_m + scale * NODE_MARGIN_M
        corner_x[c] = obstacle.hull_middle_m[0] + north * (obstacle.hull_half_m[0] + out_m)
        corner_y[c] = obstacle.hull_middle_m[1] + east * (obstacle.hull_half_m[1] + out_m)
        at, _, _ = crossing(
            obstacle, arena.normals, arena.offsets_m, corner_x[c], corner_y[c], x1, y1
        )
        onward_s[c] = math.inf
        if at > 1.0:
            onward_s[c] = _seconds(arena, i, belief, corner_x[c], corner_y[c], x1, y1, low)
    # from the corners behind it on along its sides
    for _ in range(2):
        for c in range(4):
            for beside in (c ^ 1, c ^ 2):
                side_s = _seconds(
                    arena, i, belief, corner_x[c], corner_y[c], corner_x[beside], corner_y[beside],
                    low,
                )  # fmt: skip
                onward_s[c] = min(onward_s[c], side_s + onward_s[beside])
    best_s = _over_s(arena, i, x, belief, x1, y1, obstacle, needed_m, low)
    best_x, best_y = x1, y1
    for c in range(4):
        to_s = _seconds(arena, i, belief, x[S.X], x[S.Y], corner_x[c], corner_y[c], first)
        here = math.hypot(corner_x[c] - x[S.X], corner_y[c] - x[S.Y]) < scale * _HERE_M
        if (
            to_s + onward_s[c] < best_s
            and not here
            and _is_free(arena, x[S.X], x[S.Y], corner_x[c], corner_y[c], x[S.Z])
        ):
            best_s, best_x, best_y = to_s + onward_s[c], corner_x[c], corner_y[c]
    return best_x, best_y


@kernel
def low_way(arena, i, x, belief, x1, y1, altitude_m, needed_m):
    """Whether a UAS flies a leg home low, and where to.

    The leg ends at (x1, y1); guidance would fly it at altitude_m, and over its roofs, if there are
    any, at needed_m.

    Returns:
        (low, north [m], east [m]): a place beside a roof, or the end of the leg.
    """
    if _headway_mps(arena, i, x, belief, x1, y1, altitude_m) >= LITTLE_MPS:
        return False, x1, y1
    if needed_m > -math.inf:
        x1, y1 = _beside_roof(arena, i, x, belief, x1, y1, needed_m)
    return True, x1, y1
