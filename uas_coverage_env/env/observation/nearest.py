"""The nearest open waypoints of a UAS, and the waypoints next to a waypoint."""

import math

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import KDTree

from uas_coverage_env.compiled.kernels import inlined_kernel, kernel, lowest_bit, stack_array
from uas_coverage_env.compiled.memory import record_dtype
from uas_coverage_env.compiled.views import slice_view
from uas_coverage_env.env.observation.relative import close
from uas_coverage_env.env.observation.scales import DENSEST, DENSITY_M, K_WAYPOINTS
from uas_coverage_env.env.observation.sorted_list import insert
from uas_coverage_env.scenario import Scenario
from uas_coverage_env.vehicle import layout as S
from uas_coverage_env.world.coverage import can_cover
from uas_coverage_env.world.waypoints import DOWN_M, EAST_M, NORTH_M

NO_TARGET = -2
"""Target of a UAS that has none; home is world's HOME, waypoints are their indices."""

N_NEIGHBOURS = 24

NEXT, DENSITY = range(2)
"""Columns of `Learners.around`: closeness of the next open waypoint, and how dense they are."""

N_AROUND = DENSITY + 1

_WORD = 63
"""As many waypoints are asked at once: their answers are the bits of one number that has a sign."""

NEIGHBOURS_DTYPE = record_dtype(
    [("index", "i8", (N_NEIGHBOURS,)), ("distance_m", "f8", (N_NEIGHBOURS,))]
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
def _away_m2(columns, w, x, y, z):
    dx = columns[NORTH_M, w] - x
    dy = columns[EAST_M, w] - y
    dz = columns[DOWN_M, w] - z
    return dx * dx + dy * dy + dz * dz


@inlined_kernel
def _is_open_within(north_m, east_m, down_m, uncovered, w, x, y, z, limit_m2):
    """Whether a waypoint is open and no farther than a limit."""
    dx = north_m[w] - x
    dy = east_m[w] - y
    dz = down_m[w] - z
    return uncovered[w] & (dx * dx + dy * dy + dz * dz <= limit_m2)


@inlined_kernel
def _open_within(north_m, east_m, down_m, uncovered, x, y, z, limit_m2):
    """The open waypoints no farther than a limit, as the bits of a number."""
    bits = 0
    for w in range(uncovered.shape[0]):
        near = _is_open_within(north_m, east_m, down_m, uncovered, w, x, y, z, limit_m2)
        bits |= np.int64(near) << w
    return bits


@inlined_kernel
def _exchange(index, away_m2, first):
    """Put pairs of neighbours into order, from one place on; no branches: all at once."""
    for c in range(first, K_WAYPOINTS - 1, 2):
        near_m2, far_m2 = away_m2[c], away_m2[c + 1]
        one, other = index[c], index[c + 1]
        turned = near_m2 > far_m2
        away_m2[c] = far_m2 if turned else near_m2
        away_m2[c + 1] = near_m2 if turned else far_m2
        index[c] = other if turned else one
        index[c + 1] = one if turned else other


@inlined_kernel
def _still_open(arena, state, i, x, y, z, candidates, away_m2):
    """Put those into order that were the nearest before, without those that are none any more.

    Returns:
        How many there are; behind them are infinite distances.
    """
    columns = arena.waypoint_columns
    uncovered = state.uncovered
    n_waypoints = uncovered.shape[0]
    asks = arena.rules[0].asks
    index = stack_array(K_WAYPOINTS)
    order_m2 = stack_array(K_WAYPOINTS)
    found = 0
    for c in range(K_WAYPOINTS):
        known = 0 <= candidates[c] < n_waypoints
        w = candidates[c] if known else 0
        known = known and uncovered[w] and (not asks or can_cover(arena, i, w))
        m2 = _away_m2(columns, w, x, y, z)
        order_m2[c] = m2 if known else math.inf
        index[c] = w
        found += known
    # from one step to the next hardly any change places with more than one or two others
    for _ in range(2):
        _exchange(index, order_m2, 0)
        _exchange(index, order_m2, 1)
    ordered = True
    for c in range(K_WAYPOINTS - 1):
        ordered &= order_m2[c] < order_m2[c + 1]
    # arrays of their own: those above stay in registers
    for c in range(K_WAYPOINTS):
        candidates[c] = int(index[c])
        away_m2[c] = order_m2[c]
    if not ordered:
        for c in range(K_WAYPOINTS):
            insert(candidates, away_m2, c, candidates[c], away_m2[c])
    return found


@inlined_kernel
def _n_open_within(north_m, east_m, down_m, uncovered, x, y, z, limit_m2):
    """How many open waypoints are no farther than a limit."""
    n = 0
    for w in range(uncovered.shape[0]):
        n += _is_open_within(north_m, east_m, down_m, uncovered, w, x, y, z, limit_m2)
    return n


@inlined_kernel
def nearest_waypoints(arena, state, i, candidates):
    """The open waypoints nearest to UAS i; of two equally near, the first of the scenario.

    Those that ask for a sensor which it does not carry are none of them.

    Args:
        arena: The arena.
        state: The state of the world.
        i: Index of the UAS.
        candidates: (K_WAYPOINTS,) indices of waypoints, -1 where there are no more; written.
            What is in it, from the step before, hardly changes and is looked at first; it may be
            anything in which nothing is twice.
    """
    x = state.x[i, S.X]
    y = state.x[i, S.Y]
    z = state.x[i, S.Z]
    columns = arena.waypoint_columns
    uncovered = state.uncovered
    n_waypoints = uncovered.shape[0]
    asks = arena.rules[0].asks
    away_m2 = stack_array(K_WAYPOINTS)
    found = _still_open(arena, state, i, x, y, z, candidates, away_m2)
    n_within = _n_open_within(
        slice_view(columns[NORTH_M], 0, n_waypoints), slice_view(columns[EAST_M], 0, n_waypoints),
        slice_view(columns[DOWN_M], 0, n_waypoints), uncovered, x, y, z, away_m2[K_WAYPOINTS - 1],
    )  # fmt: skip
    if n_within == K_WAYPOINTS and found == K_WAYPOINTS:
        return  # mostly: they are still the nearest
    for first in range(0, n_waypoints, _WORD):
        n = min(_WORD, n_waypoints - first)
        bits = _open_within(
            slice_view(columns[NORTH_M], first, n),
            slice_view(columns[EAST_M], first, n),
            slice_view(columns[DOWN_M], first, n),
            slice_view(uncovered, first, n), x, y, z, away_m2[K_WAYPOINTS - 1],
        )  # fmt: skip
        held = 0
        for c in range(found):
            at = candidates[c] - first
            held |= (1 << at) if 0 <= at < n else 0
        bits &= ~held
        while bits != 0:
            w = first + lowest_bit(bits)
            bits &= bits - 1
            if asks and not can_cover(arena, i, w):
                continue
            m2 = _away_m2(columns, w, x, y, z)
            found = insert(candidates, away_m2, found, w, m2)
    for c in range(found, K_WAYPOINTS):
        candidates[c] = -1


@kernel
def write_around(uncovered, neighbours, around):
    """Write what is open around every waypoint; it changes only when a waypoint is covered.

    Args:
        uncovered: (W,) still to be covered.
        neighbours: (W,) of NEIGHBOURS_DTYPE.
        around: (W, N_AROUND) of float32; written.
    """
    for w in range(around.shape[0]):
        index = neighbours[w].index
        distance_m = neighbours[w].distance_m
        next_m = math.inf
        near = 0
        for n in range(N_NEIGHBOURS):
            other = index[n]
            if other < 0:
                break
            if uncovered[other]:
                next_m = min(next_m, distance_m[n])
                if distance_m[n] > DENSITY_M or near == DENSEST:
                    break
                near += 1
        around[w, NEXT] = close(next_m)
        around[w, DENSITY] = near / DENSEST
