"""How missions are flown and paid: what every environment can be told, in one record."""

import functools
import inspect
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields
from typing import Any, TypedDict, TypeVar, get_args, get_type_hints

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.entities.codes import DynamicsName
from uas_coverage_env.env.actions import ActionKind
from uas_coverage_env.env.observation import ObservationBlock
from uas_coverage_env.env.rewards import RewardTerm
from uas_coverage_env.env.rewards.term import weights_of
from uas_coverage_env.env.versions import V0, Version, version_named
from uas_coverage_env.features.feature import MissionFeature, checked_features
from uas_coverage_env.files.blocks import checked_blocks
from uas_coverage_env.scenario import Scenario
from uas_coverage_env.world.packs import mission_features

F = TypeVar("F", bound=Callable[..., Any])

_LONGEST = 100_000
_SWITCHES = ("return_mode", "safety_filter", "mask_in_observation", "images_apart", "flat_infos")


class UnknownArgumentError(ValueError, TypeError):
    """An argument that there is not.

    A ValueError like all that is wrong in settings; and Python's own TypeError, for libraries that
    find out which arguments an environment takes (TorchRL's `GymEnv`).
    """


class MissionKeywords(TypedDict, total=False):
    """The keyword arguments of all environments, with their types: see `MissionSettings`."""

    action: str | ActionKind
    dynamics: DynamicsName
    return_mode: bool
    safety_filter: bool
    reward_weights: Mapping[str, float] | None
    max_cycles: int | None
    observation: str | tuple[ObservationBlock, ...] | None
    reward: tuple[RewardTerm, ...] | None
    disturbances: tuple[MissionFeature, ...] | None
    mask_in_observation: bool
    images_apart: bool
    flat_infos: bool | None


_INSIDE = {"max_cycles": "max_steps"}
"""Keyword arguments that bear the name which libraries have for them -> the name here."""


def inside_name(keyword: str) -> str:
    """The attribute of `MissionSettings` that a keyword argument is."""
    return _INSIDE.get(keyword, keyword)


