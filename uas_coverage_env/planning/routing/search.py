"""Order search: simulated annealing over the routes of all UAS.

A routing library's arc costs cannot hold what a turn costs, nor a waypoint that opens late, nor
that the longest flight counts most; an evaluated route can, and evaluating one takes well below a
microsecond. Moves put a waypoint next to a near one: a chain of one to three relocated, a stretch
reversed, the rests of two routes exchanged.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.planning.routing.annealing import State, anneal, insert_missing
from uas_coverage_env.planning.routing.route_time import RoutingArrays
from uas_coverage_env.planning.routing.task import FLOWN_BY, RoutingTask

FloatArray = NDArray[np.float64]

# what turning at a waypoint costs, in times to fly its radius: a flight that turns cuts through
# the sphere, but brakes. Calibrated on flights of `milp-mpc-guided` past spheres of 15 m at 12 m/s
_TURN_DEG = np.array([0.0, 45.0, 90.0, 135.0, 180.0])
_TURN_RADII = np.array([0.0, -0.3, -0.45, 0.1, 1.5])
_TURN_STEPS = 256
_TURN_OF_COSINE = np.interp(
    np.degrees(np.arccos(np.linspace(-1.0, 1.0, _TURN_STEPS + 1))), _TURN_DEG, _TURN_RADII
)
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
        total_weight: worth of a second of any flight against one of the longest.
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
        trips: (U) what each UAS visits with fresh packs later, a route for each (`improve_trips`);
            empty where nothing is planned for later.
        mission_s: with `trips`, when the last UAS has flown all of its flights; else 0.
    """

    routes: tuple[NDArray[np.int64], ...]
    left_out: NDArray[np.int64]
    seconds: FloatArray
    cost_s: float
    left_out_s: float = 0.0
    trips: tuple[tuple[NDArray[np.int64], ...], ...] = ()
    mission_s: float = 0.0

    @property
    def later(self) -> NDArray[np.int64]:
        """Waypoints of all trips."""
        return np.concatenate([np.zeros(0, np.int64), *(w for trips in self.trips for w in trips)])


def empty_routes(n_uas: int) -> Routes:
    """No UAS visits anything: where a search begins."""
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
    search = OrderSearch(task, order, effort, seed)
    search.go_on(effort.moves)
    return search.best


class OrderSearch:
    """A search for a better order, which may be made in parts: it goes on where it stopped.

    Args:
        task: the routing problem.
        order: where to begin; visited waypoints are dropped from it, missing ones added.
        effort: how much to search.
        seed: of the search.
    """

    def __init__(self, task: RoutingTask, order: Routes, effort: SearchEffort, seed: int) -> None:
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
        self._arrays = _arrays(task, effort.total_weight)
        insert_missing(
            self._arrays, routes, lengths, missing, effort.total_weight, effort.by_pieces
        )
        self._now = State(routes, lengths, np.empty(U), np.full(1, np.inf))
        self._best = State(routes.copy(), lengths.copy(), np.empty(U), np.full(1, np.inf))
        self._effort, self._tried = effort, 0
        self._moves = effort.moves if len(task.open_waypoints) else 0
        self._rng = np.random.default_rng(seed)
        self.go_on(0)

    @property
    def is_over(self) -> bool:
        """Whether all changes were tried."""
        return self._tried >= self._moves

    def go_on(self, moves: int) -> None:
        """Try some more changes, at most so many."""
        effort, end = self._effort, min(self._tried + moves, self._moves)
        anneal(
            self._arrays,
            self._now,
            self._best,
            self._tried,
            end,
            self._moves,
            effort.hottest_s,
            effort.coldest_s,
            effort.window,
            effort.total_weight,
            effort.by_pieces,
            self._rng,
        )
        self._tried = end

    @property
    def best(self) -> Routes:
        """The best order so far."""
        routes, lengths, seconds, cost_s = self._best
        *each, left_out = [route[:n].copy() for route, n in zip(routes, lengths, strict=True)]
        return Routes(
            tuple(each),
            left_out,
            seconds.copy(),
            float(cost_s[0]),
            float(self._arrays.left_out_s[left_out].sum()),
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
    if task.packs is not None:  # when a later flight takes off, everything is taken to be open
        uas = task.packs[:, FLOWN_BY]
        opens_s[1:][uas[1:] == uas[:-1]] = 0.0
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
        motion=np.column_stack([task.velocity_mps, task.speed_mps, task.acceleration_mps2]),
        turn=task.turn_s,
        opens=opens_s,
        opens_late=np.any(opens_s > 0.0, axis=0),
        budget=task.budget_s,
        left_out_s=_left_out_s(task, total_weight),
        neighbours=task.neighbours,
        turn_of_cosine=turning,
        packs=np.zeros((0, 3)) if task.packs is None else task.packs,
    )
