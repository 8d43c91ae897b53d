"""Flight times of routes: of a whole one, and of one made of pieces of others in constant time."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.compiled.kernels import allocating_kernel, inlined_kernel

FloatArray = NDArray[np.float64]


V_NORTH, V_EAST, CRUISE, ACCELERATION = range(4)
"""Columns of `RoutingArrays.motion`."""

ROW, FIRST, LAST, BACKWARD = range(4)
"""Columns of a list of pieces: places FIRST to LAST of a row of routes, in turn or backward."""


class RoutingArrays(NamedTuple):
    """What the search reads of a task, for compiled code."""

    first: FloatArray
    between: FloatArray
    kind: NDArray[np.int64]
    home: FloatArray
    idle: FloatArray
    place: FloatArray
    """(W+2U, 2) of waypoints, UAS and starts, north and east."""
    motion: FloatArray
    """(U, 4) velocity to the north and east, cruising speed, and acceleration, see `V_NORTH`."""
    turn: FloatArray
    opens: FloatArray
    """(U, W) from when on each UAS may visit."""
    opens_late: NDArray[np.bool_]
    """(W,) not at any time by every UAS."""
    budget: FloatArray
    left_out_s: FloatArray
    neighbours: NDArray[np.int64]
    turn_of_cosine: FloatArray
    packs: FloatArray
    """(U, 3) which UAS flies what, how long it is on the ground before, and what another flight
    costs after this one without a visit; of none where each UAS flies once. Kernels pay for every
    array that they hand on, so these are one."""


@inlined_kernel
def turn_radii(table, place, a, b, c):
    """Cost in radii of turning at place b on the way from a to c."""
    ax, ay = place[b, 0] - place[a, 0], place[b, 1] - place[a, 1]
    bx, by = place[c, 0] - place[b, 0], place[c, 1] - place[b, 1]
    length = np.sqrt((ax * ax + ay * ay) * (bx * bx + by * by))
    if length < 1e-9:
        return 0.0
    cosine = min(max((ax * bx + ay * by) / length, -1.0), 1.0)
    return table[int(0.5 * (cosine + 1.0) * (len(table) - 1) + 0.5)]


@inlined_kernel
def setting_off_s(place, motion, u, here, to):
    """What is lost until the velocity points to the first waypoint."""
    dx, dy = place[to, 0] - place[here, 0], place[to, 1] - place[here, 1]
    length = np.hypot(dx, dy) + 1e-9
    speed_mps, acceleration_mps2 = motion[u, CRUISE], motion[u, ACCELERATION]
    ax = motion[u, V_NORTH] - speed_mps * dx / length
    ay = motion[u, V_EAST] - speed_mps * dy / length
    return (ax * ax + ay * ay) / (2.0 * acceleration_mps2 * speed_mps)


@inlined_kernel
def route_s(task, u, route, length):
    """Flight time of one UAS along a route and home."""
    if length == 0:
        return task.idle[u]
    place, kind, opens = task.place, task.kind[u], task.opens[u]
    n_waypoints, n_uas = len(opens), len(task.kind)
    before, here = n_waypoints + u, route[0]
    time = task.first[u, here]
    time += setting_off_s(place, task.motion, u, before, here)
    time = max(time, opens[here])
    for k in range(1, length + 1):
        following = route[k] if k < length else n_waypoints + n_uas + u
        time += task.turn[u, here] * turn_radii(task.turn_of_cosine, place, before, here, following)
        if k == length:
            break
        time += task.between[kind, here, following]
        time = max(time, opens[following])
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
    twins: NDArray[np.bool_]
    """(U, U) whether legs and turns take both UAS the same time."""
    late: NDArray[np.int64]
    """(U,) waypoints that open late: with these a stretch is no difference."""


@allocating_kernel
def sums_of(task, n_uas, width):
    """Sums of empty routes, for `width` waypoints."""
    twins = np.zeros((n_uas, n_uas), np.bool_)
    for u in range(n_uas):
        for v in range(n_uas):
            same = task.kind[u] == task.kind[v]
            if same and u != v:
                for w in range(task.turn.shape[1]):
                    if task.turn[u, w] != task.turn[v, w]:
                        same = False
                        break
            twins[u, v] = same
    shape = (n_uas, width)
    return Sums(np.zeros(shape), np.zeros(shape), np.zeros(shape), twins, np.zeros(n_uas, np.int64))


@inlined_kernel
def sum_up(task, sums, u, route, length):
    """Write the sums of one route."""
    place, kind = task.place, task.kind[u]
    n_waypoints = task.opens.shape[1]
    home = n_waypoints + len(task.kind) + u
    before, late = n_waypoints + u, 0
    legs, back, turns = 0.0, 0.0, 0.0
    for k in range(length):
        here = route[k]
        if task.opens_late[here]:
            late += 1
        if k > 0:
            legs += task.between[kind, before, here]
            back += task.between[kind, here, before]
        following = route[k + 1] if k + 1 < length else home
        turns += task.turn[u, here] * turn_radii(
            task.turn_of_cosine, place, before, here, following
        )
        sums.onward[u, k], sums.backward[u, k], sums.turns[u, k] = legs, back, turns
        before = here
    sums.late[u] = late


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
    """Flight time of one UAS along pieces and home; nothing in them opens late."""
    if n == 0:
        return task.idle[u]
    place, table, kind = task.place, task.turn_of_cosine, task.kind[u]
    n_waypoints, n_uas = task.opens.shape[1], len(task.kind)
    before, here, time = n_waypoints + u, -1, 0.0
    for p in range(n):
        row, low, high = pieces[p, ROW], pieces[p, FIRST], pieces[p, LAST]
        step = -1 if pieces[p, BACKWARD] else 1
        at, end = (high, low) if step < 0 else (low, high)
        following = routes[row, at]
        if here < 0:
            time += task.first[u, following]
            time += setting_off_s(place, task.motion, u, before, following)
        else:
            time += task.turn[u, here] * turn_radii(table, place, before, here, following)
            time += task.between[kind, here, following]
            before = here
        here = following
        if at == end:
            continue
        following = routes[row, at + step]
        time += task.turn[u, here] * turn_radii(table, place, before, here, following)
        if row < n_uas and sums.twins[u, row]:
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
                time += task.turn[u, here] * turn_radii(table, place, before, here, following)
    home = n_waypoints + n_uas + u
    time += task.turn[u, here] * turn_radii(table, place, before, here, home)
    return time + task.home[u, here]
