"""The nearest waypoints, UAS and moving obstacles, as a UAS sees them, compiled."""

import math

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import KDTree

from uas_coverage_env.borrow import borrow, part
from uas_coverage_env.env.layout import (
    CROWD,
    CROWD_M,
    HEIGHT_M,
    K_MOVING,
    K_UAS,
    K_WAYPOINTS,
    MARGIN,
    NEARBY_M,
)
from uas_coverage_env.env.relative import (
    STRAIGHT_M,
    apart_m,
    charge_left,
    close,
    direction,
    within,
)
from uas_coverage_env.kernels import inlined_kernel, kernel, lowest_bit, room, single_room
from uas_coverage_env.scenario import Scenario
from uas_coverage_env.vehicle import DOD, VX, VY, VZ, X, Y, Z
from uas_coverage_env.world import FLYING

NO_TARGET = -2
"""Target of a UAS that has none; home is world's HOME, waypoints are their indices."""

N_NEIGHBOURS = 24

_WORD = 63
"""As many waypoints are asked at once: their answers are the bits of one number that has a sign."""

_WAYPOINTS_SIZE = 12 * K_WAYPOINTS
_OTHERS_SIZE = 8 * K_UAS
_MOVING_SIZE = 8 * K_MOVING

_ZERO, _ONE, _INFINITE = np.float32(0.0), np.float32(1.0), np.float32(math.inf)
_NEARBY_M = np.float32(NEARBY_M)
_PER_HEIGHT = np.float32(1.0 / HEIGHT_M)
_STRAIGHT_M2 = np.float32(STRAIGHT_M * STRAIGHT_M)

NEIGHBOURS_DTYPE = np.dtype(
    (
        np.record,
        np.dtype([("index", "i8", (N_NEIGHBOURS,)), ("distance_m", "f8", (N_NEIGHBOURS,))]),
    )
)
"""The waypoints next to a waypoint, nearest first; -1 and infinity where there are no more."""


def neighbours_of(scenario: Scenario) -> NDArray[np.void]:
    """The neighbours of every waypoint.

    Returns:
        (W,) of NEIGHBOURS_DTYPE.
    """
    positions_m = np.array([waypoint.position_m for waypoint in scenario.waypoints])
    neighbours = np.zeros(len(positions_m), dtype=NEIGHBOURS_DTYPE)
    neighbours["index"], neighbours["distance_m"] = -1, np.inf
    answer = KDTree(positions_m).query(positions_m, k=N_NEIGHBOURS + 1)
    for w, (away_m, others) in enumerate(zip(*map(np.asarray, answer), strict=True)):
        # the query finds the waypoint itself, and W where there are no more
        found = (others != w) & (others < len(positions_m))
        n = min(int(found.sum()), N_NEIGHBOURS)
        neighbours["index"][w, :n] = others[found][:n]
        neighbours["distance_m"][w, :n] = away_m[found][:n]
    return neighbours


@inlined_kernel
def _insert(index, away, found, which, distance):
    """Put one into a list in the order of distance, then of index, if it is among the first.

    Args:
        index: (K,) the list; written.
        away: (K,) their distances; written.
        found: Length of the list so far.
        which: Index of the one.
        distance: Its distance.

    Returns:
        Length of the list.
    """
    at = found
    if found == away.shape[0]:
        at -= 1
        if distance > away[at] or (distance == away[at] and which > index[at]):
            return found
    else:
        found += 1
    while at > 0 and (
        away[at - 1] > distance or (away[at - 1] == distance and index[at - 1] > which)
    ):
        away[at] = away[at - 1]
        index[at] = index[at - 1]
        at -= 1
    away[at] = distance
    index[at] = which
    return found


@inlined_kernel
def _away_m2(columns, w, x, y, z):
    dx = columns[0, w] - x
    dy = columns[1, w] - y
    dz = columns[2, w] - z
    return dx * dx + dy * dy + dz * dz


@inlined_kernel
def _open_within(north_m, east_m, down_m, uncovered, x, y, z, limit_m2):
    """The open waypoints no farther than a limit, as the bits of a number."""
    bits = 0
    for w in range(uncovered.shape[0]):
        dx = north_m[w] - x
        dy = east_m[w] - y
        dz = down_m[w] - z
        near = uncovered[w] & (dx * dx + dy * dy + dz * dz <= limit_m2)
        bits |= np.int64(near) << w
    return bits


