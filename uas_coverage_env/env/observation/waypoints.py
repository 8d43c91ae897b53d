"""The open waypoints nearest to a UAS."""

import math

import numpy as np

from uas_coverage_env.compiled.kernels import inlined_kernel, stack_array, stack_array_f32
from uas_coverage_env.entities.state import FLYING
from uas_coverage_env.env.observation.block import (
    DIRECTION,
    Feature,
    Group,
    ObservationBlock,
    flag,
)
from uas_coverage_env.env.observation.nearest import DENSITY, NEXT
from uas_coverage_env.env.observation.relative import STRAIGHT_M, within
from uas_coverage_env.env.observation.scales import HEIGHT_M, K_WAYPOINTS, MARGIN, NEARBY_M
from uas_coverage_env.vehicle import layout as S
from uas_coverage_env.world.waypoints import DOWN_M, EAST_M, NORTH_M, WEIGHT

_ZERO, _ONE, _INFINITE = np.float32(0.0), np.float32(1.0), np.float32(math.inf)
_NEARBY_M = np.float32(NEARBY_M)
_PER_HEIGHT = np.float32(1.0 / HEIGHT_M)
_STRAIGHT_M2 = np.float32(STRAIGHT_M * STRAIGHT_M)

_FEATURES = (
    flag("valid", "1 for an open waypoint; all are 0 where there is none"),
    Feature("direction", 2, -1, 1, DIRECTION),
    flag("closeness", "1/(1 + distance / 30 m)"),
    Feature("below", 1, -1, 1, "how far it is below / 20 m"),
    flag("weight", "weight / heaviest of the scenario"),
    flag("neighbour", "closeness of the open waypoint next to it"),
    flag("density", "open waypoints within 100 m of it / 8, at most 1"),
    flag("nearest_uas", "its closeness to the nearest other flying UAS"),
    flag("taken", "1 where another UAS is on its way to it (waypoint action)"),
    flag("from_home", "its closeness to the start"),
    Feature("energy_margin", 1, -1, 1, "dod left after visiting it and going home / 0.3"),
)

_GROUP = Group("waypoints", K_WAYPOINTS, _FEATURES)
_AT = _GROUP.columns
_WIDTH = _GROUP.width


@inlined_kernel
def _others_near(state, i, targets, wanted, n, north_m, east_m, down_m, other_m2, taken):
    """How near the nearest other flying UAS is to each waypoint, and whether one goes there.

    Args:
        state: The state of the world.
        i: Index of the UAS.
        targets: (U,) where each is flying to.
        wanted: (K_WAYPOINTS,) indices of the waypoints.
        n: How many are looked at.
        north_m: (K_WAYPOINTS,) where they are [m]; likewise east_m and down_m.
        east_m: See north_m.
        down_m: See north_m.
        other_m2: (K_WAYPOINTS,) [m²] infinite; written.
        taken: (K_WAYPOINTS,) zero; written, 1 where one goes there.
    """
    for j in range(state.uas.shape[0]):
        if j == i or state.uas[j].status != FLYING:
            continue
        x = state.x[j, S.X]
        y = state.x[j, S.Y]
        z = state.x[j, S.Z]
        for c in range(n):
            dx = np.float32(north_m[c] - x)
            dy = np.float32(east_m[c] - y)
            dz = np.float32(down_m[c] - z)
            other_m2[c] = min(other_m2[c], dx * dx + dy * dy + dz * dz)
        if targets[j] >= 0 and not state.uas[j].returning:
            target = float(targets[j])
            for c in range(n):
                taken[c] = _ONE if wanted[c] == target else taken[c]


@inlined_kernel
def _near(distance_m):
    """`close` in single precision."""
    return _NEARBY_M / (_NEARBY_M + distance_m)


