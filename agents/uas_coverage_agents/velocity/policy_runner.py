"""Flies with a policy that commands velocities."""

from collections.abc import Mapping

import numpy as np

from uas_coverage_agents.policy.attention import Attention
from uas_coverage_agents.policy.description import Observation
from uas_coverage_agents.policy.directory import Policy
from uas_coverage_agents.velocity.stuck_detection import StuckDetection
from uas_coverage_env.env import OBSERVATION_SIZE, MissionInterface, observation_columns
from uas_coverage_env.env.actions import ACTIONS
from uas_coverage_env.env.actions.given import actions_of
from uas_coverage_env.env.observation import OBSERVATION
from uas_coverage_env.env.observation.scales import SCALES
from uas_coverage_env.flight import Assistants
from uas_coverage_env.mission import MissionBrief, first_sight
from uas_coverage_env.mission.approach import Approach
from uas_coverage_env.world import Command, SwarmState, Velocity

LAYOUT = "uas_coverage_v0"
OUTPUTS = 3


def observation() -> Observation:
    """What the policy reads: the observation of the environment, as it is."""
    return Observation.of(LAYOUT, OBSERVATION, SCALES)


def attention_network(hidden: int, keys: int) -> Attention:
    """The attention network that reads `observation()`."""
    there = observation_columns("waypoints", "valid")[:, 0].tolist()
    return Attention(
        inputs=OBSERVATION_SIZE,
        outputs=OUTPUTS,
        before=there[0],
        candidates=len(there),
        features=there[1] - there[0],
        keys=keys,
        hidden=hidden,
    )


class VelocityRunner:
    """Every UAS on its own, with the same network: its observation in, its velocity out.

    Args:
        policy: Of the interface "velocity".
        assistants: Those that fly along; they change nothing here.

    Raises:
        ValueError: The policy was trained on another observation, or gives other outputs.
    """

    def __init__(self, policy: Policy, assistants: Assistants) -> None:
        description = policy.description
        if not description.observation.has_the_numbers_of(observation()):
            raise ValueError("its observation is not that of this version; train it anew")
        if description.network.outputs != OUTPUTS:
            raise ValueError(f"network.outputs is {description.network.outputs}, not {OUTPUTS}")
        self._policy = policy

    def warm_up(self, brief: MissionBrief) -> None:
        """Compile the observation."""
        MissionInterface(brief).observe(first_sight(brief))

    def reset(self, brief: MissionBrief, seed: int) -> None:
        """Start a new mission; nothing is drawn."""
        self._observer = MissionInterface(brief)
        self._approach = Approach(brief)
        self._stuck = StuckDetection(len(brief.uas), len(brief.waypoints), brief.dt_s)
        ranges = actions_of(ACTIONS[0], brief.as_scenario()).ranges
        lowest, self._middle, highest = np.moveaxis(ranges, 2, 0)
        self._below, self._above = self._middle - lowest, highest - self._middle

    def act(self, swarm: SwarmState) -> Mapping[str, Command]:
        """The mean action of the policy, scaled to the vehicle as the environment does.

        A waypoint that the policy has tried in vain before is flown to as guidance does.
        """
        view = self._stuck.filter(self._observer.observe(swarm), self._observer.candidates)
        outputs = self._policy.forward(view)
        shares = np.clip(outputs, -1.0, 1.0)
        values = self._middle + shares * np.where(shares < 0.0, self._below, self._above)
        hard = self._stuck.hard_ones
        return {
            name: self._approach.command(swarm, i, int(hard[i]))
            if hard[i] >= 0
            else Velocity(float(north_mps), float(east_mps), float(altitude_m))
            for i, (name, (north_mps, east_mps, altitude_m)) in enumerate(
                zip(swarm.names, values, strict=True)
            )
            if name in swarm.active
        }