@inlined_kernel
def nearest_waypoints(arena, state, i, candidates):
    """The open waypoints nearest to UAS i; of two equally near, the first of the scenario.

    Args:
        arena: The arena.
        state: The state of the world.
        i: Index of the UAS.
        candidates: (K_WAYPOINTS,) indices of waypoints, -1 where there are no more; written.
            What is in it, from the step before, hardly changes and is looked at first; it may be
            anything in which nothing is twice.
    """
    x = state.x[i, X]
    y = state.x[i, Y]
    z = state.x[i, Z]
    columns = arena.waypoint_columns
    uncovered = state.uncovered
    n_waypoints = uncovered.shape[0]
    away_m2 = room(K_WAYPOINTS)
    found = 0
    for c in range(K_WAYPOINTS):
        w = candidates[c]
        if 0 <= w < n_waypoints and uncovered[w]:
            m2 = _away_m2(columns, w, x, y, z)
            found = _insert(candidates, away_m2, found, w, m2)
    for first in range(0, n_waypoints, _WORD):
        n = min(_WORD, n_waypoints - first)
        limit_m2 = away_m2[K_WAYPOINTS - 1] if found == K_WAYPOINTS else math.inf
        bits = _open_within(
            part(columns, first, n), part(columns, n_waypoints + first, n),
            part(columns, 2 * n_waypoints + first, n), part(uncovered, first, n),
            x, y, z, limit_m2,
        )  # fmt: skip
        held = 0
        for c in range(found):
            at = candidates[c] - first
            held |= (1 << at) if 0 <= at < n else 0
        bits &= ~held
        while bits != 0:
            w = first + lowest_bit(bits)
            bits &= bits - 1
            m2 = _away_m2(columns, w, x, y, z)
            found = _insert(candidates, away_m2, found, w, m2)
    for c in range(found, K_WAYPOINTS):
        candidates[c] = -1


@kernel
def count_company(uncovered, neighbours, company):
    """Write what is open around every waypoint; it changes only when a waypoint is covered.

    Args:
        uncovered: (W,) still to be covered.
        neighbours: (W,) of NEIGHBOURS_DTYPE.
        company: (W, 2) of float32, closeness of the next open waypoint, and how crowded it is;
            written.
    """
    for w in range(company.shape[0]):
        index = neighbours[w].index
        distance_m = neighbours[w].distance_m
        next_m = math.inf
        crowd = 0
        for n in range(N_NEIGHBOURS):
            other = index[n]
            if other < 0:
                break
            if uncovered[other]:
                next_m = min(next_m, distance_m[n])
                if distance_m[n] > CROWD_M or crowd == CROWD:
                    break
                crowd += 1
        company[w, 0] = close(next_m)
        company[w, 1] = crowd / CROWD


