"""Flies the routes that a policy builds, along the velocities that it weighs."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from uas_coverage_agents.policy.description import Observation
from uas_coverage_agents.policy.directory import Policy
from uas_coverage_agents.policy.route_networks import RouteNetworks
from uas_coverage_agents.route.fleet_routes import SAMPLES, FleetRoutes
from uas_coverage_agents.route.layers import layers_of
from uas_coverage_agents.route.layout import LAYOUT, observed_groups, route_networks
from uas_coverage_agents.route.leg_flight import AHEAD, steer_along
from uas_coverage_env.flight import Assistants
from uas_coverage_env.mission import MissionBrief, first_sight
from uas_coverage_env.world import COMMAND_DTYPE, Command, SwarmState, Velocity


def observation() -> Observation:
    """What the policy reads."""
    return Observation.of(LAYOUT, observed_groups(), {})


class RouteRunner:
    """Builds the routes of all UAS, and again when something happens; flies along them.

    Args:
        policy: Of the interface "route".
        assistants: The assistants of the world that fly along.
        samples: Routes that are built; the cheapest by estimated times are flown.

    Raises:
        ValueError: The policy was trained on another observation, or has another network.
    """

    def __init__(self, policy: Policy, assistants: Assistants, samples: int = SAMPLES) -> None:
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
        self._samples = samples

    def warm_up(self, brief: MissionBrief) -> None:
        """Compile all that decides."""
        self.reset(brief, 0)
        self.act(first_sight(brief))

    def reset(self, brief: MissionBrief, seed: int) -> None:
        """Build the first routes; samples draw from the seed."""
        self._routes = FleetRoutes(brief, seed, self._score, self._home_score, self._samples)
        from uas_coverage_baselines.routing.terrain import _raised
        from uas_coverage_env.world import build_arena
        r=_raised(brief)
        self._around = build_arena((r or brief).as_scenario())
        self._command = np.zeros(1, COMMAND_DTYPE)[0]
        self._ahead = np.full(AHEAD, -1)

    def act(self, swarm: SwarmState) -> Mapping[str, Command]:
        """Fly on along the routes; build them again where they are no longer right."""
        self._routes.update(swarm)
        return {name: self._command_of(swarm, swarm.names.index(name)) for name in swarm.active}

    def _command_of(self, swarm: SwarmState, u: int) -> Command:
        routes, state = self._routes, self._routes.view.state
        if (guided := routes.guided(swarm, u)) is not None:
            return guided
        targets = routes.of(u)[:AHEAD]
        self._ahead[: len(targets)] = targets
        if not steer_along(
            routes.view.arena, self._around, u, state.x[u], state.reference[u], self._ahead, len(targets),
            self._flight, 1, 0.0, self._command,
        ):  # fmt: skip
            return routes.onwards(u)
        north_mps, east_mps, altitude_m, _ = self._command["values"].tolist()
        return Velocity(north_mps, east_mps, altitude_m, routes.mode(u))
