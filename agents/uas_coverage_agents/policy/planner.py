"""A policy as a planner: `--planner policy:DIR`."""

from collections.abc import Mapping
from importlib.metadata import EntryPoint
from pathlib import Path
from typing import Any, ClassVar, Protocol

from pydantic import Field

from uas_coverage_agents.policy.directory import Policy, load_policy
from uas_coverage_env.files.strict_toml import InputError
from uas_coverage_env.flight import Assistants, AssistedOptions
from uas_coverage_env.mission import MissionBrief
from uas_coverage_env.mission.refusal import refuse_what_asks
from uas_coverage_env.tasks.in_batch import BatchedPolicy
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
    "environment": "uas_coverage_agents.training.policy_runner:EnvironmentRunner",
}
"""Interface of a policy -> entry point of its runner, `PolicyRunner(policy, assistants)`; loaded
where it flies, since runners import this package."""

_IN_NUMPY = {"actor": "uas_coverage_agents.policy.environment:ActorRunner"}
"""The same for those kinds of network that need nothing else, whatever their interface."""


def runner_of(policy: Policy, assistants: Assistants, *, trust: bool = False) -> PolicyRunner:
    """The runner that flies a policy.

    Args:
        policy: The policy.
        assistants: Those that fly along.
        trust: Whether a class of its author's own may be imported, where it names one.

    Raises:
        InputError: What it needs is not installed.
        ValueError: The policy cannot be flown; says why.
    """
    interface, kind = policy.description.interface, policy.description.network.kind
    try:
        runner = EntryPoint(interface, _IN_NUMPY.get(kind) or RUNNERS[interface], "").load()
    except ModuleNotFoundError as error:
        if (error.name or "").startswith("uas_coverage"):
            raise  # ours is always there
        raise InputError(
            f"it flies by the library that trained it, and {error.name} is not installed: "
            f"python -m pip install 'uas-coverage-env[learn]'"
        ) from error
    more = {"trust": trust} if kind == "library" else {}
    return runner(policy, assistants, **more)


class PolicyOptions(AssistedOptions):
    """Options of `policy:DIR`."""

    trust: bool = Field(
        default=False,
        description="import the class of its author's own that the policy names",
    )


class PolicyPlanner:
    """Flies a trained policy: a directory with `policy.json` and `policy.safetensors`.

    Args:
        options: The assistants that fly along.
        argument: The directory.

    Raises:
        InputError: The directory holds no policy that can be flown; names file and field.
    """

    Options: ClassVar[Any] = PolicyOptions
    argument = "DIR"

    def __init__(self, options: AssistedOptions | None, argument: str | Path) -> None:
        self.options = options or AssistedOptions()
        self.assistants = self.options.assistants
        self.argument = str(argument)
        self.policy = load_policy(argument)
        try:
            self._runner = self._make_runner()
        except (InputError, ValueError) as error:
            raise InputError(f"{self.argument}: cannot be flown: {error}") from error

    def _make_runner(self) -> PolicyRunner:
        trust = getattr(self.options, "trust", False)
        return runner_of(self.policy, self.assistants, trust=trust)

    @property
    def fingerprint(self) -> str:
        """What the flights depend on beside the options: the checksum of the weights."""
        return self.policy.description.weights_sha256

    @property
    def in_batch(self) -> BatchedPolicy | None:
        """The same for many UAS or swarms at once; None: it flies one mission at a time."""
        return getattr(self._runner, "in_batch", None)

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
