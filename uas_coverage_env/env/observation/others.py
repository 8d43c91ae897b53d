"""The other UAS that fly nearest to a UAS."""

from uas_coverage_env.compiled.kernels import inlined_kernel, stack_array
from uas_coverage_env.entities.state import FLYING
from uas_coverage_env.env.observation.block import (
    DIRECTION,
    Feature,
    Group,
    ObservationBlock,
    flag,
)
from uas_coverage_env.env.observation.relative import (
    apart_m,
    charge_left,
    close,
    direction,
    within,
)
from uas_coverage_env.env.observation.scales import HEIGHT_M, K_UAS
from uas_coverage_env.env.observation.sorted_list import insert
from uas_coverage_env.vehicle import layout as S

_FEATURES = (
    flag("valid", "1 for a flying UAS; all are 0 where there is none"),
    Feature("direction", 2, -1, 1, DIRECTION),
    flag("closeness", "1/(1 + distance / 30 m)"),
    Feature("below", 1, -1, 1, "how far it is below / 20 m"),
    Feature("velocity", 2, -2, 2, "relative, north and east / own limit"),
    Feature("charge_left", 1, -1, 1, "its (dod_max - dod) / dod_max"),
)

_GROUP = Group("others", K_UAS, _FEATURES)
_AT = _GROUP.columns
_WIDTH = _GROUP.width


@inlined_kernel
def write(arena, state, tables, learners, i, parameters, row):
    """Write the group, see `ObservationBlock`."""
    x = state.x[i]
    scale = tables.scales[i]
    index = stack_array(K_UAS)
    away_m = stack_array(K_UAS)
    found = 0
    for j in range(state.uas.shape[0]):
        if j != i and state.uas[j].status == FLYING:
            other = state.x[j]
            m = apart_m(other[S.X] - x[S.X], other[S.Y] - x[S.Y], other[S.Z] - x[S.Z])
            found = insert(index, away_m, found, j, m)
    for at in range(_WIDTH * K_UAS):
        row[at] = 0.0
    for c in range(found):
        nearest = int(index[c])
        other = state.x[nearest]
        at = _WIDTH * c
        row[at + _AT.valid] = 1.0
        direction(other[S.X] - x[S.X], other[S.Y] - x[S.Y], row, at + _AT.direction)
        row[at + _AT.closeness] = close(away_m[c])
        row[at + _AT.below] = within((other[S.Z] - x[S.Z]) / HEIGHT_M, -1.0, 1.0)
        row[at + _AT.velocity] = within((other[S.VX] - x[S.VX]) * scale.per_v_xy, -2.0, 2.0)
        row[at + _AT.velocity + 1] = within((other[S.VY] - x[S.VY]) * scale.per_v_xy, -2.0, 2.0)
        row[at + _AT.charge_left] = charge_left(arena, state, nearest)


OTHERS = ObservationBlock("others", K_UAS, _FEATURES, write)
