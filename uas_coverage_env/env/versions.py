"""What a version of the environments is: tuples of what is observed, done, paid and told."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from importlib import import_module
from typing import Any

from uas_coverage_env.env.actions import ACTIONS, ACTIONS_V1, ActionKind
from uas_coverage_env.env.observation import OBSERVATION, ObservationBlock
from uas_coverage_env.env.observation.layout import OBSERVATION_V1
from uas_coverage_env.env.observation.named import OBSERVATIONS, OBSERVATIONS_V1
from uas_coverage_env.env.report import INFOS, InfoField
from uas_coverage_env.env.rewards import REWARD, RewardTerm
from uas_coverage_env.env.rewards.version_1 import REWARD_V1
from uas_coverage_env.registration import version_names


@dataclass(frozen=True)
class Version:
    """A version of the environments.

    The step that is compiled for it contains the kernels of its tuples; those of a user's blocks,
    terms and kinds are called at their address. So another version is another compiled step beside
    the others, made from its tuples alone.

    Attributes:
        name: What comes behind the underscore: `v0`.
        observation: Blocks that an observation is made of, unless others are given.
        reward: Terms that the reward is made of, unless others are given.
        actions: Kinds that `action=` knows by their names.
        infos: What is told of a UAS.
        observations: What `observation=` knows by name: name -> blocks.
        flat_infos: Whether infos have no sub-dictionaries, unless it is said otherwise.
    """

    name: str
    observation: tuple[ObservationBlock, ...]
    reward: tuple[RewardTerm, ...]
    actions: tuple[ActionKind, ...]
    infos: tuple[InfoField, ...] = INFOS
    observations: Mapping[str, tuple[ObservationBlock, ...]] = field(
        default_factory=dict, compare=False
    )
    flat_infos: bool = False

    def __reduce__(self) -> tuple[Any, ...]:
        # kernels know a version by its identity
        if self.name in version_names() and version_named(self.name) is self:
            return version_named, (self.name,)
        return super().__reduce__()  # pyrefly: ignore[bad-return]

    def kind_of(self, action: Any) -> ActionKind:
        """The kind of action that is meant.

        Args:
            action: A kind, or the name of one of `actions`.

        Raises:
            ValueError: It is neither.
        """
        if isinstance(action, ActionKind):
            return action
        for kind in self.actions:
            if kind.name == action:
                return kind
        names = ", ".join(kind.name for kind in self.actions)
        raise ValueError(f"action is {action!r}; it is one of {names}, or an ActionKind")

    def blocks_of(self, observation: Any) -> Any:
        """The blocks that are meant.

        Args:
            observation: Blocks, the name of some, or None for those of this version.

        Raises:
            ValueError: There are none of this name.
        """
        if observation is None:
            return self.observation
        if not isinstance(observation, str):
            return observation
        if observation not in self.observations:
            known = ", ".join(self.observations)
            raise ValueError(
                f"observation is {observation!r}; give one of {known}, or a tuple of blocks"
            )
        return self.observations[observation]


V0 = Version("v0", OBSERVATION, REWARD, ACTIONS, observations=OBSERVATIONS)
"""The first version."""

V1 = Version(
    "v1", OBSERVATION_V1, REWARD_V1, ACTIONS_V1, observations=OBSERVATIONS_V1, flat_infos=True
)
"""As hard as the first, and learnable: see docs/versions.md."""


def version_named(name: str | Version) -> Version:
    """The version of the module `uas_coverage_NAME`; a version itself stays.

    Raises:
        ValueError: There is none.
    """
    if isinstance(name, Version):
        return name
    if name not in version_names():
        raise ValueError(f"version is {name!r}; it is one of {', '.join(version_names())}")
    version: Version = import_module(f"uas_coverage_env.uas_coverage_{name}").VERSION
    return version
