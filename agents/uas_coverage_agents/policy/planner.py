"""A policy as a planner: `--planner policy:DIR`."""

from collections.abc import Mapping
from importlib.metadata import EntryPoint
from pathlib import Path
from typing import Protocol

from uas_coverage_agents.policy.directory import Policy, load_policy
from uas_coverage_env.files.strict_toml import InputError
from uas_coverage_env.flight import Assistants, AssistedOptions
from uas_coverage_env.mission import MissionBrief
from uas_coverage_env.mission.refusal import refuse_what_asks
from uas_coverage_env.world import Command, SwarmState


class PolicyRunner(Protocol):
    """Flies a swarm with a policy of its interface; a planner without options."""

    def warm_up(self, brief: MissionBrief) -> None:
        """Compile what needs compiling."""
        ...

    def reset(self, brief: MissionBrief, seed: int) -> None:
        """Start a new mission."""
        ...

    def act(self, swarm: SwarmState) -> Mapping[str, Command]:
        """Give each active UAS its command."""
        ...


RUNNERS = {
    "route": "uas_coverage_agents.route.policy_runner:RouteRunner",
    "route-velocity": "uas_coverage_agents.route.velocity_runner:RouteVelocityRunner",
    "velocity": "uas_coverage_agents.velocity.policy_runner:VelocityRunner",
    "waypoint": "uas_coverage_agents.waypoint.policy_runner:WaypointRunner",
}
"""Interface of a policy -> entry point of its runner, `PolicyRunner(policy, assistants)`; loaded
where it flies, since runners import this package."""


def runner_of(policy: Policy, assistants: Assistants) -> PolicyRunner:
    """The runner that flies a policy.

    Raises:
        ValueError: The policy cannot be flown; says why.
    """
    interface = policy.description.interface
    return EntryPoint(interface, RUNNERS[interface], "").load()(policy, assistants)


class PolicyPlanner:
    """Flies a trained policy: a directory with `policy.json` and `policy.safetensors`.

    Args:
        options: The assistants that fly along.
        argument: The directory.

    Raises:
        InputError: The directory holds no policy that can be flown; names file and field.
    """

    Options = AssistedOptions
    argument = "DIR"

    def __init__(self, options: AssistedOptions | None, argument: str | Path) -> None:
        self.options = options or AssistedOptions()
        self.assistants = self.options.assistants
        self.argument = str(argument)
        self.policy = load_policy(argument)
        try:
            self._runner = self._make_runner()
        except ValueError as error:
            raise InputError(f"{self.argument}: cannot be flown: {error}") from error

    def _make_runner(self) -> PolicyRunner:
        return runner_of(self.policy, self.assistants)

    @property
    def fingerprint(self) -> str:
        """What the flights depend on beside the options: the checksum of the weights."""
        return self.policy.description.weights_sha256

    def warm_up(self, brief: MissionBrief) -> None:
        """Compile what needs compiling."""
        refuse_what_asks(brief)
        self._runner.warm_up(brief)

    def reset(self, brief: MissionBrief, seed: int) -> None:
        """Start a new mission."""
        refuse_what_asks(brief)
        self._runner.reset(brief, seed)

    def act(self, swarm: SwarmState) -> Mapping[str, Command]:
        """Let the policy decide."""
        return self._runner.act(swarm)