@dataclass(frozen=True)
class MissionSettings:
    """What the environments take as keyword arguments, whatever their interface.

    Attributes:
        action: "velocity", "acceleration", "wrench", "waypoint" (v1: "planar"); or an `ActionKind`.
        dynamics: "lpv", or "nonlinear": six degrees of freedom, powertrain, exact power.
        return_mode: The world flies a UAS home in time, whatever its actions.
        safety_filter: The world replaces commands after which a UAS could not brake in time.
        reward_weights: Mapping from reward term to weight; the other terms keep theirs.
        max_steps: Time limit of the mission [steps]; None: the scenario's `max_steps`.
        observation: Blocks that the observation is made of, see `ObservationBlock`; the name of an
            observation (`default`, `local`, `grid`); None: those of the version.
        reward: Terms that the reward is made of, see `RewardTerm`; None: those of the version.
        disturbances: Blocks that act on the world, see `Disturbance`; None: those of the scenario;
            (): none.
        mask_in_observation: With discrete actions (`waypoint`), an observation is a dictionary of
            `observation` and `action_mask`, and the infos have no mask. For libraries that do not
            read infos.
        images_apart: An observation with pictures (`grid`) is a dictionary of `observation` and a
            uint8 `Box` (channels, rows, columns; 255 for 1) for each of them; a picture alone is
            that `Box`.
        flat_infos: Infos have `reward_terms_home` and so on instead of sub-dictionaries. For
            libraries that make an array of every info (TorchRL). None: as in the version.
        version: Which version of the environments this is, or its name (`v1`).

    Raises:
        ValueError: A value is none of what is allowed; says what is.
    """

    action: str | ActionKind = "velocity"
    dynamics: DynamicsName = "lpv"
    return_mode: bool = False
    safety_filter: bool = False
    reward_weights: Mapping[str, float] | None = None
    max_steps: int | None = None
    observation: Any = None
    reward: Any = None
    disturbances: tuple[MissionFeature, ...] | None = None
    mask_in_observation: bool = False
    images_apart: bool = False
    flat_infos: bool | None = None
    version: Version = V0

    def __post_init__(self) -> None:
        version = version_named(self.version)
        object.__setattr__(self, "version", version)
        version.kind_of(self.action)
        if self.dynamics not in get_args(DynamicsName):
            allowed = ", ".join(get_args(DynamicsName))
            raise ValueError(f"dynamics is {self.dynamics!r}; it is one of {allowed}")
        if self.flat_infos is None:
            object.__setattr__(self, "flat_infos", version.flat_infos)
        for name in _SWITCHES:
            switch = getattr(self, name)
            if not isinstance(switch, bool | np.bool_):
                raise ValueError(f"{name} is {switch!r}; it is True or False")
            object.__setattr__(self, name, bool(switch))
        if self.mask_in_observation and not self.chooses:
            raise ValueError(
                f"mask_in_observation is True, and action {self.kind.name!r} has no choices to "
                f'mask; take action="waypoint", or leave it out'
            )
        steps = self.max_steps
        whole = isinstance(steps, int | np.integer) and not isinstance(steps, bool)
        if steps is not None and (not whole or not 1 <= steps <= _LONGEST):
            raise ValueError(f"max_cycles is {steps!r}; give a whole number from 1 to {_LONGEST}")
        blocks = version.blocks_of(self.observation)
        blocks = checked_blocks("observation", "blocks", blocks, ObservationBlock)
        object.__setattr__(self, "observation", blocks)
        if self.images_apart and not any(block.shape for block in blocks):
            raise ValueError(
                "images_apart is True, and no block of the observation is a picture; "
                'take observation="grid", or leave it out'
            )
        terms = version.reward if self.reward is None else self.reward
        terms = checked_blocks("reward", "terms", terms, RewardTerm)
        object.__setattr__(self, "reward", terms)
        weights_of(terms, self.reward_weights)
        if self.disturbances is not None:
            object.__setattr__(self, "disturbances", checked_features(self.disturbances))

    @classmethod
    def of(
        cls, given: Mapping[str, Any], version: Version | None = None, beside: Sequence[str] = ()
    ) -> "MissionSettings":
        """The settings of keyword arguments.

        Args:
            given: Name -> value, see `MissionKeywords`; and `version`, of settings of a level.
            version: Of the environment; None: as given, or the first.
            beside: Other keyword arguments of the function that takes them, for its error.

        Raises:
            ValueError: There is no such setting, or a value is none of what is allowed.
        """
        known = tuple(MissionKeywords.__annotations__)
        given = dict(given)
        told = version_named(given.pop("version", version or V0))
        if version is not None and told is not version:
            raise ValueError(
                f"version is {told.name}, and the environment's is {version.name}; take that of "
                f"uas_coverage_{told.name}"
            )
        for name in given:
            if name not in known:
                taken = ", ".join((*beside, *known))
                raise UnknownArgumentError(
                    f"unexpected keyword argument {name!r}; there are {taken}"
                )
        inside = {inside_name(name): value for name, value in given.items()}
        return cls(**inside, version=told)

    @property
    def weights(self) -> NDArray[np.float64]:
        """(R,) the weights of the terms."""
        return weights_of(self.reward, self.reward_weights)

    @functools.cached_property
    def term_names(self) -> tuple[str, ...]:
        """(R,) the names of the terms."""
        return tuple(term.name for term in self.reward)

    @property
    def observation_size(self) -> int:
        """Numbers in the observation of one UAS."""
        return sum(block.size for block in self.observation)

    @property
    def rows_alone(self) -> bool:
        """Whether observations are shown as the rows that they are computed as."""
        return not (self.mask_in_observation or self.images_apart)

    @property
    def kind(self) -> ActionKind:
        """The kind of action."""
        return self.version.kind_of(self.action)

    @property
    def chooses(self) -> bool:
        """Whether the action is a choice."""
        return self.kind.choices > 0

    def features_in(self, scenario: Scenario) -> tuple[MissionFeature, ...]:
        """What the missions of a scenario have of what few have."""
        return mission_features(scenario, self.disturbances)

    def limited(self, scenario: Scenario) -> Scenario:
        """The scenario with this time limit; return mode and the observed time know it."""
        if self.max_steps is None:
            return scenario
        return scenario.model_copy(update={"max_steps": int(self.max_steps)})


def takes_settings(function: F) -> F:
    """Show, for each of `**settings`, its name, type and default in the signature."""
    hints = get_type_hints(MissionKeywords)
    defaults = {field.name: field.default for field in fields(MissionSettings)}
    signature = inspect.signature(function)
    own = [each for each in signature.parameters.values() if each.kind != each.VAR_KEYWORD]
    named = [
        inspect.Parameter(
            name,
            inspect.Parameter.KEYWORD_ONLY,
            default=defaults[inside_name(name)],
            annotation=hints[name],
        )
        for name in MissionKeywords.__annotations__
    ]
    shown: Any = function
    shown.__signature__ = signature.replace(parameters=[*own, *named])
    return function


def described_as(function: F) -> Callable[[Any], F]:
    """Give a function the signature and the words of the same one in another version."""
    described: Any = functools.wraps(function, assigned=("__doc__",))
    return described
