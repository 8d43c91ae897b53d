"""Flight times of routes: of a whole one, and of one made of pieces of others in constant time."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.compiled.kernels import allocating_kernel, inlined_kernel
from uas_coverage_env.planning.routing.clock import setting_off_s, turn_cost

FloatArray = NDArray[np.float64]


ROW, FIRST, LAST, BACKWARD = range(4)
"""Columns of a list of pieces: places FIRST to LAST of a row of routes, in turn or backward."""


class RoutingArrays(NamedTuple):
    """What the search reads of a `RoutingProblem`; kernels pay for every array they hand on."""

    uas: NDArray[np.void]
    first: FloatArray
    between: FloatArray
    home: FloatArray
    place: FloatArray
    """(W+2U, 2) of waypoints, UAS and starts, north and east."""
    turn: FloatArray
    turn_of_cosine: FloatArray
    release: FloatArray
    """(U, W) from when on each UAS may visit."""
    is_released: NDArray[np.bool_]
    """(W,) at any time, by every UAS."""
    left_out_s: FloatArray
    """(W,) what it costs to leave out each waypoint."""
    neighbours: NDArray[np.int64]
    has_trips: bool
    """Whether any UAS is on the ground first, or flies more than once."""


@inlined_kernel
def turn_s(task, u, a, b, c):
    """What UAS u takes to turn at place b, a waypoint, on the way from a to c."""
    place = task.place
    cost = turn_cost(
        task.turn_of_cosine,
        place[b, 0] - place[a, 0],
        place[b, 1] - place[a, 1],
        place[c, 0] - place[b, 0],
        place[c, 1] - place[b, 1],
    )
    return task.turn[u, b] * cost


@inlined_kernel
def route_s(task, u, route, length):
    """Flight time of one UAS along a route and home."""
    uas = task.uas[u]
    if length == 0:
        return uas.idle_s
    place, release = task.place, task.release[u]
    n_waypoints, n_uas = len(release), len(task.uas)
    before, here = n_waypoints + u, route[0]
    time = task.first[u, here]
    time += setting_off_s(uas, place[here, 0] - place[before, 0], place[here, 1] - place[before, 1])
    time = max(time, release[here])
    for k in range(1, length + 1):
        following = route[k] if k < length else n_waypoints + n_uas + u
        time += turn_s(task, u, before, here, following)
        if k == length:
            break
        time += task.between[uas.kind, here, following]
        time = max(time, release[following])
        before, here = here, following
    return time + task.home[u, here]


class Sums(NamedTuple):
    """Sums along the routes, by UAS and place in the route: any stretch of it is a difference."""

    onward: FloatArray
    """(U, W+1) legs from the first waypoint."""
    backward: FloatArray
    """(U, W+1) the same legs, flown the other way."""
    turns: FloatArray
    """(U, W+1) turns, that at the place itself included."""
    identical: NDArray[np.bool_]
    """(U, U) whether legs and turns take both UAS the same time."""
    waits: NDArray[np.int64]
    """(U,) waypoints with a release date: with these a stretch is no difference."""


@allocating_kernel
def sums_of(task, n_uas, width):
    """Sums of empty routes, for `width` waypoints."""
    identical = np.zeros((n_uas, n_uas), np.bool_)
    for u in range(n_uas):
        for v in range(n_uas):
            same = task.uas[u].kind == task.uas[v].kind
            if same and u != v:
                for w in range(task.turn.shape[1]):
                    if task.turn[u, w] != task.turn[v, w]:
                        same = False
                        break
            identical[u, v] = same
    shape = (n_uas, width)
    onward, backward, turns = np.zeros(shape), np.zeros(shape), np.zeros(shape)
    return Sums(onward, backward, turns, identical, np.zeros(n_uas, np.int64))


@inlined_kernel
def sum_up(task, sums, u, route, length):
    """Write the sums of one route."""
    kind = task.uas[u].kind
    n_waypoints = task.release.shape[1]
    home = n_waypoints + len(task.uas) + u
    before, waits = n_waypoints + u, 0
    legs, back, turns = 0.0, 0.0, 0.0
    for k in range(length):
        here = route[k]
        if not task.is_released[here]:
            waits += 1
        if k > 0:
            legs += task.between[kind, before, here]
            back += task.between[kind, here, before]
        following = route[k + 1] if k + 1 < length else home
        turns += turn_s(task, u, before, here, following)
        sums.onward[u, k], sums.backward[u, k], sums.turns[u, k] = legs, back, turns
        before = here
    sums.waits[u] = waits


@inlined_kernel
def add_piece(pieces, n, row, first, last, backward):
    """Add the places `first` to `last` of a row to a list of pieces; how many there are then."""
    if last < first:
        return n
    pieces[n, ROW], pieces[n, FIRST], pieces[n, LAST] = row, first, last
    pieces[n, BACKWARD] = backward
    return n + 1


@inlined_kernel
def joined(routes, pieces, n, out):
    """Write the route that pieces make; its length."""
    length = 0
    for p in range(n):
        row, first, last = pieces[p, ROW], pieces[p, FIRST], pieces[p, LAST]
        for k in range(last - first + 1):
            out[length] = routes[row, last - k] if pieces[p, BACKWARD] else routes[row, first + k]
            length += 1
    return length


@inlined_kernel
def pieces_s(task, sums, u, routes, pieces, n):
    """Flight time of one UAS along pieces and home; nothing in them has a release date."""
    uas = task.uas[u]
    if n == 0:
        return uas.idle_s
    kind, place, n_waypoints, n_uas = uas.kind, task.place, task.release.shape[1], len(task.uas)
    before, here, time = n_waypoints + u, -1, 0.0
    for p in range(n):
        row, low, high = pieces[p, ROW], pieces[p, FIRST], pieces[p, LAST]
        step = -1 if pieces[p, BACKWARD] else 1
        at, end = (high, low) if step < 0 else (low, high)
        following = routes[row, at]
        if here < 0:
            time += task.first[u, following]
            time += setting_off_s(
                uas, place[following, 0] - place[before, 0], place[following, 1] - place[before, 1]
            )
        else:
            time += turn_s(task, u, before, here, following)
            time += task.between[kind, here, following]
            before = here
        here = following
        if at == end:
            continue
        following = routes[row, at + step]
        time += turn_s(task, u, before, here, following)
        if row < n_uas and sums.identical[u, row]:
            legs = sums.backward if step < 0 else sums.onward
            time += legs[row, high] - legs[row, low]
            time += sums.turns[row, high - 1] - sums.turns[row, low]
            before, here = routes[row, end - step], routes[row, end]
            continue
        while at != end:
            time += task.between[kind, here, following]
            before, here = here, following
            at += step
            if at != end:
                following = routes[row, at + step]
                time += turn_s(task, u, before, here, following)
    home = n_waypoints + n_uas + u
    time += turn_s(task, u, before, here, home)
    return time + task.home[u, here]
