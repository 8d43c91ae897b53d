"""Order search: simulated annealing over the routes of all UAS, in compiled code.

A routing library's arc costs cannot hold what a turn costs, nor a waypoint that opens late, nor
that the longest flight counts most; an evaluated route can, and evaluating one takes well below a
microsecond. Moves put a waypoint next to a near one: a chain of one to three relocated, a stretch
reversed, the rests of two routes exchanged.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from uas_coverage_baselines.routing.route_time import (
    RoutingArrays,
    add_piece,
    joined,
    pieces_s,
    route_s,
    sum_up,
    sums_of,
)
from uas_coverage_baselines.routing.task import RoutingTask
from uas_coverage_env.compiled.kernels import allocating_kernel

FloatArray = NDArray[np.float64]

# what turning at a waypoint costs, in times to fly its radius: a flight that turns cuts through
# the sphere, but brakes. Calibrated on flights of `milp-mpc-guided` past spheres of 15 m at 12 m/s
_TURN_DEG = np.array([0.0, 45.0, 90.0, 135.0, 180.0])
_TURN_RADII = np.array([0.0, -0.3, -0.45, 0.1, 1.5])
_TURN_STEPS = 256
_TURN_OF_COSINE = np.interp(
    np.degrees(np.arccos(np.linspace(-1.0, 1.0, _TURN_STEPS + 1))), _TURN_DEG, _TURN_RADII
)
_SAME_TEMPERATURE = 64  # moves
_OVERTIME = 200.0  # cost of a second beyond the budget, in seconds
_BARRED_S = 1e5  # later than any battery lasts
_LEFT_OUT_S = 120.0  # cost of leaving out a waypoint of weight 1, beyond that of a visit


@dataclass(frozen=True)
class SearchEffort:
    """How much to search.

    Attributes:
        moves: how many are tried.
        hottest_s: temperature at the beginning; worse orders by about this much are accepted.
        coldest_s: temperature at the end.
        window: only the first so many waypoints of each route are moved; 0 for all.
        total_weight: worth of a second of anybody's flight against one of the longest.
        by_pieces: whether a change is judged by sums along the routes, which takes the same time
            however long they are, and rounds otherwise: another order may come of it.
    """

    moves: int
    hottest_s: float = 4.0
    coldest_s: float = 0.05
    window: int = 0
    total_weight: float = 0.4
    by_pieces: bool = False


@dataclass(frozen=True)
class Routes:
    """Which UAS visits what.

    Attributes:
        routes: (U) waypoints of each UAS in the order of their visit.
        left_out: waypoints that no battery reaches.
        seconds: (U,) estimated flight time of each.
        cost_s: what the search minimises.
        left_out_s: what is left out contributes to that.
    """

    routes: tuple[NDArray[np.int64], ...]
    left_out: NDArray[np.int64]
    seconds: FloatArray
    cost_s: float
    left_out_s: float = 0.0


def empty_routes(n_uas: int) -> Routes:
    """Nobody visits anything: where a search begins."""
    nothing = np.zeros(0, np.int64)
    return Routes((nothing,) * n_uas, nothing, np.zeros(n_uas), np.inf)


def improve_routes(task: RoutingTask, order: Routes, effort: SearchEffort, seed: int) -> Routes:
    """The best order found from a given one; the same arguments give the same order.

    Args:
        task: the routing problem.
        order: where to begin; visited waypoints are dropped from it, missing ones added.
        effort: how much to search.
        seed: of the search.

    Returns:
        An order that visits every open waypoint once or leaves it out, never worse than `order`.
    """
    U, W = task.n_uas, task.n_waypoints
    routes = np.full((U + 1, W + 1), -1, np.int64)
    lengths = np.zeros(U + 1, np.int64)
    wanted = np.zeros(W, bool)
    wanted[task.open_waypoints] = True
    for u, route in enumerate((*order.routes, order.left_out)):
        allowed = wanted
        if u < U and task.budget_s[u] == -np.inf:
            allowed = np.zeros(W, bool)
        elif u < U and task.barred is not None:
            allowed = wanted & ~task.barred[u]
        kept = [w for w in route if allowed[w]]
        wanted[kept] = False
        routes[u, : len(kept)] = kept
        lengths[u] = len(kept)
    missing = np.flatnonzero(wanted)
    routes[U, lengths[U] : lengths[U] + len(missing)] = missing
    lengths[U] += len(missing)
    # missing waypoints begin as left out and go where they cost least
    arrays = _arrays(task, effort.total_weight)
    _insert_missing(arrays, routes, lengths, missing, effort.total_weight, effort.by_pieces)
    seconds = np.empty(U)
    cost = _search(
        arrays,
        routes,
        lengths,
        seconds,
        effort.moves if len(task.open_waypoints) else 0,
        effort.hottest_s,
        effort.coldest_s,
        effort.window,
        effort.total_weight,
        effort.by_pieces,
        np.random.default_rng(seed),
    )
    left_out = routes[U, : lengths[U]].copy()
    return Routes(
        tuple(routes[u, : lengths[u]].copy() for u in range(U)),
        left_out,
        seconds,
        float(cost),
        float(arrays.left_out_s[left_out].sum()),
    )


def _left_out_s(task: RoutingTask, total_weight: float) -> FloatArray:
    """(W,) what it costs to leave out each waypoint: more than for some UAS to fly there first."""
    may_fly = task.budget_s > -np.inf
    there_s = (task.first_s + task.home_s - task.idle_s[:, None])[may_fly]
    visit_s = np.min(there_s, axis=0, initial=np.inf)
    visit_s = np.where(np.isfinite(visit_s), np.maximum(visit_s, 0.0), 0.0) + task.not_before_s
    return _LEFT_OUT_S * task.weight + (1.0 + total_weight) * visit_s


def _opens_s(task: RoutingTask) -> FloatArray:
    """(U, W) from when on each UAS may visit, beyond every budget where it must not at all."""
    opens_s = np.tile(task.not_before_s, (task.n_uas, 1))
    if task.barred is not None:
        opens_s[task.barred] = _BARRED_S
    return opens_s


def _arrays(task: RoutingTask, total_weight: float) -> RoutingArrays:
    turning = _TURN_OF_COSINE if task.turn_of_cosine is None else task.turn_of_cosine
    place = np.vstack([task.waypoints_m[:, :2], task.position_m, task.start_m])
    opens_s = _opens_s(task)
    return RoutingArrays(
        first=task.first_s,
        between=task.between_s,
        kind=task.kind,
        home=task.home_s,
        idle=task.idle_s,
        place=np.ascontiguousarray(place),
        velocity=task.velocity_mps,
        speed=task.speed_mps,
        acceleration=task.acceleration_mps2,
        turn=task.turn_s,
        opens=opens_s,
        opens_late=np.any(opens_s > 0.0, axis=0),
        budget=task.budget_s,
        left_out_s=_left_out_s(task, total_weight),
        neighbours=task.neighbours,
        turn_of_cosine=turning,
    )


@allocating_kernel
def _cost_s(task, seconds, left_out, n_left_out, total_weight):
    budget, left_out_s = task.budget, task.left_out_s
    longest, cost = 0.0, 0.0
    for u in range(len(seconds)):
        longest = max(longest, seconds[u])
        cost += total_weight * seconds[u]
        if seconds[u] > max(budget[u], 0.0):  # a UAS that may not fly costs nothing where it stays
            cost += _OVERTIME * (seconds[u] - budget[u])
    for k in range(n_left_out):
        cost += left_out_s[left_out[k]]
    return cost + longest


@allocating_kernel
def _insert_missing(task, routes, lengths, missing, total_weight, by_pieces):
    """Give each missing waypoint, taken out of the last row, to the route it lengthens least.

    What makes the longest route longer counts fully, another one's length by its weight.
    """
    n_uas, width = len(routes) - 1, routes.shape[1]
    seconds = np.empty(n_uas)
    trial, pieces = np.empty(width, np.int64), np.empty((3, 4), np.int64)
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
            quick = by_pieces and sums.late[u] == 0 and not task.opens_late[waypoint]
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
                cost = _cost_s(task, seconds, routes[n_uas], 0, total_weight)
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
def _below(rng, n, quick):
    """A random number in 0..n-1; the quick one is not to be told from the exact one."""
    return int(rng.random() * n) if quick else rng.integers(0, n)


@allocating_kernel(nogil=True)
def _search(
    task,
    routes,
    lengths,
    seconds,
    moves,
    hottest_s,
    coldest_s,
    window,
    total_weight,
    by_pieces,
    rng,
):
    """Anneal `routes` in place (its last row: left out); the cost of the best, which is returned.

    Args:
        task: `RoutingArrays` of the task.
        routes: (U+1, W+1).
        lengths: (U+1,).
        seconds: (U,) written: flight times of the best order.
        moves: how many are tried.
        hottest_s: first temperature.
        coldest_s: last temperature.
        window: see `SearchEffort`.
        total_weight: see `SearchEffort`.
        by_pieces: see `SearchEffort`.
        rng: source of random numbers.
    """
    neighbours = task.neighbours
    n_rows, width = routes.shape
    n_uas = n_rows - 1
    row_of, place_in = np.full(width - 1, -1, np.int64), np.zeros(width - 1, np.int64)
    for r in range(n_rows):
        for k in range(lengths[r]):
            row_of[routes[r, k]], place_in[routes[r, k]] = r, k
    sums = sums_of(task, n_uas if by_pieces else 0, width)
    for u in range(n_uas):
        seconds[u] = route_s(task, u, routes[u], lengths[u])
        if by_pieces:
            sum_up(task, sums, u, routes[u], lengths[u])
    cost = _cost_s(task, seconds, routes[n_uas], lengths[n_uas], total_weight)
    best, best_routes, best_lengths = cost, routes.copy(), lengths.copy()
    best_seconds = seconds.copy()
    one, two = np.empty(2 * width, np.int64), np.empty(2 * width, np.int64)
    ours, theirs = np.empty((4, 4), np.int64), np.empty((4, 4), np.int64)
    temperature = hottest_s
    for move in range(moves):
        if move % _SAME_TEMPERATURE == 0 or not by_pieces:
            temperature = hottest_s * (coldest_s / hottest_s) ** (move / moves)
        r = _below(rng, n_rows, by_pieces)
        reach = lengths[r] if window <= 0 or r == n_uas else min(window, lengths[r])
        if reach == 0:
            continue
        i = _below(rng, reach, by_pieces)
        w = routes[r, i]
        # next to what: mostly a near waypoint, sometimes an end of any route
        if neighbours.shape[1] > 0 and rng.random() < 0.95:
            nearest = min(neighbours.shape[1], 10)
            v = neighbours[w, _below(rng, nearest, by_pieces)]
            s, j = row_of[v], place_in[v]
            if s < 0:
                continue
        else:
            s = _below(rng, n_rows, by_pieces)
            j = _below(rng, lengths[s] + 1, by_pieces) - 1
        kind = rng.random()
        n, m = 0, -1
        if s != r:
            if kind < 0.6 or r == n_uas or s == n_uas:  # relocate a chain
                chain = 1 if r == n_uas else 1 + _below(rng, 3, by_pieces)
                chain = min(chain, lengths[r] - i)
                backward, after = rng.random() < 0.5, _below(rng, 2, by_pieces)
                at = min(max(j + after, 0), lengths[s])
                n = add_piece(ours, 0, r, 0, i - 1, 0)
                n = add_piece(ours, n, r, i + chain, lengths[r] - 1, 0)
                m = add_piece(theirs, 0, s, 0, at - 1, 0)
                m = add_piece(theirs, m, r, i, i + chain - 1, int(backward))
                m = add_piece(theirs, m, s, at, lengths[s] - 1, 0)
            else:  # exchange the rests: w follows v
                at = min(max(j + 1, 0), lengths[s])
                n = add_piece(ours, 0, r, 0, i - 1, 0)
                n = add_piece(ours, n, s, at, lengths[s] - 1, 0)
                m = add_piece(theirs, 0, s, 0, at - 1, 0)
                m = add_piece(theirs, m, r, i, lengths[r] - 1, 0)
        elif r < n_uas:
            if kind < 0.5:  # reverse the stretch between
                low, high = min(i, j) + 1, max(i, j)
                if rng.random() < 0.5:
                    low, high = max(min(i, j), 0), max(i, j) - 1
                if high <= low:
                    continue
                n = add_piece(ours, 0, r, 0, low - 1, 0)
                n = add_piece(ours, n, r, low, high, 1)
                n = add_piece(ours, n, r, high + 1, lengths[r] - 1, 0)
            else:  # relocate a chain within the route
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
        quick = by_pieces and r < n_uas and s < n_uas and sums.late[r] + sums.late[s] == 0
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
        new = _cost_s(task, seconds, out, n_out, total_weight)
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
        routes[r, :n_one] = one[:n_one]
        lengths[r] = n_one
        for k in range(n_one):
            row_of[one[k]], place_in[one[k]] = r, k
        if by_pieces and r < n_uas:
            sum_up(task, sums, r, routes[r], n_one)
        if m >= 0:
            routes[s, :n_two] = two[:n_two]
            lengths[s] = n_two
            for k in range(n_two):
                row_of[two[k]], place_in[two[k]] = s, k
            if by_pieces and s < n_uas:
                sum_up(task, sums, s, routes[s], n_two)
        if cost < best - 1e-9:
            best = cost
            for row in range(n_rows):
                best_routes[row, : lengths[row]] = routes[row, : lengths[row]]
            best_lengths[:] = lengths
            best_seconds[:] = seconds
    for row in range(n_rows):
        routes[row, : best_lengths[row]] = best_routes[row, : best_lengths[row]]
    lengths[:] = best_lengths
    seconds[:] = best_seconds
    return best
