"""Order search: simulated annealing over the routes of all UAS.

A routing library's arc costs cannot hold what a turn costs, nor that the longest flight counts
most; an evaluated route can, and evaluating one takes well below a microsecond. Moves put a
waypoint next to a near one; which kinds of moves are tried is up to `SearchEffort.operators`.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.planning.routing.annealing import Schedule, State, anneal, insert_missing
from uas_coverage_env.planning.routing.problem import RoutingProblem
from uas_coverage_env.planning.routing.route_time import RoutingArrays

FloatArray = NDArray[np.float64]

_FORBIDDEN_S = 1e5  # later than any battery lasts
_LEFT_OUT_S = 120.0  # cost of leaving out a waypoint of weight 1, beyond that of a visit
_REPORTED_EVERY = 1024  # moves; a multiple of those at one temperature

RELOCATE, TWO_OPT_STAR, TWO_OPT, OR_OPT = OPERATORS = "relocate", "2-opt*", "2-opt", "or-opt"
"""Moves: a chain of one to three waypoints to another route; the tails of two routes exchanged; a
stretch of a route reversed; a chain to another place in its route. Without `RELOCATE` what is left
out stays so, but where it is inserted to begin with."""

_FIRST_SHARE = 0.6, 0.5  # of relocated chains between routes, of reversals within one


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
        operators: kinds of moves that are tried, of `OPERATORS`.

    Raises:
        ValueError: there is no such operator.
    """

    moves: int
    hottest_s: float = 4.0
    coldest_s: float = 0.05
    window: int = 0
    total_weight: float = 0.4
    by_pieces: bool = False
    operators: tuple[str, ...] = OPERATORS

    def __post_init__(self) -> None:
        """Check the names of the operators."""
        unknown = [name for name in self.operators if name not in OPERATORS]
        if unknown:
            raise ValueError(f"operators: {unknown[0]!r} is none of {', '.join(OPERATORS)}")

    @property
    def schedule(self) -> Schedule:
        """For compiled code."""
        chances: list[float] = []
        for (first, second), share in zip(
            (OPERATORS[:2], OPERATORS[2:]), _FIRST_SHARE, strict=True
        ):
            upto = share if second in self.operators else 1.0
            chances.append(upto if first in self.operators else 0.0)
            chances.append(1.0 if second in self.operators else chances[-1])
        return Schedule(
            self.moves,
            self.hottest_s,
            self.coldest_s,
            self.window,
            self.total_weight,
            self.by_pieces,
            *chances,
        )


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


def routes_of(routes: Sequence[NDArray[np.int64]]) -> Routes:
    """An order to begin from, given by the route of each UAS; what it takes is not known yet."""
    return Routes((*routes,), np.zeros(0, np.int64), np.zeros(len(routes)), np.inf)


def empty_routes(n_uas: int) -> Routes:
    """No UAS visits anything: where a search begins."""
    return routes_of([np.zeros(0, np.int64)] * n_uas)


def improve_routes(
    problem: RoutingProblem,
    order: Routes,
    effort: SearchEffort,
    seed: int,
    on_best: Callable[[Routes], None] | None = None,
) -> Routes:
    """The best order found from a given one; the same arguments give the same order.

    Args:
        problem: the routing problem.
        order: where to begin; visited waypoints are dropped from it, missing ones added.
        effort: how much to search.
        seed: of the search.
        on_best: called with the order to begin with, and, every thousand moves, with a better one.

    Returns:
        An order that visits every open waypoint once or leaves it out, never worse than `order`.
    """
    search = OrderSearch(problem, order, effort, seed)
    if on_best is None:
        search.go_on(effort.moves)
        return search.best
    told_s = np.inf
    while True:
        if search.best_s < told_s:
            told_s = search.best_s
            on_best(search.best)
        if search.is_over:
            return search.best
        search.go_on(_REPORTED_EVERY)


