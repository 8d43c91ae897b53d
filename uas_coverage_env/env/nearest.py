"""The nearest waypoints, UAS and moving obstacles, as a UAS sees them, compiled."""

import math

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import KDTree

from uas_coverage_env.env.layout import (
    CROWD,
    CROWD_M,
    HEIGHT_M,
    K_MOVING,
    K_UAS,
    K_WAYPOINTS,
    MARGIN,
)
from uas_coverage_env.env.relative import (
    STRAIGHT_M,
    apart_m,
    charge_left,
    close,
    direction,
    within,
)
from uas_coverage_env.kernels import inlined_kernel, kernel, room
from uas_coverage_env.scenario import Scenario
from uas_coverage_env.vehicle import DOD, VX, VY, VZ, X, Y, Z
from uas_coverage_env.world import FLYING

NO_TARGET = -2
"""Target of a UAS that has none; home is world's HOME, waypoints are their indices."""

N_NEIGHBOURS = 24

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
def _holds(index, found, which):
    """Whether the first entries of a list hold one."""
    times = 0
    for at in range(found):
        times += index[at] == which
    return times > 0


@inlined_kernel
def _away_m2(columns, w, x, y, z):
    dx = columns[0, w] - x
    dy = columns[1, w] - y
    dz = columns[2, w] - z
    return dx * dx + dy * dy + dz * dz


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
    limit_m2 = away_m2[K_WAYPOINTS - 1] if found == K_WAYPOINTS else math.inf
    near = 0
    for w in range(n_waypoints):
        near += uncovered[w] & (_away_m2(columns, w, x, y, z) <= limit_m2)
    if near > found:
        for w in range(n_waypoints):
            m2 = _away_m2(columns, w, x, y, z)
            if uncovered[w] and m2 <= limit_m2 and not _holds(candidates, found, w):
                found = _insert(candidates, away_m2, found, w, m2)
    for c in range(found, K_WAYPOINTS):
        candidates[c] = -1


