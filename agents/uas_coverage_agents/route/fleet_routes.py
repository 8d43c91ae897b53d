"""The routes of the whole fleet: built before take-off, and again when something happens."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from uas_coverage_agents.route.layers import Layers
from uas_coverage_agents.route.order import (
    IN_THE_AIR,
    WEIGHT,
    build,
    home_seconds,
    leg_seconds,
    no_record,
    route_workspace,
)
from uas_coverage_env.entities.state import FLYING, LANDED
from uas_coverage_env.mission import MissionBrief, first_sight
from uas_coverage_env.mission.access import Access
from uas_coverage_env.planning.following import Following
from uas_coverage_env.planning.reserves import LEARNED_ROUTE
from uas_coverage_env.planning.routing import RoutingProblem, SearchEffort, improve_routes
from uas_coverage_env.planning.routing.legs import Legs
from uas_coverage_env.planning.routing.search import arrays_of, routes_of
from uas_coverage_env.world import Command, GoTo, SwarmState

BoolArray = NDArray[np.bool_]
SAMPLES = 64
"""Routes that are built before the best are flown; the first without noise."""

CHANGES = 60_000
"""Changes of the best of these that are tried to make it cheaper."""

_NOISE = 1.0
_AGAIN_STEPS = 10
_HOTTEST_S = 1.5  # of the search that makes routes cheaper: they are good to begin with
_OPENS_AFTER = 0.75  # share of the mean flight after which what is blocked may be open
_LONE_UNIT_S = 5.0


class RouteProblems:
    """The fleet as the order networks and the search read it.

    Args:
        brief: The mission.

    Attributes:
        unit_s: Mean leg time from a waypoint to its nearest neighbour.
    """

    def __init__(self, brief: MissionBrief) -> None:
        self._brief, self._legs = brief, Legs(brief)
        legs_s = LEARNED_ROUTE.legs_share * self._legs.between_s.max(axis=0)
        n = len(legs_s)
        nearest_s = (legs_s + 1e9 * np.eye(n)).min(axis=1) if n > 1 else [_LONE_UNIT_S]
        self.unit_s = max(float(np.mean(nearest_s)), 0.1)

    def seen(self, swarm: SwarmState, works: BoolArray, wanted: BoolArray) -> RoutingProblem:
        """The routing problem from here: `wanted` waypoints (W,), for UAS that `works` (U,)."""
        works = works & (swarm.status == FLYING)
        problem = RoutingProblem.seen(
            self._brief, swarm, self._legs, works, LEARNED_ROUTE, open_waypoints=wanted
        )
        # with the landing, but of those that have not set off
        home_s = LEARNED_ROUTE.legs_share * problem.uas["idle_s"] + LEARNED_ROUTE.landing_s
        return problem.replace(idle_s=np.where(works & swarm.departed, home_s, 0.0))


class FleetRoutes:
    """The routes of all UAS; a plan that is kept while it is right.

    Args:
        brief: The mission.
        seed: Of the noise of samples.
        score: `Layers` that score a waypoint.
        home_score: `Layers` that score home.
        samples: Sets of routes that are built.
        changes: By which the cheapest of these, by estimated times, is improved before it is flown.

    Attributes:
        view: The world as the planner sees it, at the latest update.
        by_guidance: Whether guidance flies all of the routes; at first it does not.
    """

    def __init__(
        self,
        brief: MissionBrief,
        seed: int,
        score: Layers,
        home_score: Layers,
        samples: int,
        changes: int = 0,
    ) -> None:
        self._score, self._home_score = score, home_score
        self._samples, self._changes = samples, changes
        self._following, self._problems = Following(brief), RouteProblems(brief)
        self.view, self._guided = self._following.view, self._following.guided
        self._has_way: BoolArray = np.asarray(Access(brief).has_way.any(axis=0))
        self.by_guidance = False
        n_uas, n_waypoints = len(brief.uas), len(brief.waypoints)
        self._workspace, self._record = route_workspace(), no_record()
        self._routes = np.full((n_uas, n_waypoints), -1)
        self._lengths = np.zeros(n_uas, np.int64)
        self._more_s = np.zeros((n_waypoints, n_waypoints))
        self._more_home_s = np.zeros((n_uas, n_waypoints))
        self._rng = np.random.default_rng(seed)
        self._built_for: tuple[BoolArray, ...] | None = None
        self._built_at = -_AGAIN_STEPS
        self._blocked = self._renew(first_sight(brief))

    def update(self, swarm: SwarmState) -> None:
        """Go on to this sample; build the routes again where they are no longer right."""
        self._blocked = self._renew(swarm)
        flown_to = {swarm.names[u]: int(self._routes[u, 0]) for u in np.flatnonzero(self._lengths)}
        self._onwards = self._following.towards(self._seen, flown_to)

    @property
    def given_up(self) -> dict[int, str]:
        """Waypoints that are given up, and why in a few words."""
        return self._guided.given_up

    def take(self, routes: Sequence[NDArray[np.int64]]) -> None:
        """Fly these routes, one for each UAS, until others have to be built."""
        for u, route in enumerate(routes):
            self._routes[u, : len(route)] = route
            self._lengths[u] = len(route)

    def build_again(self, reached_s: Sequence[NDArray[np.float64]]) -> None:
        """Build routes again for where the UAS were, by a clock that has learnt what legs take.

        Args:
            reached_s: When each UAS reaches the waypoints of its route, and home [s].
        """
        for u, at_s in enumerate(reached_s):
            place, before = IN_THE_AIR, len(self._more_s) + u
            took_s = np.diff(at_s, prepend=0.0)
            for w, seconds in zip(self.of(u).tolist(), took_s, strict=False):
                leg_s = leg_seconds(self._task, u, place, before, w)
                if place != IN_THE_AIR:
                    self._more_s[place, w] += max(seconds - leg_s, 0.0)
                    before = place
                place = w
            if place != IN_THE_AIR:
                home_s = home_seconds(self._task, u, place, before)
                self._more_home_s[u, place] += max(took_s[-1] - home_s, 0.0)
        self._build(*self._situation)

    def of_all(self) -> list[NDArray[np.int64]]:
        """A copy of the routes of all UAS."""
        return [self.of(u).copy() for u in range(len(self._lengths))]

    def of(self, u: int) -> NDArray[np.int64]:
        """The waypoints that UAS u still has to visit, in order; home comes after them."""
        return self._routes[u, : self._lengths[u]]

    def guided(self, swarm: SwarmState, u: int) -> Command | None:
        """The command where guidance flies a UAS: home, to what is hard or blocked, or in wind."""
        if swarm.returning[u] or self._following.called[u]:
            return GoTo(None)
        if self._lengths[u] == 0:
            return GoTo(None) if self.by_guidance or not swarm.departed[u] else None
        target = int(self._routes[u, 0])
        if self.by_guidance or self._guided.is_hard(u, target) or self._blocked[target]:
            return self._onwards[swarm.names[u]]
        return None

    def onwards(self, u: int) -> GoTo:
        """Guidance along the route, where nothing else knows a way."""
        return GoTo(int(self._routes[u, 0]), mode="covering") if self._lengths[u] else GoTo(None)

    def mode(self, u: int) -> Literal["covering", "return"]:
        """What UAS u flies for."""
        return "covering" if self._lengths[u] else "return"

    def _renew(self, swarm: SwarmState) -> BoolArray:
        seen = self._seen = self._following.update(swarm)
        blocked, works = seen.blocked, seen.works
        wanted = seen.wanted & self._has_way
        self._forget(~wanted, works)
        if self._has_to_build(swarm, wanted, blocked, works):
            self._situation = swarm, wanted, blocked, works
            self._build(*self._situation)
            self._built_for, self._built_at = (wanted & blocked, works), swarm.step
        return blocked

    def _has_to_build(
        self, swarm: SwarmState, wanted: BoolArray, blocked: BoolArray, works: BoolArray
    ) -> bool:
        if self._built_for is None:
            return True
        was_blocked, worked = self._built_for
        left_out = wanted.copy()
        for u in np.flatnonzero(works):
            left_out[self._routes[u, : self._lengths[u]]] = False
        landed = (swarm.status == LANDED) & ~left_out.any()
        changed = (works != worked) & ~landed
        # what is covered is no longer blocked; that changes nothing
        turned = wanted & (blocked != was_blocked)
        late = left_out.any() and swarm.step - self._built_at >= _AGAIN_STEPS
        return bool(changed.any() or turned.any() or late)

    def _forget(self, unwanted: BoolArray, works: BoolArray) -> None:
        """Leave out of the routes what is covered, or left for later."""
        for u in range(len(self._lengths)):
            route = self._routes[u, : self._lengths[u]]
            kept = route[~unwanted[route]] if works[u] else route[:0]
            if len(kept) < len(route):
                self._routes[u, : len(kept)] = kept
                self._lengths[u] = len(kept)

    def _build(
        self, swarm: SwarmState, wanted: BoolArray, blocked: BoolArray, works: BoolArray
    ) -> None:
        problem = self._problems.seen(swarm, works, wanted)
        problem = problem.replace(
            between_s=problem.between_s + self._more_s, home_s=problem.home_s + self._more_home_s
        )
        self._task = arrays_of(problem, WEIGHT)
        stages = np.array([wanted & ~blocked, wanted & blocked])
        routes, lengths = self._routes.copy(), self._lengths.copy()
        best_s = np.inf
        for sample in range(max(self._samples, 1)):
            cost_s = build(
                self._task, self._problems.unit_s, self._score, self._home_score, stages,
                _NOISE if sample else 0.0, self._rng, self._workspace, self._record, routes,
                lengths,
            )  # fmt: skip
            if cost_s < best_s:
                best_s = cost_s
                self._routes[:], self._lengths[:] = routes, lengths
        if self._changes:
            self._improve(problem, blocked)

    def _improve(self, problem: RoutingProblem, blocked: BoolArray) -> None:
        """Make the routes cheaper; when what is blocked opens is not known, but expected."""
        effort = SearchEffort(self._changes, hottest_s=_HOTTEST_S, total_weight=WEIGHT)
        seed = int(self._rng.integers(2**31))
        order = routes_of(self.of_all())
        if blocked[problem.open_waypoints].any() and problem.may_fly.any():
            known = improve_routes(problem, order, replace(effort, moves=0), 0)
            opens_s = _OPENS_AFTER * float(known.seconds[problem.may_fly].mean())
            later = problem.replace(release_s=np.where(blocked, opens_s, 0.0))
            found = improve_routes(later, order, effort, seed)
            if len(found.left_out) <= len(known.left_out):
                self.take(found.routes)
                return
        self.take(improve_routes(problem, order, effort, seed).routes)
