"""Which UAS covers what: the order of the swarm, searched before take-off and again on events."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.mission import MissionBrief
from uas_coverage_env.mission.access import Access
from uas_coverage_env.mission.learnt_wind import MEAN_HEIGHT_M
from uas_coverage_env.planning.reserves import TOUR, TOUR_SCARCE
from uas_coverage_env.planning.routing import (
    Routes,
    RoutingProblem,
    SearchEffort,
    empty_routes,
    improve_routes,
    search_orders,
)
from uas_coverage_env.planning.routing.legs import Legs
from uas_coverage_env.planning.routing.problem import budget_s
from uas_coverage_env.planning.routing.trips import FreshPacks, Packs, improve_trips
from uas_coverage_env.world import SwarmState

FloatArray = NDArray[np.float64]

_LATE_S = 6.0  # this far off the schedule, another search is worth its time
_AGAIN_S = 5.0  # what a search could not mend is searched again after so long
_PACE = 1.2  # flights take so much longer than their legs, until it is known better
_PACE_KNOWN_S = 30.0  # that weighs as much as so long a flight
_SLOWEST_PACE = 2.0
_OPENS_AFTER = 0.75  # share of the mean flight left after which what is blocked may be open
_OPENS_AFTER_S = 10.0  # and at least so long
_FIRST_SEARCHES = 3
_MOVES_AGAIN = 400_000  # of each of two searches on an event, one of them hot
_WORTH_CHANGING_S = 1.0
_WIND_KNOWN_S = 5.0  # after take-off
_OTHER_WIND_MPS = 1.0  # by so much another: legs are timed anew


@dataclass(frozen=True)
class View:
    """What the schedule needs of a moment.

    Attributes:
        x: (U, 14) states, in the scenario's order.
        may_work: (U,) flies, and is not on its last way home.
        flies: (U,).
        uncovered: (W,).
        blocked: (W,) inside the keep-out of something that moves, now.
        time_s: since the start.
        swarm: what is seen, UAS that take no commands left out; None: no packs are swapped.
        asked_in_s: (W,) from now until a waypoint is asked for; None: all are.
        wind_mps: (2,) north and east at MEAN_HEIGHT_M, learnt so far; None: still air.
    """

    x: FloatArray
    may_work: NDArray[np.bool_]
    flies: NDArray[np.bool_]
    uncovered: NDArray[np.bool_]
    blocked: NDArray[np.bool_]
    time_s: float
    swarm: SwarmState | None = None
    asked_in_s: FloatArray | None = None
    wind_mps: FloatArray | None = None


class Schedule:
    """The order of the swarm, kept up to date.

    Attributes:
        access: Which waypoints have a way to them.
    """

    def __init__(self, brief: MissionBrief, effort: SearchEffort) -> None:
        self._brief, self.legs, self._packs = brief, Legs(brief), Packs.of(brief)
        self._wind_mps, self._knows_wind = np.zeros(2), False
        self._can_cover, self._effort = brief.can_cover, effort
        self.access = Access(brief)
        self._until_s = brief.max_steps * brief.dt_s
        self.order = empty_routes(len(brief.uas))
        self._reserve = TOUR
        self._flown_s = np.full(len(brief.uas), _PACE_KNOWN_S * _PACE)
        self._legs_flown_s = np.full(len(brief.uas), _PACE_KNOWN_S)

    def begin(self, view: View, seed: int) -> None:
        """Search long: before take-off, and when the wind is known."""
        if (view.blocked & view.uncovered).any():  # how late is late, is known with an order
            self.take(improve_routes(self.problem(view), self.order, self._effort, seed), view)
        order = self._searched(view, seed)
        if len(order.left_out):
            self._keep_less()
            order = self._searched(view, seed)
        self.take(order, view)

    def _searched(self, view: View, seed: int) -> Routes:
        """The best of several long searches that begin with nothing."""
        problem, fresh = self.problem(view), self._fresh_packs(view)
        searches = [(self._effort, seed + attempt) for attempt in range(_FIRST_SEARCHES)]
        return search_orders(problem, empty_routes(problem.n_uas), searches, fresh)[0]

    def _keep_less(self) -> None:
        """Use more of the charge: what is left at the end would have covered something."""
        self._reserve = TOUR_SCARCE

    def go_on(self, view: View, order: Routes) -> None:
        """Search from an order that was flown until the scene became another."""
        self.order = order
        self._drop_covered(view)
        kept, better = self._searched_again(view)
        self.take(min(better, kept, key=lambda order: order.cost_s), view)

    def update(self, view: View) -> None:
        """Drop what is covered, and search again where something has happened."""
        self._drop_covered(view)
        if self._is_other_wind(view):
            self._fly_in(view)
            return
        self._time_legs(view)
        if self._has_changed(view) or self._is_asked_for_more(view):
            self.take(self._better(view), view)

    def _better(self, view: View) -> Routes:
        """The present order, or one that is better by more than a change costs."""
        kept, better = self._searched_again(view)
        return better if better.cost_s < kept.cost_s - _WORTH_CHANGING_S else kept

    def _is_other_wind(self, view: View) -> bool:
        if view.wind_mps is None or view.time_s < _WIND_KNOWN_S:
            return False
        return float(np.hypot(*(view.wind_mps - self._wind_mps))) > _OTHER_WIND_MPS

    def _fly_in(self, view: View) -> None:
        """Time the legs in the wind of a moment; the first time, search anew."""
        assert view.wind_mps is not None
        self._wind_mps = view.wind_mps.copy()
        self.legs = self.legs.in_wind(self._wind_mps, MEAN_HEIGHT_M)
        if not self._knows_wind:
            self._knows_wind = True
            self.begin(view, round(view.time_s))
        else:
            self.take(self._better(view), view)

    def _drop_covered(self, view: View) -> None:
        open_ = view.uncovered
        routes = tuple(route[open_[route]] for route in self.order.routes)
        left_out = self.order.left_out[open_[self.order.left_out]]
        trips = tuple(tuple(trip[open_[trip]] for trip in trips) for trips in self.order.trips)
        self.order = replace(self.order, routes=routes, left_out=left_out, trips=trips)

    def _searched_again(self, view: View) -> tuple[Routes, Routes]:
        """The present order with all that is open, and the best that was found from it."""
        problem, fresh = self.problem(view), self._fresh_packs(view)
        again = replace(self._effort, moves=_MOVES_AGAIN)
        kept = improve_trips(problem, self.order, replace(again, moves=0), 0, fresh)
        seed = round(view.time_s)
        searches = [(replace(again, hottest_s=1.5), seed), (again, seed)]
        return kept, search_orders(problem, kept, searches, fresh)[0]

    def take(self, order: Routes, view: View) -> None:
        """Fly an order from now on."""
        self.order = order
        if len(order.left_out):
            self._keep_less()
        self._taken_under = self._seen = view
        self._legs_left_s = self._legs_left(view)
        self._expected_s = view.time_s + self._legs_left_s

    def _has_changed(self, view: View) -> bool:
        """Whether a UAS came home or was lost, a waypoint opened or closed, or time is off.

        Or a battery no longer lasts for its route, which another UAS has to take over while one
        is in the air; or it may last longer than expected.
        """
        before = self._taken_under
        late_s = (view.time_s + self._legs_left_s - self._expected_s)[view.may_work]
        if (
            not np.array_equal(view.may_work, before.may_work)
            or not np.array_equal(view.blocked & view.uncovered, before.blocked & view.uncovered)
            or (np.abs(late_s) > _LATE_S).any()
        ):
            return True
        if view.time_s < before.time_s + _AGAIN_S:
            return False
        spare_s = self._budget_s(view) + self._reserve.spare_s / self.pace - self._legs_left_s
        too_long = [len(route) and spare_s[u] < 0.0 for u, route in enumerate(self.order.routes)]
        return bool(len(self.order.left_out) or any(too_long))

    def _is_asked_for_more(self, view: View) -> bool:
        """Whether a waypoint is to be visited again that the order does not know of."""
        if view.asked_in_s is None:
            return False
        known = np.zeros(len(view.uncovered), np.bool_)
        known[np.concatenate([*self.order.routes, self.order.left_out, self.order.later])] = True
        return bool((view.uncovered & self._can_cover[view.may_work].any(axis=0) & ~known).any())

    def _time_legs(self, view: View) -> None:
        """Measure how long flights take beside their legs, waiting not counted."""
        left_s = self._legs_left(view)
        for u, route in enumerate(self.order.routes):
            if view.may_work[u] and len(route) and not self._waits(view, route[0]):
                self._flown_s[u] += view.time_s - self._seen.time_s
                self._legs_flown_s[u] += self._legs_left_s[u] - left_s[u]
        self._seen, self._legs_left_s = view, left_s

    @property
    def pace(self) -> FloatArray:
        """(U,) how much longer flights take than their legs."""
        legs_s = np.maximum(self._legs_flown_s, 1.0)  # a UAS that was driven away flew backwards
        return np.clip(self._flown_s / legs_s, 1.0, _SLOWEST_PACE)

    def _budget_s(self, view: View) -> FloatArray:
        """(U,) seconds of legs that battery and clock allow each UAS."""
        return budget_s(self._brief, view, self.legs, self._reserve, pace=self.pace)

    def _legs_left(self, view: View) -> FloatArray:
        """(U,) seconds of legs along each route and home, turns not counted."""
        left_s = np.array([self._seconds_left(u, x[:3]) for u, x in enumerate(view.x)])
        if view.asked_in_s is not None:  # none is over before its last waypoint is asked for
            for u, route in enumerate(self.order.routes):
                rest_s = self.rest_s(u, 1.0, 0.0)[:-1]
                left_s[u] = max(left_s[u], np.max(view.asked_in_s[route] + rest_s, initial=0.0))
        return left_s

    def _waits(self, view: View, waypoint: int) -> bool:
        """Whether a waypoint cannot be covered yet."""
        return bool(
            view.blocked[waypoint]
            or (view.asked_in_s is not None and view.asked_in_s[waypoint] > 0.0)
        )

    def rest_s(self, uas: int, slower: float, per_waypoint_s: float) -> FloatArray:
        """Flight time from each waypoint of a UAS's route to its end.

        Args:
            uas: Index of the UAS.
            slower: Factor on the legs' times.
            per_waypoint_s: Added for each waypoint that is still to be covered.

        Returns:
            (K+1,): with k waypoints covered, from the next one on; the last is 0.
        """
        route = self.order.routes[uas]
        if not len(route):
            return np.zeros(1)
        between = self.legs.between_s[self.legs.kind[uas]]
        legs = np.append(between[route[:-1], route[1:]], self.legs.home_s[uas, route[-1]])
        return np.append(np.cumsum((slower * legs + per_waypoint_s)[::-1])[::-1], 0.0)

    def _seconds_left(self, uas: int, position_m: FloatArray) -> float:
        """Flight time along the route of a UAS and home, turns not counted."""
        route = self.order.routes[uas]
        if not len(route):
            return self.legs.way_home_s(uas, position_m)
        first_m = self.legs.waypoints_m[route[0]]
        speed_mps = self.legs.ground_mps(uas, position_m, first_m)
        first_s = np.linalg.norm((first_m - position_m)[:2]) / speed_mps
        return float(first_s + self.rest_s(uas, 1.0, 0.0)[0])

    def _fresh_packs(self, view: View) -> FreshPacks | None:
        """What is there for later flights."""
        if view.swarm is None:
            return None

        def problem(x: FloatArray, may_work: NDArray[np.bool_]) -> RoutingProblem:
            free = np.zeros_like(view.blocked)
            return self.problem(
                replace(view, x=x, may_work=may_work, blocked=free, asked_in_s=None)
            )

        return FreshPacks.seen(self._packs, view.swarm, self._until_s - view.time_s, problem)

    @property
    def closed_off(self) -> NDArray[np.bool_]:
        """(W,) waypoints without a way to them: no UAS is sent there."""
        return np.logical_not(self.access.has_way.any(axis=0))

    def problem(self, view: View) -> RoutingProblem:
        """The routing problem of a moment."""
        # it is unknown when a blocked waypoint opens: late enough to do other work before, and soon
        # enough to be thought of while there is other work near it
        work_s = self._legs_left(view)[view.may_work]
        opens_s = max(_OPENS_AFTER * float(work_s.mean()), _OPENS_AFTER_S) if len(work_s) else 0.0
        release_s = np.where(view.blocked, opens_s, 0.0)
        if view.asked_in_s is not None:
            release_s = np.maximum(release_s, view.asked_in_s)
        return RoutingProblem.seen(
            self._brief,
            replace(view, uncovered=view.uncovered & ~self.closed_off),
            self.legs,
            view.may_work,
            self._reserve,
            release_s=release_s,
            forbidden=~self.access.has_way,
            pace=self.pace,
        )
