"""Coverage cost coefficients that look beyond the horizon.

A receding horizon skims rows of waypoints and leaves single ones behind that cost a long way
later. The paper lets the coefficients W_Phi be adjusted to prioritise waypoints (Sec. III-C.5);
here a waypoint gains by the seconds of flight it takes off the shortest tree that connects what
is open: much at the fringe of the open set, nothing in its middle.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.compiled.kernels import allocating_kernel

FloatArray = NDArray[np.float64]


def seconds_saved(
    open_waypoints_m: FloatArray, speed_mps: float, rows: NDArray[np.int64]
) -> FloatArray:
    """(K,) by how much the tree of the open waypoints shrinks when each one is covered [s].

    The shortest tree without a waypoint keeps every edge of the whole tree that does not end at
    it (an edge that is the shortest across a cut stays so when a point is taken out). So what a
    waypoint saves is the length of its own edges, less that of the shortest edges that join the
    branches it leaves behind; a leaf leaves one branch and saves its edge. Only the smaller
    branches are searched for such edges, in a strip as wide as the shortest edge known, so that a
    thousand waypoints take some milliseconds.

    Args:
        open_waypoints_m: (W, 3), distinct.
        speed_mps: at which the tree is flown.
        rows: (K,) the waypoints to say it of.
    """
    if len(open_waypoints_m) < 2:
        return np.zeros(len(rows))
    places = open_waypoints_m[:, :2]
    along = int(np.argmax(np.ptp(places, axis=0)))
    order = np.argsort(places[:, along], kind="stable")
    rank = np.empty(len(order), np.int64)
    rank[order] = np.arange(len(order))
    saved_m = _saved_m(np.ascontiguousarray(places[order]), along, rank[rows])
    return np.maximum(saved_m / speed_mps, 0.0)


@allocating_kernel(nogil=True)
def _squared_m2(places, i, j):
    north, east = places[i, 0] - places[j, 0], places[i, 1] - places[j, 1]
    return north * north + east * east


@allocating_kernel(nogil=True)
def _parents(places):
    """The shortest tree, grown from place 0: the order in which places join, and their parents."""
    W = len(places)
    joined, parent = np.zeros(W, np.int64), np.full(W, -1)
    squared = np.full(W, np.inf)
    waiting = np.arange(1, W)
    for n in range(1, W):
        nearest = 0
        for k in range(W - n):
            w = waiting[k]
            away = _squared_m2(places, joined[n - 1], w)
            if away < squared[w]:
                squared[w], parent[w] = away, joined[n - 1]
            if squared[w] < squared[waiting[nearest]]:
                nearest = k
        joined[n] = waiting[nearest]
        waiting[nearest] = waiting[W - n - 1]
    return joined, parent


@allocating_kernel(nogil=True)
def _preorder(joined, parent):
    """Places such that every subtree is a slice: (W,) places, (W,) begin and end of each slice."""
    W = len(joined)
    size = np.ones(W, np.int64)
    for w in joined[:0:-1]:
        size[parent[w]] += size[w]
    first, room = np.zeros(W, np.int64), np.ones(W, np.int64)
    places_in_order = np.zeros(W, np.int64)
    for w in joined[1:]:
        first[w] = first[parent[w]] + room[parent[w]]
        room[parent[w]] += size[w]
        places_in_order[first[w]] = w
    return places_in_order, first, first + size


@allocating_kernel(nogil=True)
def _saved_m(places, along, rows):
    """(K,) what the places `rows` save; the places are sorted by their coordinate `along`."""
    W = len(places)
    joined, parent = _parents(places)
    in_order, first, last = _preorder(joined, parent)
    edge_m, saved, degree = np.zeros(W), np.zeros(W), np.zeros(W, np.int64)
    for w in joined[1:]:
        edge_m[w] = np.sqrt(_squared_m2(places, w, parent[w]))
        saved[w] += edge_m[w]
        saved[parent[w]] += edge_m[w]
        degree[w] += 1
        degree[parent[w]] += 1
    # the branches around each place: those of its children, then the rest of the tree
    roots, filled = np.empty((W, degree.max()), np.int64), np.zeros(W, np.int64)
    for w in joined[1:]:
        roots[parent[w], filled[parent[w]]] = w
        filled[parent[w]] += 1
    for w in joined[1:]:
        roots[w, filled[w]] = parent[w]
    for w in rows:
        if degree[w] > 1:
            around = roots[w, : degree[w]]
            saved[w] -= _reconnected_m(places, along, w, around, in_order, first, last)
    return saved[rows]


@allocating_kernel(nogil=True)
def _branch_of(place, children, first, last):
    """Number of the child whose subtree holds the place; one more where none does."""
    for number in range(len(children)):
        if first[children[number]] <= first[place] < last[children[number]]:
            return number
    return len(children)


@allocating_kernel(nogil=True)
def _reconnected_m(places, along, taken, roots, in_order, first, last):
    """Length of the edges that join the branches of the tree once `taken` is out of it."""
    W, count = len(places), len(roots)
    from_parent = first[taken] > 0
    children = roots[: count - 1] if from_parent else roots
    squared = np.empty((count, count))
    for j in range(count):
        for k in range(count):
            squared[j, k] = _squared_m2(places, roots[j], roots[k])
    largest, most = count - 1, W - (last[taken] - first[taken]) if from_parent else 0
    for number in range(len(children)):
        size = last[children[number]] - first[children[number]]
        if size > most:
            largest, most = number, size
    # of two branches one is not the largest: what joins them is found from there
    for mine in range(count):
        if mine == largest:
            continue
        outside = mine == len(children)
        begin, end = (0, W) if outside else (first[roots[mine]], last[roots[mine]])
        for position in range(begin, end):
            if not outside or not first[taken] <= position < last[taken]:
                w = in_order[position]
                for side in (-1, 1):
                    _scan_side(places, along, w, side, taken, mine, children, first, last, squared)
    return _tree_m(squared)


@allocating_kernel(nogil=True)
def _scan_side(places, along, w, side, taken, mine, children, first, last, squared):
    """Shorten what joins branch `mine` to others by edges from one of its places to one side."""
    farthest = squared[mine].max()
    other = w + side
    while 0 <= other < len(places):
        ahead = places[other, along] - places[w, along]
        if ahead * ahead >= farthest:
            return
        away = _squared_m2(places, w, other)
        if away < farthest and other != taken:
            theirs = _branch_of(other, children, first, last)
            if theirs != mine and away < squared[mine, theirs]:
                squared[mine, theirs] = squared[theirs, mine] = away
                farthest = squared[mine].max()
        other += side


@allocating_kernel(nogil=True)
def _tree_m(squared):
    """Length of the shortest tree over a few branches."""
    count = len(squared)
    nearest = squared[0].copy()
    waiting = np.ones(count, np.bool_)
    waiting[0] = False
    length = 0.0
    for _ in range(count - 1):
        following = -1
        for k in range(count):
            if waiting[k] and (following < 0 or nearest[k] < nearest[following]):
                following = k
        waiting[following] = False
        length += np.sqrt(nearest[following])
        for k in range(count):
            nearest[k] = min(nearest[k], squared[following, k])
    return length
