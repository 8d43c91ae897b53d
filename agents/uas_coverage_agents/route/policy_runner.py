"""Flies the routes that a policy builds, along the velocities that it weighs."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from uas_coverage_agents.policy.description import Observation
from uas_coverage_agents.policy.directory import Policy
from uas_coverage_agents.policy.route_networks import RouteNetworks
from uas_coverage_agents.route.layers import layers_of
from uas_coverage_agents.route.layout import LAYOUT, observed_groups, route_networks
from uas_coverage_agents.route.leg_flight import AHEAD, steer_along
from uas_coverage_agents.route.mission import MissionMaker
from uas_coverage_agents.route.order import build, no_record, route_workspace
from uas_coverage_env.flight import Assistants
from uas_coverage_env.mission import (
    Approach,
    Attempts,
    Handover,
    MissionBrief,
    Recall,
    WorldView,
    first_sight,
)
from uas_coverage_env.world import (
    COMMAND_DTYPE,
    LANDED,
    Command,
    GoTo,
    SwarmState,
    Velocity,
)

BoolArray = NDArray[np.bool_]
SAMPLES = 64
"""Routes that are built before the best are flown; the first without noise."""

_NOISE = 1.0
_AGAIN_STEPS = 10


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
        self._view, self._missions = WorldView(brief), MissionMaker(brief)
        self._attempts, self._approach = Attempts(brief), Approach(brief)
        self._handover = Handover(brief)
        n_uas, n_waypoints = len(brief.uas), len(brief.waypoints)
        self._workspace, self._record = route_workspace(), no_record()
        self._routes = np.full((n_uas, n_waypoints), -1)
        self._lengths = np.zeros(n_uas, np.int64)
        self._rng = np.random.default_rng(seed)
        self._built_for: tuple[BoolArray, ...] | None = None
        self._built_at = -_AGAIN_STEPS
        self._command = np.zeros(1, COMMAND_DTYPE)[0]
        self._ahead = np.full(AHEAD, -1)
        self._recall, self._returns = Recall(n_uas), np.zeros(n_uas, np.bool_)
        self._act_on(first_sight(brief))

    def act(self, swarm: SwarmState) -> Mapping[str, Command]:
        """Fly on along the routes; build them again where they are no longer right."""
        blocked = self._act_on(swarm)
        targets = {
            u: int(self._routes[u, 0]) for u in range(len(swarm.names)) if self._lengths[u] > 0
        }
        flown_to = {swarm.names[u]: w for u, w in targets.items()}
        self._attempts.update(swarm, flown_to, blocked)
        return {
            name: self._command_of(swarm, swarm.names.index(name), blocked) for name in swarm.active
        }

    def _act_on(self, swarm: SwarmState) -> BoolArray:
        self._view.update(swarm)
        blocked = self._view.blocked()
        wanted = self._attempts.wanted(swarm.uncovered)
        if swarm.uncovered.any():
            # the rule of return mode, which need not be on
            self._returns = self._recall.update(swarm, self._view)
        works = self._handover.workers(swarm) & ~self._returns
        self._forget_covered(swarm.uncovered, works)
        if self._has_to_build(swarm, wanted, blocked, works):
            self._build(swarm, wanted, blocked, works)
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

    def _forget_covered(self, uncovered: BoolArray, works: BoolArray) -> None:
        for u in range(len(self._lengths)):
            route = self._routes[u, : self._lengths[u]]
            kept = route[uncovered[route]] if works[u] else route[:0]
            if len(kept) < len(route):
                self._routes[u, : len(kept)] = kept
                self._lengths[u] = len(kept)

    def _build(
        self, swarm: SwarmState, wanted: BoolArray, blocked: BoolArray, works: BoolArray
    ) -> None:
        mission = self._missions.mission(swarm, works, blocked)
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

    def _command_of(self, swarm: SwarmState, u: int, blocked: BoolArray) -> Command:
        if swarm.returning[u] or self._returns[u]:
            return GoTo(None)
        n = int(self._lengths[u])
        if n == 0 and not swarm.departed[u]:
            return GoTo(None)
        if n > 0:
            target = int(self._routes[u, 0])
            if self._attempts.is_hard(u, target):
                return self._approach.command(swarm, u, target)
            if blocked[target]:
                return GoTo(target, mode="covering")
        ahead = min(n, AHEAD)
        self._ahead[:ahead] = self._routes[u, :ahead]
        x = self._view.state.x[u]
        reference = self._view.state.reference[u]
        if not steer_along(
            self._view.arena, u, x, reference, self._ahead, ahead, self._flight, self._command
        ):
            return GoTo(int(self._routes[u, 0]), mode="covering") if n else GoTo(None)
        north_mps, east_mps, altitude_m, _ = self._command["values"].tolist()
        return Velocity(north_mps, east_mps, altitude_m, "covering" if n else "return")
