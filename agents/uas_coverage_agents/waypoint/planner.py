"""The shipped policy that chooses waypoints, as a planner: `learned-waypoint`."""

from collections.abc import Mapping
from pathlib import Path

from pydantic import Field

from uas_coverage_agents.policy.directory import load_policy
from uas_coverage_agents.waypoint.pilot import WaypointPilot
from uas_coverage_env.flight import AssistedOptions
from uas_coverage_env.scenario import Scenario
from uas_coverage_env.world import Command, SwarmState

SHIPPED = Path(__file__).parents[1] / "shipped" / "learned-waypoint"


class LearnedWaypointOptions(AssistedOptions):
    """Options of `LearnedWaypoint`."""

    simulations: int = Field(
        default=32,
        ge=0,
        le=100_000,
        description="missions simulated before a decision; 0: the network decides alone",
    )


class LearnedWaypoint:
    """Flies each UAS to the waypoints that a trained network chooses, tried out in simulation."""

    Options = LearnedWaypointOptions

    def __init__(self, options: LearnedWaypointOptions | None = None) -> None:
        self.options = options or LearnedWaypointOptions()
        self.assistants = self.options.assistants
        self.policy = load_policy(SHIPPED)
        self._pilot = WaypointPilot(self.policy, self.assistants, self.options.simulations)

    @property
    def fingerprint(self) -> str:
        """What the flights depend on beside the options: the checksum of the weights."""
        return self.policy.description.weights_sha256

    def warm_up(self, scenario: Scenario) -> None:
        """Compile what needs compiling."""
        self._pilot.warm_up(scenario)

    def reset(self, scenario: Scenario, seed: int) -> None:
        """Start a new mission; simulations draw from the seed."""
        self._pilot.reset(scenario, seed)

    def act(self, swarm: SwarmState) -> Mapping[str, Command]:
        """Choose targets for those that need one; the others go on."""
        return self._pilot.act(swarm)
