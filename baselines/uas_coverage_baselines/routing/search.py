"""Order search: simulated annealing over the routes of all UAS, in compiled code.

A routing library's arc costs cannot hold what a turn costs, nor a waypoint that opens late, nor
that the longest flight counts most; an evaluated route can, and evaluating one takes well below a
microsecond. Moves put a waypoint next to a near one: a chain of one to three relocated, a stretch
reversed, the rests of two routes exchanged.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

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
_OVERTIME = 200.0  # cost of a second beyond the budget, in seconds
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
    """

    moves: int
    hottest_s: float = 4.0
    coldest_s: float = 0.05
    window: int = 0
    total_weight: float = 0.4


@dataclass(frozen=True)
class Routes:
    """Who visits what.

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
        grounded = u < U and task.budget_s[u] == -np.inf
        kept = [w for w in route if wanted[w] and not grounded]
        wanted[kept] = False
        routes[u, : len(kept)] = kept
        lengths[u] = len(kept)
    missing = np.flatnonzero(wanted)
    routes[U, lengths[U] : lengths[U] + len(missing)] = missing
    lengths[U] += len(missing)
    # missing waypoints begin as left out and go where they cost least
    arrays = _arrays(task, effort.total_weight)
    _insert_missing(arrays, routes, lengths, missing, effort.total_weight)
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


class _Arrays(NamedTuple):
    """What the search reads of a task, for compiled code."""

    first: FloatArray
    between: FloatArray
    kind: NDArray[np.int64]
    home: FloatArray
    idle: FloatArray
    place: FloatArray
    """(W+2U, 2) of waypoints, UAS and starts, north and east."""
    velocity: FloatArray
    speed: FloatArray
    acceleration: FloatArray
    turn: FloatArray
    opens: FloatArray
    budget: FloatArray
    left_out_s: FloatArray
    neighbours: NDArray[np.int64]
    turn_of_cosine: FloatArray


def _arrays(task: RoutingTask, total_weight: float) -> _Arrays:
    place = np.vstack([task.waypoints_m[:, :2], task.position_m, task.start_m])
    return _Arrays(
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
        opens=task.not_before_s,
        budget=task.budget_s,
        left_out_s=_left_out_s(task, total_weight),
        neighbours=task.neighbours,
        turn_of_cosine=_TURN_OF_COSINE,
    )


@allocating_kernel
def _turn(table, place, a, b, c):
    """Cost in radii of turning at place b on the way from a to c."""
    ax, ay = place[b, 0] - place[a, 0], place[b, 1] - place[a, 1]
    bx, by = place[c, 0] - place[b, 0], place[c, 1] - place[b, 1]
    length = np.sqrt((ax * ax + ay * ay) * (bx * bx + by * by))
    if length < 1e-9:
        return 0.0
    cosine = min(max((ax * bx + ay * by) / length, -1.0), 1.0)
    return table[int(0.5 * (cosine + 1.0) * (len(table) - 1) + 0.5)]


@allocating_kernel
def _setting_off_s(place, velocity, speed_mps, acceleration_mps2, here, to):
    """What is lost until the velocity points to the first waypoint."""
    dx, dy = place[to, 0] - place[here, 0], place[to, 1] - place[here, 1]
    length = np.hypot(dx, dy) + 1e-9
    ax, ay = velocity[0] - speed_mps * dx / length, velocity[1] - speed_mps * dy / length
    return (ax * ax + ay * ay) / (2.0 * acceleration_mps2 * speed_mps)


@allocating_kernel
def _route_s(task, u, route, length):
    """Flight time of one UAS along a route and home."""
    if length == 0:
        return task.idle[u]
    place, kind, opens = task.place, task.kind[u], task.opens
    n_waypoints, n_uas = len(opens), len(task.kind)
    before, here = n_waypoints + u, route[0]
    time = task.first[u, here]
    time += _setting_off_s(
        place, task.velocity[u], task.speed[u], task.acceleration[u], before, here
    )
    time = max(time, opens[here])
    for k in range(1, length + 1):
        following = route[k] if k < length else n_waypoints + n_uas + u
        time += task.turn[u, here] * _turn(task.turn_of_cosine, place, before, here, following)
        if k == length:
            break
        time += task.between[kind, here, following]
        time = max(time, opens[following])
        before, here = here, following
    return time + task.home[u, here]


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
def _put_in(route, length, at, waypoint):
    for k in range(length, at, -1):
        route[k] = route[k - 1]
    route[at] = waypoint


@allocating_kernel
def _insert_missing(task, routes, lengths, missing, total_weight):
    """Give each missing waypoint, taken out of the last row, to the route it lengthens least.

    What makes the longest route longer counts fully, another one's length by its weight.
    """
    n_uas = len(routes) - 1
    seconds = np.empty(n_uas)
    trial = np.empty(routes.shape[1], np.int64)
    for u in range(n_uas):
        seconds[u] = _route_s(task, u, routes[u], lengths[u])
    for waypoint in missing:
        best, best_u, best_at, best_s = np.inf, -1, 0, 0.0
        for u in range(n_uas):
            for at in range(lengths[u] + 1):
                trial[: lengths[u]] = routes[u, : lengths[u]]
                _put_in(trial, lengths[u], at, waypoint)
                new_s = _route_s(task, u, trial, lengths[u] + 1)
                old_s, seconds[u] = seconds[u], new_s
                cost = _cost_s(task, seconds, routes[n_uas], 0, total_weight)
                seconds[u] = old_s
                if cost < best:
                    best, best_u, best_at, best_s = cost, u, at, new_s
        if best_u < 0:  # no UAS may fly
            continue
        _put_in(routes[best_u], lengths[best_u], best_at, waypoint)
        lengths[best_u] += 1
        seconds[best_u] = best_s
        for k in range(lengths[n_uas]):
            if routes[n_uas, k] == waypoint:
                routes[n_uas, k : lengths[n_uas] - 1] = routes[n_uas, k + 1 : lengths[n_uas]].copy()
                lengths[n_uas] -= 1
                break


@allocating_kernel(nogil=True)
def _search(task, routes, lengths, seconds, moves, hottest_s, coldest_s, window, total_weight, rng):
    """Anneal `routes` in place (its last row: left out); the cost of the best, which is returned.

    Args:
        task: `_Arrays` of the task.
        routes: (U+1, W+1).
        lengths: (U+1,).
        seconds: (U,) written: flight times of the best order.
        moves: how many are tried.
        hottest_s: first temperature.
        coldest_s: last temperature.
        window: see `SearchEffort`.
        total_weight: see `SearchEffort`.
        rng: source of random numbers.
    """
    neighbours = task.neighbours
    n_rows, width = routes.shape
    n_uas = n_rows - 1
    row_of, place_in = np.full(width - 1, -1, np.int64), np.zeros(width - 1, np.int64)
    for r in range(n_rows):
        for k in range(lengths[r]):
            row_of[routes[r, k]], place_in[routes[r, k]] = r, k
    for u in range(n_uas):
        seconds[u] = _route_s(task, u, routes[u], lengths[u])
    cost = _cost_s(task, seconds, routes[n_uas], lengths[n_uas], total_weight)
    best, best_routes, best_lengths = cost, routes.copy(), lengths.copy()
    best_seconds, new_seconds = seconds.copy(), seconds.copy()
    one, two = np.empty(2 * width, np.int64), np.empty(2 * width, np.int64)
    for move in range(moves):
        temperature = hottest_s * (coldest_s / hottest_s) ** (move / moves)
        r = rng.integers(0, n_rows)
        reach = lengths[r] if window <= 0 or r == n_uas else min(window, lengths[r])
        if reach == 0:
            continue
        i = rng.integers(0, reach)
        w = routes[r, i]
        # next to what: mostly a near waypoint, sometimes an end of any route
        if neighbours.shape[1] > 0 and rng.random() < 0.95:
            nearest = min(neighbours.shape[1], 10)
            v = neighbours[w, rng.integers(0, nearest)]
            s, j = row_of[v], place_in[v]
            if s < 0:
                continue
        else:
            s = rng.integers(0, n_rows)
            j = rng.integers(0, lengths[s] + 1) - 1
        n_one, n_two = -1, -1
        kind = rng.random()
        if s != r:
            if kind < 0.6 or r == n_uas or s == n_uas:  # relocate a chain
                chain = 1 if r == n_uas else 1 + rng.integers(0, 3)
                chain = min(chain, lengths[r] - i)
                backward, after = rng.random() < 0.5, rng.integers(0, 2)
                n_one, n_two = lengths[r] - chain, lengths[s] + chain
                one[:i] = routes[r, :i]
                one[i:n_one] = routes[r, i + chain : lengths[r]]
                at = min(max(j + after, 0), lengths[s])
                two[:at] = routes[s, :at]
                for k in range(chain):
                    two[at + k] = routes[r, i + chain - 1 - k] if backward else routes[r, i + k]
                two[at + chain : n_two] = routes[s, at : lengths[s]]
            else:  # exchange the rests: w follows v
                at = min(max(j + 1, 0), lengths[s])
                n_one, n_two = i + lengths[s] - at, at + lengths[r] - i
                one[:i] = routes[r, :i]
                one[i:n_one] = routes[s, at : lengths[s]]
                two[:at] = routes[s, :at]
                two[at:n_two] = routes[r, i : lengths[r]]
        elif r < n_uas:
            n_one = lengths[r]
            if kind < 0.5:  # reverse the stretch between
                low, high = min(i, j) + 1, max(i, j)
                if rng.random() < 0.5:
                    low, high = max(min(i, j), 0), max(i, j) - 1
                if high <= low:
                    continue
                one[:n_one] = routes[r, :n_one]
                for k in range(low, high + 1):
                    one[k] = routes[r, low + high - k]
            else:  # relocate a chain within the route
                chain = min(1 + rng.integers(0, 3), lengths[r] - i)
                if i <= j < i + chain:
                    continue
                backward, after = rng.random() < 0.5, rng.integers(0, 2)
                n = 0
                at = j + after
                for k in range(n_one + 1):
                    if k == at:
                        for c in range(chain):
                            one[n] = routes[r, i + chain - 1 - c] if backward else routes[r, i + c]
                            n += 1
                    if k < n_one and not i <= k < i + chain:
                        one[n] = routes[r, k]
                        n += 1
                if n != n_one:
                    continue
        else:
            continue
        for u in range(n_uas):
            new_seconds[u] = seconds[u]
        if r < n_uas:
            new_seconds[r] = _route_s(task, r, one, n_one)
        if n_two >= 0 and s < n_uas:
            new_seconds[s] = _route_s(task, s, two, n_two)
        out, n_out = routes[n_uas], lengths[n_uas]
        if r == n_uas:
            out, n_out = one, n_one
        elif n_two >= 0 and s == n_uas:
            out, n_out = two, n_two
        new = _cost_s(task, new_seconds, out, n_out, total_weight)
        if new > cost and rng.random() >= np.exp((cost - new) / temperature):
            continue
        cost = new
        for u in range(n_uas):
            seconds[u] = new_seconds[u]
        routes[r, :n_one] = one[:n_one]
        lengths[r] = n_one
        for k in range(n_one):
            row_of[one[k]], place_in[one[k]] = r, k
        if n_two >= 0:
            routes[s, :n_two] = two[:n_two]
            lengths[s] = n_two
            for k in range(n_two):
                row_of[two[k]], place_in[two[k]] = s, k
        if cost < best - 1e-9:
            best = cost
            best_routes[:] = routes
            best_lengths[:] = lengths
            best_seconds[:] = seconds
    routes[:] = best_routes
    lengths[:] = best_lengths
    seconds[:] = best_seconds
    return best
