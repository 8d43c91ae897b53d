"""The ways past obstacles to the open waypoints nearest to a UAS."""

from uas_coverage_env.compiled.kernels import (
    inlined_kernel,
    lowest_bit,
    stack_array,
    stack_array_f32,
)
from uas_coverage_env.compiled.transposed import transposing
from uas_coverage_env.compiled.views import slice_view
from uas_coverage_env.env.observation.block import Feature, Group, ObservationBlock, flag
from uas_coverage_env.env.observation.relative import STRAIGHT_M, close, level_m, within
from uas_coverage_env.env.observation.scales import AT_ONCE, K_WAYPOINTS
from uas_coverage_env.vehicle import layout as S
from uas_coverage_env.world.routes import (
    SIGHT,
    forget_corners,
    hidden_ones,
    line_is_clear,
    next_corner,
    way_round,
)

_FEATURES = (
    Feature("direction", 2, -1, 1, "unit vector of the first leg to it past obstacles"),
    flag("closeness", "1/(1 + way / 30 m)"),
    flag("leg", "1/(1 + first leg / 30 m)"),
)

_GROUP = Group("ways", K_WAYPOINTS, _FEATURES)
_AT = _GROUP.columns
_WIDTH = _GROUP.width

_N_NUMBERS = _WIDTH * AT_ONCE

_write_rows = transposing(K_WAYPOINTS, _WIDTH, AT_ONCE)


@inlined_kernel
def write(arena, state, tables, learners, i, parameters, row):
    """Write the group, see `ObservationBlock`: what is asked of all, feature by feature."""
    candidates = learners.candidates[i]
    x = state.x[i, S.X]
    y = state.x[i, S.Y]
    z = state.x[i, S.Z]
    leg_x = stack_array(AT_ONCE)
    leg_y = stack_array(AT_ONCE)
    way_m = stack_array(AT_ONCE)
    features = stack_array_f32(_N_NUMBERS)
    north = slice_view(features, AT_ONCE * _AT.direction, AT_ONCE)
    east = slice_view(features, AT_ONCE * (_AT.direction + 1), AT_ONCE)
    closeness = slice_view(features, AT_ONCE * _AT.closeness, AT_ONCE)
    leg = slice_view(features, AT_ONCE * _AT.leg, AT_ONCE)
    n = 0
    for c in range(K_WAYPOINTS):
        w = candidates[c]
        if w < 0:
            break
        n += 1
        leg_x[c] = arena.waypoints[w].position_m[0]
        leg_y[c] = arena.waypoints[w].position_m[1]
    for c in range(n, AT_ONCE):
        leg_x[c] = leg_y[c] = 0.0
    for c in range(AT_ONCE):
        way_m[c] = level_m(leg_x[c] - x, leg_y[c] - y)
    hidden = hidden_ones(arena.obstacles, arena.normals, arena.offsets_m, x, y, leg_x, leg_y, n)
    sight = stack_array(SIGHT)
    forget_corners(sight)
    while hidden != 0:
        c = lowest_bit(hidden)
        hidden &= hidden - 1
        w = candidates[c]
        down_m = arena.waypoints[w].position_m[2]
        if not line_is_clear(arena, x, y, z, leg_x[c], leg_y[c], down_m):
            corner = next_corner(arena, w, x, y, sight)
            if corner >= 0:
                leg_x[c], leg_y[c], way_m[c] = way_round(arena, corner, w, x, y)
    for c in range(AT_ONCE):
        dx = leg_x[c] - x
        dy = leg_y[c] - y
        leg_m = level_m(dx, dy)
        per_m = 1.0 / leg_m if leg_m > STRAIGHT_M else 0.0
        north[c] = within(dx * per_m, -1.0, 1.0)
        east[c] = within(dy * per_m, -1.0, 1.0)
        closeness[c] = close(way_m[c])
        leg[c] = close(leg_m)
    _write_rows(features, row)
    left_out = slice_view(row, _WIDTH * n, _WIDTH * (K_WAYPOINTS - n))
    for at in range(left_out.shape[0]):
        left_out[at] = 0.0


WAYS = ObservationBlock("ways", K_WAYPOINTS, _FEATURES, write)
"""Of the same waypoints as the group `waypoints`, in its order; all are 0 where there is none."""
