"""Simulated annealing of the routes of all UAS, in compiled code: it stops and goes on anywhere."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.compiled.kernels import allocating_kernel, inlined_kernel
from uas_coverage_env.planning.routing.route_time import (
    BACKWARD,
    add_piece,
    joined,
    pieces_s,
    route_s,
    sum_up,
    sums_of,
)

_SAME_TEMPERATURE = 64  # moves
ROW_OF, PLACE_IN = range(2)
"""Columns of where each waypoint is in the routes."""

OVERTIME = 200.0  # cost of a second beyond the budget, in seconds


class Schedule(NamedTuple):
    """How a search goes on, see `SearchEffort`."""

    moves: int
    hottest_s: float
    coldest_s: float
    window: int
    total_weight: float
    by_pieces: bool
    relocate: float
    """Below which number of [0, 1) a chain changes routes, ..."""
    exchange: float
    """... and below which else tails are exchanged; within a route, ..."""
    reverse: float
    """... likewise for a reversal, ..."""
    shift: float
    """... and a chain."""


class State(NamedTuple):
    """Where a search is, or the best that it found."""

    routes: NDArray[np.int64]
    """(U+1, W+1), the last row of what is left out."""
    lengths: NDArray[np.int64]
    """(U+1,)"""
    seconds: NDArray[np.float64]
    """(U,) flight times."""
    cost_s: NDArray[np.float64]
    """(1,)"""


@inlined_kernel
def _waiting_s(uas, seconds):
    """How much later the last UAS is home than the longest flight takes.

    It has flown its flights one after the other then, packs swapped in between.
    """
    longest, last, home, for_nothing = 0.0, 0.0, 0.0, 0.0
    for r in range(len(seconds)):
        longest = max(longest, seconds[r])
        if r == 0 or uas[r].flown_by != uas[r - 1].flown_by:
            home, for_nothing = 0.0, 0.0
        elif seconds[r] > 0.0:
            home += for_nothing
            for_nothing = 0.0
        if seconds[r] > 0.0:
            home += uas[r].ground_s + seconds[r]
            last = max(last, home)
        if seconds[r] == uas[r].idle_s:
            for_nothing += uas[r].again_s
    return last - longest


@inlined_kernel
def cost_s(task, seconds, left_out, n_left_out, total_weight):
    """What is minimised: when the last UAS is home, a share of all flights, what is left out."""
    longest, cost = 0.0, 0.0
    for u in range(len(seconds)):
        longest = max(longest, seconds[u])
        cost += total_weight * seconds[u]
        budget_s = task.uas[u].budget_s
        if seconds[u] > max(budget_s, 0.0):  # a UAS that may not fly costs nothing where it stays
            cost += OVERTIME * (seconds[u] - budget_s)
    for k in range(n_left_out):
        cost += task.left_out_s[left_out[k]]
    cost += longest
    return cost + _waiting_s(task.uas, seconds) if task.has_trips else cost


@allocating_kernel
def insert_missing(task, routes, lengths, missing, total_weight, by_pieces):
    """Give each missing waypoint, taken out of the last row, to the route it lengthens least.

    What makes the longest route longer counts fully, another one's length by its weight.
    """
    n_uas, width = len(routes) - 1, routes.shape[1]
    seconds = np.empty(n_uas)
    trial, pieces = np.empty(width, np.int64), np.empty((3, BACKWARD + 1), np.int64)
    sums = sums_of(task, n_uas, width)
    for u in range(n_uas):
        seconds[u] = route_s(task, u, routes[u], lengths[u])
        sum_up(task, sums, u, routes[u], lengths[u])
    for waypoint in missing:
        best, best_u, best_at, best_s = np.inf, -1, 0, 0.0
        k = 0
        while routes[n_uas, k] != waypoint:
            k += 1
        for u in range(n_uas):
            quick = by_pieces and sums.waits[u] == 0 and task.is_released[waypoint]
            for at in range(lengths[u] + 1):
                n = add_piece(pieces, 0, u, 0, at - 1, 0)
                n = add_piece(pieces, n, n_uas, k, k, 0)
                n = add_piece(pieces, n, u, at, lengths[u] - 1, 0)
                if quick:
                    new_s = pieces_s(task, sums, u, routes, pieces, n)
                else:
                    joined(routes, pieces, n, trial)
                    new_s = route_s(task, u, trial, lengths[u] + 1)
                old_s, seconds[u] = seconds[u], new_s
                cost = cost_s(task, seconds, routes[n_uas], 0, total_weight)
                seconds[u] = old_s
                if cost < best:
                    best, best_u, best_at, best_s = cost, u, at, new_s
        if best_u < 0:  # no UAS may fly
            continue
        route, length = routes[best_u], lengths[best_u]
        for j in range(length, best_at, -1):
            route[j] = route[j - 1]
        route[best_at] = waypoint
        lengths[best_u] += 1
        seconds[best_u] = best_s
        sum_up(task, sums, best_u, route, lengths[best_u])
        routes[n_uas, k : lengths[n_uas] - 1] = routes[n_uas, k + 1 : lengths[n_uas]].copy()
        lengths[n_uas] -= 1


@allocating_kernel
def keep(now, cost, best):
    """Copy where a search is, as the best there was."""
    best.cost_s[0] = cost
    for row in range(len(now.lengths)):
        best.routes[row, : now.lengths[row]] = now.routes[row, : now.lengths[row]]
    best.lengths[:] = now.lengths
    best.seconds[:] = now.seconds


@allocating_kernel
def _below(rng, n, quick):
    """A random number in 0..n-1; the quick one is not to be told from the exact one."""
    return int(rng.random() * n) if quick else rng.integers(0, n)


@inlined_kernel
def _take(task, routes, lengths, place, sums, r, route, length, by_pieces):
    """Write a route as row r."""
    lengths[r] = length
    for k in range(length):
        routes[r, k] = route[k]
        place[route[k], ROW_OF], place[route[k], PLACE_IN] = r, k
    if by_pieces and r < len(task.uas):
        sum_up(task, sums, r, routes[r], length)


@allocating_kernel(nogil=True)
def anneal(task, now, best, begin, end, schedule, rng):
    """Anneal routes in place, and keep the best.

    Args:
        task: `RoutingArrays` of the problem.
        now: `State` of the search.
        best: the best there was; never worse than where the search began.
        begin: how many moves were tried before.
        end: how many will have been tried then.
        schedule: `Schedule` of the whole search.
        rng: source of random numbers.
    """
    routes, lengths, seconds = now.routes, now.lengths, now.seconds
    neighbours = task.neighbours  # once: taking an array out of a tuple counts a reference
    moves, hottest_s, by_pieces = schedule.moves, schedule.hottest_s, schedule.by_pieces
    cooling = schedule.coldest_s / hottest_s
    n_rows, width = routes.shape
    n_uas = n_rows - 1
    place = np.full((width - 1, 2), -1, np.int64)
    for r in range(n_rows):
        for k in range(lengths[r]):
            place[routes[r, k], ROW_OF], place[routes[r, k], PLACE_IN] = r, k
    sums = sums_of(task, n_uas if by_pieces else 0, width)
    for u in range(n_uas):
        seconds[u] = route_s(task, u, routes[u], lengths[u])
        if by_pieces:
            sum_up(task, sums, u, routes[u], lengths[u])
    cost = cost_s(task, seconds, routes[n_uas], lengths[n_uas], schedule.total_weight)
    if begin == 0:
        keep(now, cost, best)
    one, two = np.empty(2 * width, np.int64), np.empty(2 * width, np.int64)
    ours, theirs = np.empty((4, 4), np.int64), np.empty((4, 4), np.int64)
    temperature = hottest_s * cooling ** (begin / max(moves, 1))
    for move in range(begin, end):
        if move % _SAME_TEMPERATURE == 0 or not by_pieces:
            temperature = hottest_s * cooling ** (move / moves)
        r = _below(rng, n_rows, by_pieces)
        window = schedule.window
        reach = lengths[r] if window <= 0 or r == n_uas else min(window, lengths[r])
        if reach == 0:
            continue
        i = _below(rng, reach, by_pieces)
        w = routes[r, i]
        # next to what: mostly a near waypoint, sometimes an end of any route
        if neighbours.shape[1] > 0 and rng.random() < 0.95:
            nearest = min(neighbours.shape[1], 10)
            v = neighbours[w, _below(rng, nearest, by_pieces)]
            s, j = place[v, ROW_OF], place[v, PLACE_IN]
            if s < 0:
                continue
        else:
            s = _below(rng, n_rows, by_pieces)
            j = _below(rng, lengths[s] + 1, by_pieces) - 1
        # written out here: each array handed to a function of its own counts a reference
        kind, left_out = rng.random(), r == n_uas or s == n_uas
        n, m = 0, -1
        if s != r:
            if kind < schedule.relocate or (left_out and schedule.relocate > 0.0):  # a chain
                chain = 1 if r == n_uas else 1 + _below(rng, 3, by_pieces)
                chain = min(chain, lengths[r] - i)
                backward, after = rng.random() < 0.5, _below(rng, 2, by_pieces)
                at = min(max(j + after, 0), lengths[s])
                n = add_piece(ours, 0, r, 0, i - 1, 0)
                n = add_piece(ours, n, r, i + chain, lengths[r] - 1, 0)
                m = add_piece(theirs, 0, s, 0, at - 1, 0)
                m = add_piece(theirs, m, r, i, i + chain - 1, int(backward))
                m = add_piece(theirs, m, s, at, lengths[s] - 1, 0)
            elif kind < schedule.exchange and not left_out:  # the tails: w follows v
                at = min(max(j + 1, 0), lengths[s])
                n = add_piece(ours, 0, r, 0, i - 1, 0)
                n = add_piece(ours, n, s, at, lengths[s] - 1, 0)
                m = add_piece(theirs, 0, s, 0, at - 1, 0)
                m = add_piece(theirs, m, r, i, lengths[r] - 1, 0)
            else:
                continue
        elif r == n_uas:
            continue
        elif kind < schedule.reverse:  # the stretch between
            low, high = min(i, j) + 1, max(i, j)
            if rng.random() < 0.5:
                low, high = max(min(i, j), 0), max(i, j) - 1
            if high <= low:
                continue
            n = add_piece(ours, 0, r, 0, low - 1, 0)
            n = add_piece(ours, n, r, low, high, 1)
            n = add_piece(ours, n, r, high + 1, lengths[r] - 1, 0)
        elif kind < schedule.shift:  # a chain within the route
            chain = min(1 + _below(rng, 3, by_pieces), lengths[r] - i)
            if i <= j < i + chain:
                continue
            backward, after = rng.random() < 0.5, _below(rng, 2, by_pieces)
            at = j + after
            if at < 0:
                continue
            n = add_piece(ours, 0, r, 0, min(at, i) - 1, 0)
            if at <= i:
                n = add_piece(ours, n, r, i, i + chain - 1, int(backward))
                n = add_piece(ours, n, r, at, i - 1, 0)
            else:
                n = add_piece(ours, n, r, i + chain, at - 1, 0)
                n = add_piece(ours, n, r, i, i + chain - 1, int(backward))
            n = add_piece(ours, n, r, max(at, i + chain), lengths[r] - 1, 0)
        else:
            continue
        quick = by_pieces and r < n_uas and s < n_uas and sums.waits[r] + sums.waits[s] == 0
        n_one, n_two = -1, -1
        if not quick:
            n_one = joined(routes, ours, n, one)
            n_two = joined(routes, theirs, m, two) if m >= 0 else -1
        old_r, old_s = seconds[min(r, n_uas - 1)], seconds[min(s, n_uas - 1)]
        if r < n_uas:
            if quick:
                seconds[r] = pieces_s(task, sums, r, routes, ours, n)
            else:
                seconds[r] = route_s(task, r, one, n_one)
        if m >= 0 and s < n_uas:
            if quick:
                seconds[s] = pieces_s(task, sums, s, routes, theirs, m)
            else:
                seconds[s] = route_s(task, s, two, n_two)
        out, n_out = routes[n_uas], lengths[n_uas]
        if r == n_uas:
            out, n_out = one, n_one
        elif m >= 0 and s == n_uas:
            out, n_out = two, n_two
        new = cost_s(task, seconds, out, n_out, schedule.total_weight)
        if new > cost and rng.random() >= np.exp((cost - new) / temperature):
            if r < n_uas:
                seconds[r] = old_r
            if m >= 0 and s < n_uas:
                seconds[s] = old_s
            continue
        cost = new
        if quick:
            n_one = joined(routes, ours, n, one)
            n_two = joined(routes, theirs, m, two) if m >= 0 else -1
        _take(task, routes, lengths, place, sums, r, one, n_one, by_pieces)
        if m >= 0:
            _take(task, routes, lengths, place, sums, s, two, n_two, by_pieces)
        if cost < best.cost_s[0] - 1e-9:
            keep(now, cost, best)
