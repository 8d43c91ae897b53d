"""The open waypoints nearest to a UAS."""

import math

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.compiled.kernels import inlined_kernel, stack_array, stack_array_f32
from uas_coverage_env.compiled.memory import record_dtype
from uas_coverage_env.compiled.transposed import transposing
from uas_coverage_env.compiled.views import slice_view
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
from uas_coverage_env.env.observation.scales import AT_ONCE, HEIGHT_M, K_WAYPOINTS, MARGIN, NEARBY_M
from uas_coverage_env.vehicle import layout as S
from uas_coverage_env.world.arena import Arena
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

_N_NUMBERS = _WIDTH * AT_ONCE

_write_rows = transposing(K_WAYPOINTS, _WIDTH, AT_ONCE)

FIXED_DTYPE = record_dtype([("home_m", "f4"), ("weight", "f4"), ("from_home", "f4")])
"""What a UAS is told of a waypoint at all times: its distance from the start, and two features."""


def fixed_of(arena: Arena, scales: NDArray[np.void]) -> NDArray[np.void]:
    """What does not change of all waypoints, for all UAS.

    Args:
        arena: The arena.
        scales: (U,) of SCALES_DTYPE.

    Returns:
        (U, W) of FIXED_DTYPE.
    """
    columns = arena.waypoint_columns
    home_m = arena.uas["home_m"].T[:, :, None]
    places_m = columns[[NORTH_M, EAST_M, DOWN_M]][:, None]
    dx, dy, dz = (places_m - home_m).astype(np.float32)
    fixed = np.zeros(dx.shape, FIXED_DTYPE)
    fixed["home_m"] = np.sqrt(dx * dx + dy * dy + dz * dz)
    fixed["from_home"] = _NEARBY_M / (_NEARBY_M + fixed["home_m"])
    fixed["weight"] = np.clip(columns[WEIGHT] * scales["per_heaviest"][:, None], 0.0, 1.0)
    return fixed


@inlined_kernel
def _others_near(state, i, targets, wanted, north_m, east_m, down_m, other_m2, taken):
    """How near the nearest other flying UAS is to each waypoint, and whether one goes there.

    Args:
        state: The state of the world.
        i: Index of the UAS.
        targets: (U,) where each is flying to.
        wanted: (AT_ONCE,) indices of the waypoints.
        north_m: (AT_ONCE,) where they are [m]; likewise east_m and down_m.
        east_m: See north_m.
        down_m: See north_m.
        other_m2: (AT_ONCE,) [m²] infinite; written.
        taken: (AT_ONCE,) zero; written, 1 where one goes there.
    """
    for j in range(state.uas.shape[0]):
        if j == i or state.uas[j].status != FLYING:
            continue
        x = state.x[j, S.X]
        y = state.x[j, S.Y]
        z = state.x[j, S.Z]
        for c in range(AT_ONCE):
            dx = np.float32(north_m[c] - x)
            dy = np.float32(east_m[c] - y)
            dz = np.float32(down_m[c] - z)
            other_m2[c] = min(other_m2[c], dx * dx + dy * dy + dz * dz)
        if targets[j] >= 0 and not state.uas[j].returning:
            target = float(targets[j])
            for c in range(AT_ONCE):
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
    its roots and divisions take a third of the time. Waypoints that are not there are at the
    origin until they are left out.
    """
    uas = arena.uas[i]
    around = learners.around
    candidates = learners.candidates[i]
    x = state.x[i, S.X]
    y = state.x[i, S.Y]
    z = state.x[i, S.Z]
    margin_per_m = np.float32(uas.dod_per_s / (uas.speed_mps * MARGIN))
    margin_left = np.float32((uas.dod_max - state.x[i, S.DOD]) * (1.0 / MARGIN))
    wanted = stack_array(AT_ONCE)
    north_m = stack_array(AT_ONCE)
    east_m = stack_array(AT_ONCE)
    down_m = stack_array(AT_ONCE)
    home_m = stack_array_f32(AT_ONCE)
    other_m2 = stack_array_f32(AT_ONCE)
    features = stack_array_f32(_N_NUMBERS)
    valid = slice_view(features, AT_ONCE * _AT.valid, AT_ONCE)
    north = slice_view(features, AT_ONCE * _AT.direction, AT_ONCE)
    east = slice_view(features, AT_ONCE * (_AT.direction + 1), AT_ONCE)
    there = slice_view(features, AT_ONCE * _AT.closeness, AT_ONCE)
    below = slice_view(features, AT_ONCE * _AT.below, AT_ONCE)
    weight = slice_view(features, AT_ONCE * _AT.weight, AT_ONCE)
    neighbour = slice_view(features, AT_ONCE * _AT.neighbour, AT_ONCE)
    density = slice_view(features, AT_ONCE * _AT.density, AT_ONCE)
    other = slice_view(features, AT_ONCE * _AT.nearest_uas, AT_ONCE)
    taken = slice_view(features, AT_ONCE * _AT.taken, AT_ONCE)
    from_home = slice_view(features, AT_ONCE * _AT.from_home, AT_ONCE)
    margin = slice_view(features, AT_ONCE * _AT.energy_margin, AT_ONCE)
    n = 0
    for c in range(K_WAYPOINTS):
        # an end that cannot be foretold: so the compiler does not read several waypoints at a time,
        # by instructions for scattered numbers that take longer than one by one
        w = candidates[c]
        if w < 0:
            break
        n += 1
        wanted[c] = w
        position_m = arena.waypoints[w].position_m
        north_m[c] = position_m[0]
        east_m[c] = position_m[1]
        down_m[c] = position_m[2]
        home_m[c] = tables.fixed[i, w].home_m
        weight[c] = tables.fixed[i, w].weight
        from_home[c] = tables.fixed[i, w].from_home
        # here already: of 1000 missions, most of this lies far from the processor
        neighbour[c] = around[w, NEXT]
        density[c] = around[w, DENSITY]
    for c in range(n, AT_ONCE):
        wanted[c] = north_m[c] = east_m[c] = down_m[c] = 0.0
        home_m[c] = weight[c] = from_home[c] = neighbour[c] = density[c] = _ZERO
    for c in range(AT_ONCE):
        other_m2[c] = _INFINITE
        taken[c] = _ZERO
    _others_near(state, i, learners.targets, wanted, north_m, east_m, down_m, other_m2, taken)
    for c in range(AT_ONCE):
        dx = np.float32(north_m[c] - x)
        dy = np.float32(east_m[c] - y)
        dz = np.float32(down_m[c] - z)
        level_m2 = dx * dx + dy * dy
        there_m = math.sqrt(level_m2 + dz * dz)
        per_m = _ONE / math.sqrt(level_m2) if level_m2 > _STRAIGHT_M2 else _ZERO
        valid[c] = _ONE
        north[c] = within(dx * per_m, -_ONE, _ONE)
        east[c] = within(dy * per_m, -_ONE, _ONE)
        there[c] = _near(there_m)
        below[c] = within(dz * _PER_HEIGHT, -_ONE, _ONE)
        other[c] = _near(math.sqrt(other_m2[c]))
        margin[c] = within(margin_left - (there_m + home_m[c]) * margin_per_m, -_ONE, _ONE)
    _write_rows(features, row)
    left_out = slice_view(row, _WIDTH * n, _WIDTH * (K_WAYPOINTS - n))
    for at in range(left_out.shape[0]):
        left_out[at] = _ZERO


WAYPOINTS = ObservationBlock("waypoints", K_WAYPOINTS, _FEATURES, write)