class OrderSearch:
    """A search for a better order, which may be made in parts: it goes on where it stopped.

    Args:
        problem: the routing problem.
        order: where to begin; visited waypoints are dropped from it, missing ones added.
        effort: how much to search.
        seed: of the search.
    """

    def __init__(
        self, problem: RoutingProblem, order: Routes, effort: SearchEffort, seed: int
    ) -> None:
        U, W = problem.n_uas, problem.n_waypoints
        routes = np.full((U + 1, W + 1), -1, np.int64)
        lengths = np.zeros(U + 1, np.int64)
        wanted = np.zeros(W, bool)
        wanted[problem.open_waypoints] = True
        allowed = np.vstack([~problem.forbidden & problem.may_fly[:, None], np.ones((1, W), bool)])
        for u, route in enumerate((*order.routes, order.left_out)):
            kept = [w for w in route if wanted[w] and allowed[u, w]]
            wanted[kept] = False
            routes[u, : len(kept)] = kept
            lengths[u] = len(kept)
        missing = np.flatnonzero(wanted)
        routes[U, lengths[U] : lengths[U] + len(missing)] = missing
        lengths[U] += len(missing)
        # missing waypoints begin as left out and go where they cost least
        self._arrays = arrays_of(problem, effort.total_weight)
        insert_missing(
            self._arrays, routes, lengths, missing, effort.total_weight, effort.by_pieces
        )
        self._now = State(routes, lengths, np.empty(U), np.full(1, np.inf))
        self._best = State(routes.copy(), lengths.copy(), np.empty(U), np.full(1, np.inf))
        moves = effort.moves if len(problem.open_waypoints) else 0
        self._schedule, self._tried = effort.schedule._replace(moves=moves), 0
        self._rng = np.random.default_rng(seed)
        self.go_on(0)

    @property
    def is_over(self) -> bool:
        """Whether all changes were tried."""
        return self._tried >= self._schedule.moves

    def go_on(self, moves: int) -> None:
        """Try some more changes, at most so many."""
        end = min(self._tried + moves, self._schedule.moves)
        anneal(self._arrays, self._now, self._best, self._tried, end, self._schedule, self._rng)
        self._tried = end

    @property
    def best_s(self) -> float:
        """What the best order so far costs."""
        return float(self._best.cost_s[0])

    @property
    def best(self) -> Routes:
        """The best order so far."""
        routes, lengths, seconds, _ = self._best
        *each, left_out = [route[:n].copy() for route, n in zip(routes, lengths, strict=True)]
        left_out_s = float(self._arrays.left_out_s[left_out].sum())
        return Routes(tuple(each), left_out, seconds.copy(), self.best_s, left_out_s)


def _left_out_s(problem: RoutingProblem, total_weight: float) -> FloatArray:
    """(W,) what it costs to leave out each waypoint: more than for some UAS to fly there first."""
    there_s = problem.first_s + problem.home_s - problem.uas["idle_s"][:, None]
    visit_s = np.min(there_s[problem.may_fly], axis=0, initial=np.inf)
    visit_s = np.where(np.isfinite(visit_s), np.maximum(visit_s, 0.0), 0.0) + problem.release_s
    return _LEFT_OUT_S * problem.weight + (1.0 + total_weight) * visit_s


def arrays_of(problem: RoutingProblem, total_weight: float) -> RoutingArrays:
    """A problem for compiled code, with what it costs to leave out waypoints."""
    uas = problem.uas
    follows = np.append(False, uas["flown_by"][1:] == uas["flown_by"][:-1])
    release_s = np.tile(problem.release_s, (problem.n_uas, 1))
    release_s[follows] = 0.0  # when a later trip takes off, everything is taken to be released
    release_s[problem.forbidden] = _FORBIDDEN_S
    place = np.vstack([problem.waypoints_m[:, :2], uas["position_m"], uas["home_m"]])
    return RoutingArrays(
        uas=uas,
        first=problem.first_s,
        between=problem.between_s,
        home=problem.home_s,
        place=place,
        turn=problem.turn_s,
        turn_of_cosine=problem.turn_of_cosine,
        release=release_s,
        is_released=np.all(release_s <= 0.0, axis=0),
        left_out_s=_left_out_s(problem, total_weight),
        neighbours=problem.neighbours,
        has_trips=bool(follows.any() or (uas["ground_s"] > 0.0).any()),
    )
