"""Flies the routes that a policy builds, with the velocities that its network commands."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from uas_coverage_agents.policy.description import Observation
from uas_coverage_agents.policy.directory import Policy
from uas_coverage_agents.policy.route_networks import RouteNetworks
from uas_coverage_agents.route.fleet_routes import SAMPLES, FleetRoutes
from uas_coverage_agents.route.layers import layers_of
from uas_coverage_agents.route.leg_flight import AHEAD
from uas_coverage_agents.route.velocity_layout import (
    LAYOUT,
    N_FRAME,
    N_VELOCITY,
    commanded,
    observe_route,
    velocity_groups,
    velocity_networks,
)
from uas_coverage_env.flight import Assistants
from uas_coverage_env.mission import MissionBrief, first_sight
from uas_coverage_env.world import Command, SwarmState, Velocity
from uas_coverage_env.world.routes import NO_WAY

LEARNED_UP_TO_MPS: float = 4.0
"""In a stated mean wind above this, guidance flies along the routes [m/s]: the network learned in
still air."""

LEAST_RADIUS_STEPS = 0.75
"""A sphere with a smaller radius, in steps at top speed, is missed too often: waypoints are covered
at samples. Training had radii of 1.25 steps."""


def velocity_observation() -> Observation:
    """What the policy reads."""
    return Observation.of(LAYOUT, velocity_groups(), {})


class RouteVelocityRunner:
    """Keeps the routes of all UAS as its plan; one network commands the velocity of each.

    Args:
        policy: Of the interface "route-velocity".
        assistants: The assistants of the world that fly along; they change nothing here.
        samples: Sets of routes that are built; the cheapest by estimated times are flown.

    Raises:
        ValueError: The policy was trained on another observation, or has another network.
    """

    learned_up_to_mps = LEARNED_UP_TO_MPS  # of the network that it flies

    def __init__(self, policy: Policy, assistants: Assistants, samples: int = SAMPLES) -> None:
        network, tensors = policy.description.network, policy.tensors
        if not policy.description.observation.has_the_numbers_of(velocity_observation()):
            raise ValueError("its observation is not that of this version; train it anew")
        if not isinstance(network, RouteNetworks):
            raise ValueError(f"network.kind is {network.kind!r}, not 'routes'")
        if network != velocity_networks(network.order, network.flight.hidden):
            raise ValueError("its networks do not fit to its observation; train it anew")
        self._score = layers_of(network.order, tensors, "order.")
        self._home_score = layers_of(network.home, tensors, "home.")
        self._network = network.flight
        self._tensors = {name: tensors[f"flight.{name}"] for name in network.flight.shapes()}
        self._samples = samples

    def warm_up(self, brief: MissionBrief) -> None:
        """Compile all that decides."""
        samples, self._samples = self._samples, 1
        self.reset(brief, 0)
        self.act(first_sight(brief))
        self._samples = samples

    def reset(self, brief: MissionBrief, seed: int) -> None:
        """Build the first routes; samples draw from the seed."""
        self.routes = FleetRoutes(brief, seed, self._score, self._home_score, self._samples)
        said = brief.conditions
        self.routes.by_guidance = said is not None and said.mean_mps > self.learned_up_to_mps
        n_uas = len(brief.uas)
        self.rows, self.frames = np.zeros((n_uas, N_VELOCITY)), np.zeros((n_uas, N_FRAME))
        self.ahead = np.full((n_uas, AHEAD), -1)

    def act(self, swarm: SwarmState) -> Mapping[str, Command]:
        """Fly on along the routes; guidance flies to what is blocked, and home if need be."""
        self.routes.update(swarm)
        commands: dict[str, Command] = {}
        flown = []
        for u in (swarm.names.index(name) for name in swarm.active):
            guided = self.routes.guided(swarm, u)
            if guided is None and (self._is_small(u) or self._look(u) == NO_WAY):
                guided = self.routes.onwards(u)
            if guided is None:
                flown.append(u)
            else:
                commands[swarm.names[u]] = guided
        values = self.velocities(flown).tolist() if flown else []
        for u, (north_mps, east_mps, altitude_m) in zip(flown, values, strict=True):
            mode = self.routes.mode(u)
            commands[swarm.names[u]] = Velocity(north_mps, east_mps, altitude_m, mode)
        return commands

    def velocities(self, flown: Sequence[int]) -> NDArray[np.float64]:
        """The velocities (north, east) [m/s] and altitudes [m] of some UAS, (N, 3)."""
        outputs = self._network.forward(self._tensors, self.rows[flown])
        uas = self.routes.view.arena.uas[flown]
        return commanded(outputs, self.frames[flown], uas["speed_mps"])

    def _is_small(self, u: int) -> bool:
        """Whether UAS u flies to a sphere that is too small for what was learned."""
        arena, route = self.routes.view.arena, self.routes.of(u)
        step_m = arena.uas["speed_mps"][u] * arena.rules["dt_s"][0]
        return (
            len(route) > 0 and arena.waypoints["radius_m"][route[0]] < LEAST_RADIUS_STEPS * step_m
        )

    def _look(self, u: int) -> int:
        view, targets = self.routes.view, self.routes.of(u)[:AHEAD]
        self.ahead[u, : len(targets)] = targets
        return observe_route(
            view.arena, u, view.state.x[u], view.state.uas[u].reference_mps, self.ahead[u],
            len(targets),
            self.rows[u], self.frames[u],
        )  # fmt: skip
