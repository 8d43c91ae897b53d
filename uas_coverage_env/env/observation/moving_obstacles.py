"""The moving obstacles nearest to a UAS."""

from uas_coverage_env.compiled.kernels import inlined_kernel, stack_array
from uas_coverage_env.env.observation.block import (
    DIRECTION,
    Feature,
    Group,
    ObservationBlock,
    flag,
)
from uas_coverage_env.env.observation.relative import apart_m, close, direction, within
from uas_coverage_env.env.observation.scales import HEIGHT_M, K_MOVING
from uas_coverage_env.env.observation.sorted_list import insert
from uas_coverage_env.vehicle import layout as S

_FEATURES = (
    flag("valid", "1 for a moving obstacle; all are 0 where there is none"),
    Feature("direction", 2, -1, 1, DIRECTION),
    flag("closeness", "1/(1 + clearance / 30 m)"),
    Feature("below", 1, -1, 1, "how far its centre is below / 20 m"),
    Feature("velocity", 3, -2, 2, "relative, north, east, down / own limits"),
)

_GROUP = Group("moving_obstacles", K_MOVING, _FEATURES)
_AT = _GROUP.columns
_WIDTH = _GROUP.width


@inlined_kernel
def write(arena, state, tables, learners, i, parameters, row):
    """Write the group, see `ObservationBlock`."""
    scale = tables.scales[i]
    sample = min(state.step[0], arena.moving_path_m.shape[0] - 1)
    x = state.x[i]
    index = stack_array(K_MOVING)
    away_m = stack_array(K_MOVING)
    found = 0
    for m in range(arena.moving.shape[0]):
        centre_m = arena.moving_path_m[sample, m]
        beside_m = apart_m(x[S.X] - centre_m[0], x[S.Y] - centre_m[1], 0.0)
        beside_m -= arena.moving[m].radius_m
        above_m = abs(x[S.Z] - centre_m[2]) - arena.moving[m].half_height_m
        found = insert(index, away_m, found, m, max(beside_m, above_m))
    for at in range(_WIDTH * K_MOVING):
        row[at] = 0.0
    for c in range(found):
        nearest = int(index[c])
        centre_m = arena.moving_path_m[sample, nearest]
        velocity_mps = arena.moving_velocity_mps[sample, nearest]
        at = _WIDTH * c
        row[at + _AT.valid] = 1.0
        direction(centre_m[0] - x[S.X], centre_m[1] - x[S.Y], row, at + _AT.direction)
        row[at + _AT.closeness] = close(max(0.0, away_m[c] - arena.uas[i].radius_m))
        row[at + _AT.below] = within((centre_m[2] - x[S.Z]) / HEIGHT_M, -1.0, 1.0)
        row[at + _AT.velocity] = within((velocity_mps[0] - x[S.VX]) * scale.per_v_xy, -2.0, 2.0)
        row[at + _AT.velocity + 1] = within((velocity_mps[1] - x[S.VY]) * scale.per_v_xy, -2.0, 2.0)
        row[at + _AT.velocity + 2] = within((velocity_mps[2] - x[S.VZ]) * scale.per_v_z, -2.0, 2.0)


MOVING_OBSTACLES = ObservationBlock("moving_obstacles", K_MOVING, _FEATURES, write)