@inlined_kernel
def write(arena, state, tables, learners, i, parameters, row):
    """Write the group, see `ObservationBlock`.

    Feature by feature rather than waypoint by waypoint, always for as many as there may be: so
    the processor does several at a time. From the ways on in single precision, as they are told:
    its roots and divisions take a third of the time. Waypoints that are not there are the first
    waypoint until they are left out.
    """
    uas = arena.uas[i]
    scale = tables.scales[i]
    around = learners.around
    candidates = learners.candidates[i]
    x = state.x[i, S.X]
    y = state.x[i, S.Y]
    z = state.x[i, S.Z]
    home_north_m = uas.home_m[0]
    home_east_m = uas.home_m[1]
    home_down_m = uas.home_m[2]
    margin_per_m = np.float32(uas.dod_per_s / (uas.speed_mps * MARGIN))
    margin_left = np.float32((uas.dod_max - state.x[i, S.DOD]) * (1.0 / MARGIN))
    wanted = stack_array(K_WAYPOINTS)
    north_m = stack_array(K_WAYPOINTS)
    east_m = stack_array(K_WAYPOINTS)
    down_m = stack_array(K_WAYPOINTS)
    weight = stack_array_f32(K_WAYPOINTS)
    next_one = stack_array_f32(K_WAYPOINTS)
    density = stack_array_f32(K_WAYPOINTS)
    other_m2 = stack_array_f32(K_WAYPOINTS)
    taken = stack_array_f32(K_WAYPOINTS)
    north = stack_array_f32(K_WAYPOINTS)
    east = stack_array_f32(K_WAYPOINTS)
    there = stack_array_f32(K_WAYPOINTS)
    below = stack_array_f32(K_WAYPOINTS)
    other = stack_array_f32(K_WAYPOINTS)
    from_home = stack_array_f32(K_WAYPOINTS)
    margin = stack_array_f32(K_WAYPOINTS)
    columns = arena.waypoint_columns
    n = 0
    for c in range(K_WAYPOINTS):
        w = max(candidates[c], 0)
        n += candidates[c] >= 0
        wanted[c] = w
        north_m[c] = columns[NORTH_M, w]
        east_m[c] = columns[EAST_M, w]
        down_m[c] = columns[DOWN_M, w]
        weight[c] = np.float32(columns[WEIGHT, w] * scale.per_heaviest)
        # here already: of 1000 missions, most of this lies far from the processor
        next_one[c] = around[w, NEXT]
        density[c] = around[w, DENSITY]
        other_m2[c] = _INFINITE
        taken[c] = _ZERO
    # in fours, and not always twelve: a loop of known length is unrolled before it is vectorised
    _others_near(
        state, i, learners.targets, wanted, (n + 3) & -4, north_m, east_m, down_m, other_m2, taken
    )
    for c in range(K_WAYPOINTS):
        dx = np.float32(north_m[c] - x)
        dy = np.float32(east_m[c] - y)
        dz = np.float32(down_m[c] - z)
        home_dx = np.float32(north_m[c] - home_north_m)
        home_dy = np.float32(east_m[c] - home_east_m)
        home_dz = np.float32(down_m[c] - home_down_m)
        level_m2 = dx * dx + dy * dy
        there_m = math.sqrt(level_m2 + dz * dz)
        home_m = math.sqrt(home_dx * home_dx + home_dy * home_dy + home_dz * home_dz)
        per_m = _ONE / math.sqrt(level_m2) if level_m2 > _STRAIGHT_M2 else _ZERO
        north[c] = within(dx * per_m, -_ONE, _ONE)
        east[c] = within(dy * per_m, -_ONE, _ONE)
        there[c] = _near(there_m)
        below[c] = within(dz * _PER_HEIGHT, -_ONE, _ONE)
        other[c] = _near(math.sqrt(other_m2[c]))
        from_home[c] = _near(home_m)
        margin[c] = within(margin_left - (there_m + home_m) * margin_per_m, -_ONE, _ONE)
    for c in range(K_WAYPOINTS):
        # an end that cannot be foretold: so the compiler does not write four waypoints at a time,
        # by instructions for scattered numbers that take longer than one by one
        if candidates[c] < 0:
            break
        row[_WIDTH * c + _AT.valid] = _ONE
        row[_WIDTH * c + _AT.direction] = north[c]
        row[_WIDTH * c + _AT.direction + 1] = east[c]
        row[_WIDTH * c + _AT.closeness] = there[c]
        row[_WIDTH * c + _AT.below] = below[c]
        row[_WIDTH * c + _AT.weight] = within(weight[c], _ZERO, _ONE)
        row[_WIDTH * c + _AT.neighbour] = next_one[c]
        row[_WIDTH * c + _AT.density] = density[c]
        row[_WIDTH * c + _AT.nearest_uas] = other[c]
        row[_WIDTH * c + _AT.taken] = taken[c]
        row[_WIDTH * c + _AT.from_home] = from_home[c]
        row[_WIDTH * c + _AT.energy_margin] = margin[c]
    for at in range(_WIDTH * n, _WIDTH * K_WAYPOINTS):
        row[at] = _ZERO


WAYPOINTS = ObservationBlock("waypoints", K_WAYPOINTS, _FEATURES, write)
