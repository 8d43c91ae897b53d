"""Orders of missions in which UAS swap battery packs: what to visit now, what with fresh packs.

A search for flights that are over soon fills every charge, and plans the last of them for what
happens to be left. Here all flights are planned at once: the search is the same, over one route for
each charge of a UAS, flown one after the other (a multi-trip routing problem).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.entities.state import FLYING
from uas_coverage_env.mission import MissionBrief
from uas_coverage_env.planning.routing.problem import RoutingProblem
from uas_coverage_env.planning.routing.search import (
    Routes,
    SearchEffort,
    empty_routes,
    improve_routes,
)
from uas_coverage_env.simulation.world import initial_state
from uas_coverage_env.world import SwarmState
from uas_coverage_env.world.packs import pack_records, swaps_alone

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
BoolArray = NDArray[np.bool_]

_FRESH = 0.98  # of the budget of a fresh pack: more is as good as one
_NO_RETURN = 0.5  # likewise: with more, a UAS is to visit something before it swaps
_FOR_NOTHING_S = 600.0
_AT_LAST = 0.04  # of budgets, for what is beyond the reach of flights otherwise
_NOTHING = np.zeros(0, np.int64)


class Packs:
    """The packs of a mission in which each UAS swaps on its own.

    Args:
        brief: The mission.

    Attributes:
        x: (U, 14) states at home with fresh packs.
        swap_s: (U,) from a landing to the next take-off.
    """

    def __init__(self, brief: MissionBrief) -> None:
        scenario = brief.as_scenario()
        self.x = initial_state(scenario).x.copy()
        self.swap_s = brief.dt_s * pack_records(scenario)["swap_steps"]

    @classmethod
    def of(cls, brief: MissionBrief) -> Packs | None:
        """None where no UAS swaps while the others fly on."""
        return cls(brief) if swaps_alone(brief.as_scenario()) else None


@dataclass(frozen=True)
class FreshPacks:
    """What flights with fresh packs are planned from.

    Attributes:
        left: (U,) of each UAS.
        problem: That of all UAS at home with fresh packs now, those that have none left out.
        ground_s: (U,) on the ground until the next take-off, for UAS that are there already.
        swap_s: (U,) likewise for all others, and from then on.
        until_s: From now to the end of the mission at the latest.
        budget_share: Of the budgets, for flights that take longer than their routes say.
        is_planned: (U,) the flight along the route to begin with is planned, and its charge
            lasts, whatever the budget says; None: of none.
    """

    left: IntArray
    problem: Callable[[], RoutingProblem]
    ground_s: FloatArray
    swap_s: FloatArray
    until_s: float
    budget_share: float = 1.0
    is_planned: BoolArray | None = None

    @classmethod
    def seen(
        cls,
        packs: Packs | None,
        swarm: SwarmState,
        until_s: float,
        problem: Callable[[FloatArray, BoolArray], RoutingProblem],
        budget_share: float = 1.0,
        is_planned: BoolArray | None = None,
    ) -> FreshPacks | None:
        """As a swarm is seen now; None where no fresh pack is left.

        Args:
            packs: Of the mission.
            swarm: What is seen.
            until_s: From now to the end of the mission at the latest.
            problem: Makes the routing problem of states (U, 14), of UAS (U,) that may work.
            budget_share: See the attribute.
            is_planned: Likewise.
        """
        left = swarm.packs_left
        if packs is None or not left.any():
            return None
        ground_s = np.where(swarm.status == FLYING, packs.swap_s, swarm.ground_s)
        fresh = partial(problem, packs.x, left > 0)
        return cls(left, fresh, ground_s, packs.swap_s, until_s, budget_share, is_planned)

    def shorter(self, share: float, uas: Sequence[int]) -> FreshPacks:
        """With budgets shorter by a share, and no flight planned of some UAS."""
        is_planned = self.is_planned
        if is_planned is not None:
            is_planned = is_planned & ~np.isin(np.arange(len(is_planned)), uas)
        return replace(self, budget_share=self.budget_share - share, is_planned=is_planned)


def improve_trips(
    problem: RoutingProblem,
    order: Routes,
    effort: SearchEffort,
    seed: int,
    fresh: FreshPacks | None = None,
) -> Routes:
    """The best order found from a given one, for the charge that is in and for packs that are left.

    Where all can be visited with the charge that is in, this is `improve_routes`, and so it is
    where fresh packs come too late. Otherwise what is minimised is the time until the last UAS has
    flown all its flights, with the swaps between them, and the weighted sum of all flights.

    Args:
        problem: the routing problem of the charges that are in.
        order: where to begin; its `trips` too.
        effort: how much to search.
        seed: of the search.
        fresh: packs that are left.

    Returns:
        Routes for the charges that are in, and `trips` for fresh packs; `left_out` is what neither
        reach.
    """
    found, now = order, None
    if fresh is None or not order.trips:
        found = now = improve_routes(problem, order, effort, seed)
        if fresh is None or not len(now.left_out):
            return now
    later, most = fresh.problem(), int(fresh.left.max())
    n_trips = min(_trips_at_first(found) + (effort.moves > 0), most)
    begin = order if order.trips else empty_routes(problem.n_uas)
    best = _with_trips(problem, later, fresh, n_trips, begin, effort, seed)
    while effort.moves and n_trips < most and len(best.left_out):
        n_trips += 1
        more = _with_trips(problem, later, fresh, n_trips, begin, effort, seed)
        if len(more.left_out) >= len(best.left_out):
            break
        best = more
    if effort.moves and len(best.left_out) and fresh.budget_share < 1.0:
        share = min(fresh.budget_share + _AT_LAST, 1.0)
        more = replace(fresh, budget_share=share)
        far = _with_trips(problem, later, more, n_trips, begin, effort, seed)
        best = far if len(far.left_out) < len(best.left_out) else best
    if best.mission_s <= fresh.until_s:
        return best
    return now or improve_routes(problem, order, effort, seed)


def search_orders(
    problem: RoutingProblem,
    order: Routes,
    searches: Sequence[tuple[SearchEffort, int]],
    fresh: FreshPacks | None = None,
    threads: int = 1,
) -> list[Routes]:
    """What several searches find from a given order, the cheapest first.

    Args:
        problem: the routing problem.
        order: where each begins.
        searches: effort and seed of each.
        fresh: packs that are left.
        threads: searches side by side; what they find is the same.
    """

    def searched(search: tuple[SearchEffort, int]) -> Routes:
        return improve_trips(problem, order, *search, fresh)

    with ThreadPoolExecutor(threads) as side_by_side:  # the search frees the GIL
        found = list(side_by_side.map(searched, searches))
    return sorted(found, key=lambda each: each.cost_s)


def _trips_at_first(order: Routes) -> int:
    """How many flights with fresh packs each UAS will need, about."""
    if order.trips:
        return max(len(trips) for trips in order.trips)
    visited = sum(len(route) for route in order.routes)
    return math.ceil(len(order.left_out) / max(visited, 1))


def _with_trips(
    problem: RoutingProblem,
    later: RoutingProblem,
    fresh: FreshPacks,
    n_trips: int,
    order: Routes,
    effort: SearchEffort,
    seed: int,
) -> Routes:
    """An order with at most so many flights of each UAS with fresh packs."""
    n_uas = problem.n_uas
    uas = np.repeat(np.arange(n_uas), 1 + np.minimum(fresh.left, n_trips))
    follows = np.append(False, uas[1:] == uas[:-1])
    charged = problem.uas["budget_s"] >= _FRESH * later.uas["budget_s"]
    is_fresh = problem.may_fly & charged
    flights = _flights(problem, later, fresh, uas, follows)
    open_ = np.zeros(problem.n_waypoints, np.bool_)
    open_[flights.open_waypoints] = True
    begin: list[IntArray] = []
    for u in range(n_uas):
        route, *trips = [order.routes[u], *(order.trips[u] if order.trips else ())]
        route, trips = route[open_[route]], [trip for trip in trips if open_[trip].any()]
        if is_fresh[u] and not len(route) and trips:
            route = trips.pop(0)
        rows = [route, *trips, *[_NOTHING] * n_trips]
        begin += rows[: np.count_nonzero(uas == u)]
    first = Routes((*begin,), order.left_out, np.zeros(len(uas)), np.inf)
    if fresh.is_planned is not None and fresh.is_planned.any():
        visited = np.concatenate(begin)
        kept = flights.replace(open_waypoints=visited[open_[visited]])
        kept_s = improve_routes(kept, first, SearchEffort(0), 0).seconds
        lasts = ~follows & fresh.is_planned[uas]
        budget_s = flights.uas["budget_s"]
        longer_s = np.maximum(budget_s, kept_s)
        flights = flights.replace(budget_s=np.where(lasts, longer_s, budget_s))
    found = improve_routes(flights, first, replace(effort, by_pieces=True), seed)
    routes: list[IntArray] = []
    trips_of: list[tuple[IntArray, ...]] = []
    for u in range(n_uas):
        route, *rest = (found.routes[r] for r in np.flatnonzero(uas == u))
        trips = [trip for trip in rest if len(trip)]
        if is_fresh[u] and not len(route) and trips:
            route = trips.pop(0)  # a UAS that visits nothing is not sent out again
        routes.append(route)
        trips_of.append((*trips,))
    # as long as they take, and as long as the UAS is on the ground before
    ground_s = np.where(found.seconds > 0.0, flights.uas["ground_s"], 0.0)
    home_s = np.bincount(uas, found.seconds + ground_s)
    return replace(
        found,
        routes=(*routes,),
        seconds=found.seconds[~follows],
        trips=(*trips_of,) if any(trips_of) else (),
        mission_s=float(home_s.max()),
    )


def _flights(
    problem: RoutingProblem,
    later: RoutingProblem,
    fresh: FreshPacks,
    uas: IntArray,
    follows: BoolArray,
) -> RoutingProblem:
    """The problem of all flights: with the charge that is in, and with fresh packs after it."""

    def of_each(now: NDArray, then: NDArray) -> NDArray:
        rows = now[uas]
        rows[follows] = then[uas[follows]]
        return rows

    may_fly, now_s, later_s = problem.may_fly, problem.uas["budget_s"], later.uas["budget_s"]
    flights = of_each(problem.uas, later.uas)
    lands_before = np.append(False, follows[:-1]) | may_fly[uas]
    ground_s = np.where(lands_before, fresh.swap_s[uas], fresh.ground_s[uas])
    has_charge = now_s > _NO_RETURN * later_s
    flights["idle_s"][follows] = 0.0
    flights["budget_s"] *= fresh.budget_share
    flights["ground_s"] = np.where(follows, ground_s, 0.0)
    flights["again_s"] = np.where(~follows & has_charge[uas], _FOR_NOTHING_S, 0)
    return problem.replace(
        open_waypoints=np.union1d(problem.open_waypoints, later.open_waypoints),
        uas=flights,
        first_s=of_each(problem.first_s, later.first_s),
        home_s=problem.home_s[uas],
        turn_s=problem.turn_s[uas],
        forbidden=of_each(problem.forbidden, np.zeros_like(problem.forbidden)),
    )
