"""The ways past obstacles to the open waypoints nearest to a UAS."""

import math

from uas_coverage_env.compiled.kernels import inlined_kernel
from uas_coverage_env.env.observation.block import Feature, Group, ObservationBlock, flag
from uas_coverage_env.env.observation.relative import close, direction
from uas_coverage_env.env.observation.scales import K_WAYPOINTS
from uas_coverage_env.env.ways import way_to
from uas_coverage_env.vehicle import layout as S

_FEATURES = (
    Feature("direction", 2, -1, 1, "unit vector of the first leg to it past obstacles"),
    flag("closeness", "1/(1 + way / 30 m)"),
    flag("leg", "1/(1 + first leg / 30 m)"),
)

_GROUP = Group("ways", K_WAYPOINTS, _FEATURES)
_AT = _GROUP.columns
_WIDTH = _GROUP.width


@inlined_kernel
def write(arena, state, tables, learners, i, parameters, row):
    """Write the group, see `ObservationBlock`."""
    x = state.x[i]
    for c in range(K_WAYPOINTS):
        w = learners.candidates[i, c]
        first = _WIDTH * c
        if w < 0:
            for k in range(first, row.shape[0]):
                row[k] = 0.0
            break
        leg_x, leg_y, way_m, _ = way_to(arena, i, w, x[S.X], x[S.Y], x[S.Z])
        dx = leg_x - x[S.X]
        dy = leg_y - x[S.Y]
        direction(dx, dy, row, first + _AT.direction)
        row[first + _AT.closeness] = close(way_m)
        row[first + _AT.leg] = close(math.sqrt(dx * dx + dy * dy))


WAYS = ObservationBlock("ways", K_WAYPOINTS, _FEATURES, write)
"""Of the same waypoints as the group `waypoints`, in its order; all are 0 where there is none."""
