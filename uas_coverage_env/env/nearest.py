"""The nearest waypoints, UAS and moving obstacles, as a UAS sees them, compiled."""

import math

import numpy as np
from numba import njit
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
from uas_coverage_env.env.relative import apart_m, charge_left, close, direction, within
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


@njit(cache=True, error_model="numpy")
def nearest_waypoints(arena, state, i, candidates, nearest_m2):
    """The open waypoints nearest to UAS i; of two equally near, the first of the scenario."""
    x = state.x[i, X]
    y = state.x[i, Y]
    z = state.x[i, Z]
    found = 0
    for w in range(state.uncovered.shape[0]):
        if not state.uncovered[w]:
            continue
        position_m = arena.waypoints[w].position_m
        dx = position_m[0] - x
        dy = position_m[1] - y
        dz = position_m[2] - z
        m2 = dx * dx + dy * dy + dz * dz
        if found < K_WAYPOINTS:
            at = found
            found += 1
        elif m2 < nearest_m2[K_WAYPOINTS - 1]:
            at = K_WAYPOINTS - 1
        else:
            continue
        while at > 0 and nearest_m2[at - 1] > m2:
            nearest_m2[at] = nearest_m2[at - 1]
            candidates[at] = candidates[at - 1]
            at -= 1
        nearest_m2[at] = m2
        candidates[at] = w
    candidates[found:] = -1


@njit(cache=True, error_model="numpy")
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


@njit(cache=True, error_model="numpy")
def _rival(state, i, position_m, targets, w):
    """How near the nearest other flying UAS is to a waypoint [m], and whether one flies to it."""
    nearest_m = math.inf
    taken = False
    for j in range(state.status.shape[0]):
        if j != i and state.status[j] == FLYING:
            dx = position_m[0] - state.x[j, X]
            dy = position_m[1] - state.x[j, Y]
            dz = position_m[2] - state.x[j, Z]
            nearest_m = min(nearest_m, apart_m(dx, dy, dz))
            taken = taken or (targets[j] == w and not state.returning[j])
    return nearest_m, taken


@njit(cache=True, error_model="numpy")
def waypoints(arena, state, scale, company, i, targets, candidates, row, k):
    """Write the open waypoints nearest to UAS i; returns the next column."""
    uas = arena.uas[i]
    x = state.x[i]
    for c in range(K_WAYPOINTS):
        w = candidates[c]
        if w < 0:
            row[k : k + 12] = 0.0
            k += 12
            continue
        waypoint = arena.waypoints[w]
        dx = waypoint.position_m[0] - x[X]
        dy = waypoint.position_m[1] - x[Y]
        dz = waypoint.position_m[2] - x[Z]
        there_m = apart_m(dx, dy, dz)
        home_m = apart_m(
            waypoint.position_m[0] - uas.home_m[0],
            waypoint.position_m[1] - uas.home_m[1],
            waypoint.position_m[2] - uas.home_m[2],
        )
        rival_m, taken = _rival(state, i, waypoint.position_m, targets, w)
        tour_dod = (there_m + home_m) / uas.speed_mps * uas.dod_per_s
        row[k] = 1.0
        direction(dx, dy, row, k + 1)
        row[k + 3] = close(there_m)
        row[k + 4] = within(dz / HEIGHT_M, -1.0, 1.0)
        row[k + 5] = within(waypoint.weight * scale.per_heaviest, 0.0, 1.0)
        row[k + 6] = company[w, 0]
        row[k + 7] = company[w, 1]
        row[k + 8] = close(rival_m)
        row[k + 9] = 1.0 if taken else 0.0
        row[k + 10] = close(home_m)
        row[k + 11] = within((uas.dod_max - x[DOD] - tour_dod) / MARGIN, -1.0, 1.0)
        k += 12
    return k


@njit(cache=True, error_model="numpy")
def others(arena, state, scale, i, row, k):
    """Write the flying UAS nearest to UAS i; returns the next column."""
    x = state.x[i]
    after_m = -1.0
    after = -1
    for _ in range(K_UAS):
        # the next in the order of distance, then of the fleet
        nearest_m = math.inf
        nearest = -1
        for j in range(state.status.shape[0]):
            if j == i or state.status[j] != FLYING:
                continue
            away_m = apart_m(state.x[j, X] - x[X], state.x[j, Y] - x[Y], state.x[j, Z] - x[Z])
            if away_m < after_m or (away_m == after_m and j <= after):
                continue
            if away_m < nearest_m:
                nearest_m = away_m
                nearest = j
        if nearest < 0:
            row[k : k + 8] = 0.0
        else:
            other = state.x[nearest]
            row[k] = 1.0
            direction(other[X] - x[X], other[Y] - x[Y], row, k + 1)
            row[k + 3] = close(nearest_m)
            row[k + 4] = within((other[Z] - x[Z]) / HEIGHT_M, -1.0, 1.0)
            row[k + 5] = within((other[VX] - x[VX]) * scale.per_v_xy, -2.0, 2.0)
            row[k + 6] = within((other[VY] - x[VY]) * scale.per_v_xy, -2.0, 2.0)
            row[k + 7] = charge_left(arena, state, nearest)
            after_m = nearest_m
            after = nearest
        k += 8
    return k


@njit(cache=True, error_model="numpy")
def moving_obstacles(arena, state, scale, i, row, k):
    """Write the moving obstacles nearest to UAS i; returns the next column."""
    sample = min(state.step[0], arena.moving_path_m.shape[0] - 1)
    x = state.x[i]
    after_m = -math.inf
    after = -1
    for _ in range(K_MOVING):
        nearest_m = math.inf
        nearest = -1
        for m in range(arena.moving.shape[0]):
            centre_m = arena.moving_path_m[sample, m]
            away_m = max(
                math.hypot(x[X] - centre_m[0], x[Y] - centre_m[1]) - arena.moving[m].radius_m,
                abs(x[Z] - centre_m[2]) - arena.moving[m].half_height_m,
            )
            if away_m < after_m or (away_m == after_m and m <= after):
                continue
            if away_m < nearest_m:
                nearest_m = away_m
                nearest = m
        if nearest < 0:
            row[k : k + 8] = 0.0
        else:
            centre_m = arena.moving_path_m[sample, nearest]
            velocity_mps = arena.moving_velocity_mps[sample, nearest]
            row[k] = 1.0
            direction(centre_m[0] - x[X], centre_m[1] - x[Y], row, k + 1)
            row[k + 3] = close(max(0.0, nearest_m - arena.uas[i].radius_m))
            row[k + 4] = within((centre_m[2] - x[Z]) / HEIGHT_M, -1.0, 1.0)
            row[k + 5] = within((velocity_mps[0] - x[VX]) * scale.per_v_xy, -2.0, 2.0)
            row[k + 6] = within((velocity_mps[1] - x[VY]) * scale.per_v_xy, -2.0, 2.0)
            row[k + 7] = within((velocity_mps[2] - x[VZ]) * scale.per_v_z, -2.0, 2.0)
            after_m = nearest_m
            after = nearest
        k += 8
    return k
