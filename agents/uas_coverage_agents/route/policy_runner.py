"""Flies the routes that a policy builds, along the velocities that it weighs."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from uas_coverage_agents.policy.description import Observation
from uas_coverage_agents.policy.directory import Policy
from uas_coverage_agents.policy.route_networks import RouteNetworks
from uas_coverage_agents.route.fleet_routes import CHANGES, SAMPLES, FleetRoutes
from uas_coverage_agents.route.layers import layers_of
from uas_coverage_agents.route.layout import LAYOUT, observed_groups, route_networks
from uas_coverage_agents.route.leg_flight import AHEAD
from uas_coverage_agents.route.leg_plan import plan_along
from uas_coverage_agents.route.leg_search import HORIZON, search_workspace
from uas_coverage_agents.route.order import WEIGHT
from uas_coverage_agents.route.rehearsal import CANDIDATES, Rehearsal, in_large_missions
from uas_coverage_env.flight import Assistants
from uas_coverage_env.mission import MissionBrief, first_sight
from uas_coverage_env.mission.learnt_wind import LearntWind, in_disturbances
from uas_coverage_env.planning.routing.terrain import raised
from uas_coverage_env.world import Command, SwarmState, Velocity, build_arena


def observation() -> Observation:
    """What the policy reads."""
    return Observation.of(LAYOUT, observed_groups(), {})


class RouteRunner:
    """Builds the routes of all UAS, and again when something happens; flies along them.

    Args:
        policy: Of the interface "route".
        assistants: The assistants of the world that fly along.
        samples: Sets of routes that are built.
        changes: By which the cheapest of these, by estimated times, is improved before it is flown.
        rehearsed: Sets of routes that are built in this way and rehearsed; 0: none is, and flights
            are searched step by step.

    Raises:
        ValueError: The policy was trained on another observation, or has another network.
    """

    def __init__(
        self,
        policy: Policy,
        assistants: Assistants,
        samples: int = SAMPLES,
        changes: int = CHANGES,
        rehearsed: int = CANDIDATES,
    ) -> None:
        described = policy.description
        if described.observation != observation():
            raise ValueError("its observation is not that of this version; train it anew")
        if not isinstance(described.network, RouteNetworks):
            raise ValueError(f"network.kind is {described.network.kind!r}, not 'routes'")
        if described.network != route_networks(described.network.order.hidden[0]):
            raise ValueError("its networks do not fit to its observation; train it anew")
        network, tensors = described.network, policy.tensors
        self._score = layers_of(network.order, tensors, "order.")
        self._home_score = layers_of(network.home, tensors, "home.")
        self._flight = layers_of(network.flight, tensors, "flight.")
        self._samples, self._changes, self._rehearsed = samples, changes, rehearsed

    def warm_up(self, brief: MissionBrief) -> None:
        """Compile all that decides."""
        asked = self._samples, self._rehearsed
        self._samples, self._rehearsed = 1, min(self._rehearsed, 1)
        self.reset(brief, 0)
        self._rehearsal = None
        self.act(first_sight(brief))
        self._samples, self._rehearsed = asked

    def reset(self, brief: MissionBrief, seed: int) -> None:
        """Build the first routes; samples and changes draw from the seed."""
        self._routes = FleetRoutes(
            brief, seed, self._score, self._home_score, self._samples, self._changes
        )
        self._arena = self._routes.view.arena
        self._around = build_arena((raised(brief) or brief).as_scenario())
        self._learnt: LearntWind | None = None
        if brief.conditions is not None:
            self._learnt, self._arena = LearntWind(brief), in_disturbances(self._arena)
        rehearses = self._rehearsed and not brief.moving_obstacles and brief.conditions is None
        # elsewhere, guidance is better than a slow start
        self._workspace = search_workspace(
            int(self._arena.rules[0].lookahead_steps), slow_starts=bool(rehearses)
        )
        self._rng = np.random.default_rng(seed)
        self._rehearsal: Rehearsal | None = None
        if rehearses:
            self._rehearsal = Rehearsal(
                self._arena, self._around, self._flight, self._routes.view.state.x, self._rng
            )
            self.choose_routes(self._rehearsal)
        n_uas = len(brief.uas)
        self._plans, self._kept = np.zeros((n_uas, HORIZON, 3)), np.zeros(n_uas, np.bool_)

    def choose_routes(self, rehearsal: Rehearsal) -> None:
        """Fly the cheapest of some sets of routes; each is built with what legs took before."""
        best, best_s = self._routes.of_all(), np.inf
        candidates = in_large_missions(self._rehearsed, len(self._arena.waypoints))
        for candidate in range(candidates):
            routes = self._routes.of_all()
            reached_s = [rehearsal.reached_s(u, route) for u, route in enumerate(routes)]
            times_s = [float(at_s[-1]) for at_s in reached_s]
            cost_s = max(times_s) + WEIGHT * sum(times_s)
            if cost_s < best_s:
                best, best_s = routes, cost_s
            if candidate + 1 < candidates:
                self._routes.build_again(reached_s)
        self.take(best, rehearsal)

    def take(self, routes: list[NDArray[np.int64]], rehearsal: Rehearsal) -> None:
        """Fly along routes as they are rehearsed."""
        self._routes.take(routes)
        rehearsal.take(routes)

    def act(self, swarm: SwarmState) -> Mapping[str, Command]:
        """Fly on along the routes; build them again where they are no longer right."""
        self._routes.update(swarm)
        if self._learnt is not None:
            self._learnt.see(swarm)
        return {name: self._command_of(swarm, swarm.names.index(name)) for name in swarm.active}

    def _command_of(self, swarm: SwarmState, u: int) -> Command:
        routes = self._routes
        kept, self._kept[u] = bool(self._kept[u]), False
        if (guided := routes.guided(swarm, u)) is not None:
            return guided
        velocity = None
        if self._rehearsal is not None:
            velocity = self._rehearsal.next(u, swarm.x[u], routes.of(u))
        if velocity is None:
            velocity = self._searched(u, kept)
        if velocity is None:
            return routes.onwards(u)
        north_mps, east_mps, altitude_m = velocity
        return Velocity(north_mps, east_mps, altitude_m, routes.mode(u))

    def _searched(self, u: int, kept: bool) -> list[float] | None:
        """Velocity north and east [m/s] and altitude [m]: the first of a plan."""
        state, plan = self._routes.view.state, self._plans[u]
        belief = None if self._learnt is None else self._learnt.belief[u]
        if not plan_along(
            self._arena, self._around, u, state.x[u], state.uas[u].reference_mps[:],
            self._routes.of(u)[:AHEAD], self._flight, plan, kept, self._rng, self._workspace,
            belief,
        ):  # fmt: skip
            return None
        velocity = plan[0].tolist()
        plan[:-1] = plan[1:]
        self._kept[u] = True
        return velocity