@inlined_kernel
def _rivals(state, i, targets, wanted, n, north_m, east_m, down_m, rival_m2, taken):
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
        rival_m2: (K_WAYPOINTS,) [m²] infinite; written.
        taken: (K_WAYPOINTS,) zero; written, 1 where one goes there.
    """
    for j in range(state.status.shape[0]):
        if j == i or state.status[j] != FLYING:
            continue
        x = state.x[j, X]
        y = state.x[j, Y]
        z = state.x[j, Z]
        for c in range(n):
            dx = np.float32(north_m[c] - x)
            dy = np.float32(east_m[c] - y)
            dz = np.float32(down_m[c] - z)
            rival_m2[c] = min(rival_m2[c], dx * dx + dy * dy + dz * dz)
        if targets[j] >= 0 and not state.returning[j]:
            target = float(targets[j])
            for c in range(n):
                taken[c] = _ONE if wanted[c] == target else taken[c]


@inlined_kernel
def _near(distance_m):
    """`close` in single precision."""
    return _NEARBY_M / (_NEARBY_M + distance_m)


@inlined_kernel
def waypoints(arena, state, scale, company, i, targets, candidates, row, k):
    """Write the open waypoints nearest to UAS i; returns the next column.

    Feature by feature rather than waypoint by waypoint, always for as many as there may be: so
    the processor does several at a time. From the ways on in single precision, as they are told:
    its roots and divisions take a third of the time. Waypoints that are not there are the first
    waypoint until they are left out.
    """
    uas = arena.uas[i]
    x = state.x[i, X]
    y = state.x[i, Y]
    z = state.x[i, Z]
    home_north_m = uas.home_m[0]
    home_east_m = uas.home_m[1]
    home_down_m = uas.home_m[2]
    margin_per_m = np.float32(uas.dod_per_s / (uas.speed_mps * MARGIN))
    margin_left = np.float32((uas.dod_max - state.x[i, DOD]) * (1.0 / MARGIN))
    wanted = room(K_WAYPOINTS)
    north_m = room(K_WAYPOINTS)
    east_m = room(K_WAYPOINTS)
    down_m = room(K_WAYPOINTS)
    weight = single_room(K_WAYPOINTS)
    next_one = single_room(K_WAYPOINTS)
    crowd = single_room(K_WAYPOINTS)
    rival_m2 = single_room(K_WAYPOINTS)
    taken = single_room(K_WAYPOINTS)
    north = single_room(K_WAYPOINTS)
    east = single_room(K_WAYPOINTS)
    there = single_room(K_WAYPOINTS)
    below = single_room(K_WAYPOINTS)
    rival = single_room(K_WAYPOINTS)
    from_home = single_room(K_WAYPOINTS)
    margin = single_room(K_WAYPOINTS)
    columns = arena.waypoint_columns
    n = 0
    for c in range(K_WAYPOINTS):
        w = max(candidates[c], 0)
        n += candidates[c] >= 0
        wanted[c] = w
        north_m[c] = columns[0, w]
        east_m[c] = columns[1, w]
        down_m[c] = columns[2, w]
        weight[c] = np.float32(columns[4, w] * scale.per_heaviest)
        # here already: of 1000 missions, most of this lies far from the processor
        next_one[c] = company[w, 0]
        crowd[c] = company[w, 1]
        rival_m2[c] = _INFINITE
        taken[c] = _ZERO
    # in fours, and not always twelve: a loop of known length is unrolled before it is vectorised
    _rivals(state, i, targets, wanted, (n + 3) & -4, north_m, east_m, down_m, rival_m2, taken)
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
        rival[c] = _near(math.sqrt(rival_m2[c]))
        from_home[c] = _near(home_m)
        margin[c] = within(margin_left - (there_m + home_m) * margin_per_m, -_ONE, _ONE)
    # a view of its own: the compiler knows that its indices are not negative
    told = borrow(row, k, (_WAYPOINTS_SIZE,))
    for c in range(K_WAYPOINTS):
        # an end that nobody can foretell: so the compiler does not write four waypoints at a time,
        # by instructions for scattered numbers that take longer than one by one
        if candidates[c] < 0:
            break
        told[12 * c] = _ONE
        told[12 * c + 1] = north[c]
        told[12 * c + 2] = east[c]
        told[12 * c + 3] = there[c]
        told[12 * c + 4] = below[c]
        told[12 * c + 5] = within(weight[c], _ZERO, _ONE)
        told[12 * c + 6] = next_one[c]
        told[12 * c + 7] = crowd[c]
        told[12 * c + 8] = rival[c]
        told[12 * c + 9] = taken[c]
        told[12 * c + 10] = from_home[c]
        told[12 * c + 11] = margin[c]
    for at in range(12 * n, _WAYPOINTS_SIZE):
        told[at] = _ZERO
    return k + _WAYPOINTS_SIZE


@inlined_kernel
def others(arena, state, scale, i, row, k):
    """Write the flying UAS nearest to UAS i; returns the next column."""
    x = state.x[i]
    index = room(K_UAS)
    away_m = room(K_UAS)
    found = 0
    for j in range(state.status.shape[0]):
        if j != i and state.status[j] == FLYING:
            other = state.x[j]
            m = apart_m(other[X] - x[X], other[Y] - x[Y], other[Z] - x[Z])
            found = _insert(index, away_m, found, j, m)
    told = borrow(row, k, (_OTHERS_SIZE,))
    for at in range(_OTHERS_SIZE):
        told[at] = 0.0
    for c in range(found):
        nearest = int(index[c])
        other = state.x[nearest]
        at = 8 * c
        told[at] = 1.0
        direction(other[X] - x[X], other[Y] - x[Y], told, at + 1)
        told[at + 3] = close(away_m[c])
        told[at + 4] = within((other[Z] - x[Z]) / HEIGHT_M, -1.0, 1.0)
        told[at + 5] = within((other[VX] - x[VX]) * scale.per_v_xy, -2.0, 2.0)
        told[at + 6] = within((other[VY] - x[VY]) * scale.per_v_xy, -2.0, 2.0)
        told[at + 7] = charge_left(arena, state, nearest)
    return k + _OTHERS_SIZE


@inlined_kernel
def moving_obstacles(arena, state, scale, i, row, k):
    """Write the moving obstacles nearest to UAS i; returns the next column."""
    sample = min(state.step[0], arena.moving_path_m.shape[0] - 1)
    x = state.x[i]
    index = room(K_MOVING)
    away_m = room(K_MOVING)
    found = 0
    for m in range(arena.moving.shape[0]):
        centre_m = arena.moving_path_m[sample, m]
        beside_m = apart_m(x[X] - centre_m[0], x[Y] - centre_m[1], 0.0)
        beside_m -= arena.moving[m].radius_m
        above_m = abs(x[Z] - centre_m[2]) - arena.moving[m].half_height_m
        found = _insert(index, away_m, found, m, max(beside_m, above_m))
    told = borrow(row, k, (_MOVING_SIZE,))
    for at in range(_MOVING_SIZE):
        told[at] = 0.0
    for c in range(found):
        nearest = int(index[c])
        centre_m = arena.moving_path_m[sample, nearest]
        velocity_mps = arena.moving_velocity_mps[sample, nearest]
        at = 8 * c
        told[at] = 1.0
        direction(centre_m[0] - x[X], centre_m[1] - x[Y], told, at + 1)
        told[at + 3] = close(max(0.0, away_m[c] - arena.uas[i].radius_m))
        told[at + 4] = within((centre_m[2] - x[Z]) / HEIGHT_M, -1.0, 1.0)
        told[at + 5] = within((velocity_mps[0] - x[VX]) * scale.per_v_xy, -2.0, 2.0)
        told[at + 6] = within((velocity_mps[1] - x[VY]) * scale.per_v_xy, -2.0, 2.0)
        told[at + 7] = within((velocity_mps[2] - x[VZ]) * scale.per_v_z, -2.0, 2.0)
    return k + _MOVING_SIZE
