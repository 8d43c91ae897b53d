"""The global order of the swarm, kept up to date, and the tours it gives each decision."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from uas_coverage_baselines.milp_mpc.model.problem import TourSegment
from uas_coverage_baselines.milp_mpc.problem_builder import ProblemBuilder
from uas_coverage_env.mission import MissionBrief
from uas_coverage_env.planning.reserves import ORDER_GUIDE
from uas_coverage_env.planning.routing import (
    Routes,
    RoutingProblem,
    SearchEffort,
    empty_routes,
    improve_routes,
    search_orders,
)
from uas_coverage_env.planning.routing.legs import Legs
from uas_coverage_env.planning.routing.window import RouteWindow
from uas_coverage_env.vehicle.scale import length_scale
from uas_coverage_env.world import SwarmState

FloatArray = NDArray[np.float64]
_MOVES_PER_WAYPOINT = 40_000  # of the first search, before take-off
_MOVES_AT_MOST = 4_000_000
_MOVES_AFTERWARDS = 60_000  # of each decision's
_FIRST_SEARCHES = 3
_SEARCHED_AGAIN = 60  # waypoints of each route, at most, at every decision
_WORTH_CHANGING_S = 0.5
_WAIT_WHEN_LEFT_S = 60.0  # with less than this still to go, blocked waypoints are waited for
_WAIT_S = 30.0  # how long is then expected
_WAITING_M = 100.0  # of a blocked waypoint is near enough, at scale 1: what blocks may set off


@dataclass(frozen=True)
class TourShape:
    """How much of an order a decision looks at.

    Attributes:
        most: waypoints at most.
        beyond: share of the horizon's time by which a tour may last longer than the horizon.
        lead_s: aims are measured from where the UAS would be after so long.
    """

    most: int = 6
    beyond: float = 0.2
    lead_s: float = 1.0


class RouteGuide:
    """Keeps the swarm's order; searches before take-off and a little at every decision.

    The search runs at every decision rather than on events: a lost UAS, a waypoint that opens, a
    flight that takes longer are all seen in the state, and a better order is taken when it comes.
    """

    def __init__(
        self,
        brief: MissionBrief,
        builder: ProblemBuilder,
        shape: TourShape,
        total_weight: float = SearchEffort.total_weight,
    ) -> None:
        self._brief, self._builder, self._shape = brief, builder, shape
        self._glance = SearchEffort(0, total_weight=total_weight)  # costs alone, no search
        self._legs = Legs(brief)
        self._names = tuple(uas.name for uas in brief.uas)
        self._radius_m = np.array([w.radius_m for w in brief.waypoints])
        self._waiting_m = length_scale(brief.vehicles, brief.dt_s) * _WAITING_M
        self._order: Routes | None = None
        self.blocked: set[int] = set()
        self._waits = False  # whether blocked waypoints are waited for, once little else is left

    @property
    def order(self) -> Routes | None:
        """The order as it stands."""
        return self._order

    def begin(self, swarm: SwarmState, seed: int) -> None:
        """Search long, before take-off."""
        problem = self._problem(swarm)
        moves = min(_MOVES_PER_WAYPOINT * max(len(problem.open_waypoints), 1), _MOVES_AT_MOST)
        effort = replace(self._glance, moves=moves)
        searches = [(effort, seed + attempt) for attempt in range(_FIRST_SEARCHES)]
        self._order = search_orders(problem, empty_routes(problem.n_uas), searches)[0]

    def update(self, swarm: SwarmState) -> None:
        """Bring the order up to date with what is seen now."""
        previous = self._order or empty_routes(len(self._names))
        problem = self._problem(swarm)
        effort = replace(self._glance, moves=_MOVES_AFTERWARDS, hottest_s=1.5, window=24)
        kept = improve_routes(problem, previous, self._glance, 0)
        part = RouteWindow.of(problem, kept, _SEARCHED_AGAIN)
        first = kept
        if part.problem is not problem:
            first = improve_routes(part.problem, part.order, self._glance, 0)
        better = improve_routes(part.problem, first, effort, swarm.step)
        worthwhile = better.cost_s < first.cost_s - _WORTH_CHANGING_S
        self._order = part.joined(better) if worthwhile else kept

    def tours(self, names: Sequence[str]) -> list[NDArray[np.int64]]:
        """Per UAS the waypoints (the scenario's rows) that its next decision is about."""
        return [self._ahead(self._names.index(name)) for name in names]

    def tour(self, name: str, rows: NDArray[np.int64]) -> TourSegment | None:
        """The tour of a UAS; None where nothing is left for it.

        Args:
            name: the UAS.
            rows: (K,) where the tour's waypoints are in the problem.
        """
        uas = self._names.index(name)
        assert self._order is not None
        route, K = self._order.routes[uas], len(rows)
        if not K:
            return None
        between, home = self._legs.between_s[self._legs.kind[uas]], self._legs.home_s[uas]
        after = route[K] if len(route) > K else None
        last_s = home[route[K - 1]] if after is None else between[route[K - 1], after]
        aims = self._legs.waypoints_m[route[: K + 1]]
        radius, lead_s = self._near_enough_m[route[: K + 1]], self._shape.lead_s
        if after is None:  # at home it has to stand still
            aims = np.vstack([aims, self._legs.homes_m[uas]])
            radius, lead_s = np.append(radius, 0.0), 0.0
        onward = np.append(between[route[: K - 1], route[1:K]], last_s)
        return TourSegment(rows, aims, radius, lead_s, onward)

    def _ahead(self, uas: int) -> NDArray[np.int64]:
        assert self._order is not None
        route = self._order.routes[uas]
        between = self._legs.between_s[self._legs.kind[uas]]
        until = np.concatenate([[0.0], np.cumsum(between[route[:-1], route[1:]])])
        horizon_s = (1.0 + self._shape.beyond) * self._builder.horizon_s
        within = until[: len(route)] <= horizon_s
        return route[: min(int(within.sum()), self._shape.most)]

    def _problem(self, swarm: SwarmState) -> RoutingProblem:
        # when a blocked waypoint opens is not known: it is left aside as long as there is other
        # work, since an order that waits has no reason to be quick with the rest
        wanted, opens = swarm.uncovered.copy(), np.zeros(len(self._radius_m))
        self.blocked = self._builder.blocked_waypoints(swarm)
        blocked = list(self.blocked)
        if self._order is not None and self._order.seconds.max() < _WAIT_WHEN_LEFT_S:
            self._waits = True
        if not self._waits:
            wanted[blocked] = False
        if not wanted.any():
            wanted = swarm.uncovered
        opens[blocked] = _WAIT_S
        self._near_enough_m = 0.5 * self._radius_m
        self._near_enough_m[blocked] = self._waiting_m
        return RoutingProblem.seen(
            self._brief,
            swarm,
            self._legs,
            np.isin(swarm.names, swarm.active),  # one that is not there any more can visit nothing
            ORDER_GUIDE,
            open_waypoints=wanted,
            release_s=opens,
        )
