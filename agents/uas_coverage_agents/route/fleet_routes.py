"""The routes of the whole fleet: built before take-off, and again when something happens."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from uas_coverage_agents.route.clock import IN_THE_AIR, home_seconds, leg_seconds
from uas_coverage_agents.route.improvement import improve
from uas_coverage_agents.route.layers import Layers
from uas_coverage_agents.route.mission import MissionMaker
from uas_coverage_agents.route.order import SPARE_S, build, no_record, route_workspace
from uas_coverage_env.entities.state import LANDED
from uas_coverage_env.mission import MissionBrief, first_sight
from uas_coverage_env.mission.access import Access
from uas_coverage_env.planning.following import Following
from uas_coverage_env.world import Command, GoTo, SwarmState

BoolArray = NDArray[np.bool_]
SAMPLES = 64
"""Routes that are built before the best are flown; the first without noise."""

_NOISE = 1.0
_AGAIN_STEPS = 10


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
        self._following, self._missions = Following(brief), MissionMaker(brief)
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
            place, before_m = IN_THE_AIR, self._mission.here_m[u]
            took_s = np.diff(at_s, prepend=0.0)
            for w, seconds in zip(self.of(u).tolist(), took_s, strict=False):
                leg_s = leg_seconds(self._mission, u, place, before_m, w)
                if place != IN_THE_AIR:
                    self._more_s[place, w] += max(seconds - leg_s, 0.0)
                before_m = before_m if place == IN_THE_AIR else self._mission.place_m[place]
                place = w
            if place != IN_THE_AIR:
                home_s = home_seconds(self._mission, u, place, before_m)
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
        mission = self._missions.mission(swarm, works, blocked)
        mission = self._mission = mission._replace(
            between_s=mission.between_s + self._more_s, home_s=mission.home_s + self._more_home_s
        )
        routes, lengths = self._routes.copy(), self._lengths.copy()
        best_s = np.inf
        for sample in range(max(self._samples, 1)):
            cost_s = build(
                mission, self._score, self._home_score, wanted, _NOISE if sample else 0.0,
                self._rng, self._workspace, self._record, routes, lengths,
            )  # fmt: skip
            if cost_s < best_s:
                best_s = cost_s
                self._routes[:], self._lengths[:] = routes, lengths
        improve(mission, self._changes, SPARE_S, self._rng, self._routes, self._lengths)