@kernel
def count_company(uncovered, neighbours, company):
    """Write what is open around every waypoint; it changes only when a waypoint is covered.

    Args:
        uncovered: (W,) still to be covered.
        neighbours: (W,) of NEIGHBOURS_DTYPE.
        company: (W, 2) closeness of the next open waypoint, and how crowded it is; written.
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
def _rivals(state, i, targets, candidates, n, north_m, east_m, down_m, rival_m, taken):
    """How near the nearest other flying UAS is to each of n waypoints, and whether one goes there.

    Args:
        state: The state of the world.
        i: Index of the UAS.
        targets: (U,) where each is flying to.
        candidates: (K_WAYPOINTS,) the waypoints.
        n: How many there are.
        north_m: (K_WAYPOINTS,) where they are [m]; likewise east_m and down_m.
        east_m: See north_m.
        down_m: See north_m.
        rival_m: (K_WAYPOINTS,) [m] written.
        taken: (K_WAYPOINTS,) written, 1 where one goes there.
    """
    for c in range(n):
        rival_m[c] = math.inf
        taken[c] = 0.0
    for j in range(state.status.shape[0]):
        if j == i or state.status[j] != FLYING:
            continue
        x = state.x[j, X]
        y = state.x[j, Y]
        z = state.x[j, Z]
        for c in range(n):
            rival_m[c] = min(rival_m[c], apart_m(north_m[c] - x, east_m[c] - y, down_m[c] - z))
        if targets[j] >= 0 and not state.returning[j]:
            for c in range(n):
                if candidates[c] == targets[j]:
                    taken[c] = 1.0


@inlined_kernel
def waypoints(arena, state, scale, company, i, targets, candidates, row, k):
    """Write the open waypoints nearest to UAS i; returns the next column.

    Feature by feature rather than waypoint by waypoint: so the processor does four at a time.
    """
    uas = arena.uas[i]
    x = state.x[i, X]
    y = state.x[i, Y]
    z = state.x[i, Z]
    home_north_m = uas.home_m[0]
    home_east_m = uas.home_m[1]
    home_down_m = uas.home_m[2]
    speed_mps = uas.speed_mps
    dod_per_s = uas.dod_per_s
    dod_left = uas.dod_max - state.x[i, DOD]
    n = 0
    while n < K_WAYPOINTS and candidates[n] >= 0:
        n += 1
    north_m = room(K_WAYPOINTS)
    east_m = room(K_WAYPOINTS)
    down_m = room(K_WAYPOINTS)
    rival_m = room(K_WAYPOINTS)
    taken = room(K_WAYPOINTS)
    north = room(K_WAYPOINTS)
    east = room(K_WAYPOINTS)
    there = room(K_WAYPOINTS)
    below = room(K_WAYPOINTS)
    from_home = room(K_WAYPOINTS)
    margin = room(K_WAYPOINTS)
    columns = arena.waypoint_columns
    for c in range(n):
        w = candidates[c]
        north_m[c] = columns[0, w]
        east_m[c] = columns[1, w]
        down_m[c] = columns[2, w]
    _rivals(state, i, targets, candidates, n, north_m, east_m, down_m, rival_m, taken)
    for c in range(n):
        dx = north_m[c] - x
        dy = east_m[c] - y
        dz = down_m[c] - z
        there_m = apart_m(dx, dy, dz)
        home_m = apart_m(
            north_m[c] - home_north_m, east_m[c] - home_east_m, down_m[c] - home_down_m
        )
        tour_dod = (there_m + home_m) / speed_mps * dod_per_s
        level_m = math.sqrt(dx * dx + dy * dy)
        north[c] = within(dx / level_m, -1.0, 1.0) if level_m > STRAIGHT_M else 0.0
        east[c] = within(dy / level_m, -1.0, 1.0) if level_m > STRAIGHT_M else 0.0
        there[c] = close(there_m)
        below[c] = within(dz / HEIGHT_M, -1.0, 1.0)
        rival_m[c] = close(rival_m[c])
        from_home[c] = close(home_m)
        margin[c] = within((dod_left - tour_dod) / MARGIN, -1.0, 1.0)
    for c in range(n):
        w = candidates[c]
        row[k] = 1.0
        row[k + 1] = north[c]
        row[k + 2] = east[c]
        row[k + 3] = there[c]
        row[k + 4] = below[c]
        row[k + 5] = within(columns[4, w] * scale.per_heaviest, 0.0, 1.0)
        row[k + 6] = company[w, 0]
        row[k + 7] = company[w, 1]
        row[k + 8] = rival_m[c]
        row[k + 9] = taken[c]
        row[k + 10] = from_home[c]
        row[k + 11] = margin[c]
        k += 12
    for _ in range(12 * (K_WAYPOINTS - n)):
        row[k] = 0.0
        k += 1
    return k


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
    for c in range(found):
        nearest = int(index[c])
        other = state.x[nearest]
        row[k] = 1.0
        direction(other[X] - x[X], other[Y] - x[Y], row, k + 1)
        row[k + 3] = close(away_m[c])
        row[k + 4] = within((other[Z] - x[Z]) / HEIGHT_M, -1.0, 1.0)
        row[k + 5] = within((other[VX] - x[VX]) * scale.per_v_xy, -2.0, 2.0)
        row[k + 6] = within((other[VY] - x[VY]) * scale.per_v_xy, -2.0, 2.0)
        row[k + 7] = charge_left(arena, state, nearest)
        k += 8
    for _ in range(8 * (K_UAS - found)):
        row[k] = 0.0
        k += 1
    return k


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
        beside_m = math.hypot(x[X] - centre_m[0], x[Y] - centre_m[1]) - arena.moving[m].radius_m
        above_m = abs(x[Z] - centre_m[2]) - arena.moving[m].half_height_m
        found = _insert(index, away_m, found, m, max(beside_m, above_m))
    for c in range(found):
        nearest = int(index[c])
        centre_m = arena.moving_path_m[sample, nearest]
        velocity_mps = arena.moving_velocity_mps[sample, nearest]
        row[k] = 1.0
        direction(centre_m[0] - x[X], centre_m[1] - x[Y], row, k + 1)
        row[k + 3] = close(max(0.0, away_m[c] - arena.uas[i].radius_m))
        row[k + 4] = within((centre_m[2] - x[Z]) / HEIGHT_M, -1.0, 1.0)
        row[k + 5] = within((velocity_mps[0] - x[VX]) * scale.per_v_xy, -2.0, 2.0)
        row[k + 6] = within((velocity_mps[1] - x[VY]) * scale.per_v_xy, -2.0, 2.0)
        row[k + 7] = within((velocity_mps[2] - x[VZ]) * scale.per_v_z, -2.0, 2.0)
        k += 8
    for _ in range(8 * (K_MOVING - found)):
        row[k] = 0.0
        k += 1
    return k
