"""How missions are flown and paid: what every environment can be told, in one record."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from typing import Any, get_args

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.env.actions import ActionKind
from uas_coverage_env.env.actions.kinds import kind_of
from uas_coverage_env.env.observation import OBSERVATION, ObservationBlock, observation_named
from uas_coverage_env.env.rewards import REWARD, RewardTerm, weights_of
from uas_coverage_env.features.feature import Feature, checked_features
from uas_coverage_env.files.blocks import checked_blocks
from uas_coverage_env.scenario import Scenario
from uas_coverage_env.simulation import Dynamics
from uas_coverage_env.world.packs import mission_features

_LONGEST = 100_000
_SWITCHES = ("return_mode", "safety_filter", "mask_in_observation", "images_apart", "flat_infos")


class UnknownArgumentError(ValueError, TypeError):
    """An argument that there is not.

    A ValueError like all that is wrong in settings; and Python's own TypeError, for libraries that
    find out which arguments an environment takes (TorchRL's `GymEnv`).
    """


@dataclass(frozen=True)
class MissionSettings:
    """What the environments take as keyword arguments, whatever their interface.

    Attributes:
        action: "velocity", "acceleration", "wrench" or "waypoint"; or an `ActionKind`.
        dynamics: "lpv", or "nonlinear": six degrees of freedom, powertrain, exact power.
        return_mode: The world flies a UAS home in time, whatever its actions.
        safety_filter: The world replaces commands after which a UAS could not brake in time.
        reward_weights: Mapping from reward term to weight; the other terms keep theirs.
        max_cycles: Time limit of the mission in steps; None: the scenario's `max_steps`.
        observation: Blocks that the observation is made of, see `ObservationBlock`; or the name of
            an observation (`default`, `local`, `grid`).
        reward: Terms that the reward is made of, see `RewardTerm`.
        disturbances: Blocks that act on the world, see `Disturbance`; None: those of the scenario;
            (): none.
        mask_in_observation: With discrete actions (`waypoint`), an observation is a dictionary of
            `observation` and `action_mask`, and the infos have no mask. For libraries that do not
            read infos.
        images_apart: An observation with pictures (`grid`) is a dictionary of `observation` and a
            uint8 `Box` (channels, rows, columns; 255 for 1) for each of them; a picture alone is
            that `Box`.
        flat_infos: Infos have `reward_terms_home` and so on instead of sub-dictionaries. For
            libraries that make an array of every info (TorchRL).

    Raises:
        ValueError: A value is none of what is allowed; says what is.
    """

    action: str | ActionKind = "velocity"
    dynamics: Dynamics = "lpv"
    return_mode: bool = False
    safety_filter: bool = False
    reward_weights: Mapping[str, float] | None = None
    max_cycles: int | None = None
    observation: tuple[ObservationBlock, ...] = OBSERVATION
    reward: tuple[RewardTerm, ...] = REWARD
    disturbances: tuple[Feature, ...] | None = None
    mask_in_observation: bool = False
    images_apart: bool = False
    flat_infos: bool = False

    def __post_init__(self) -> None:
        kind_of(self.action)
        if self.dynamics not in get_args(Dynamics):
            allowed = ", ".join(get_args(Dynamics))
            raise ValueError(f"dynamics is {self.dynamics!r}; it is one of {allowed}")
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
        cycles = self.max_cycles
        whole = isinstance(cycles, int | np.integer) and not isinstance(cycles, bool)
        if cycles is not None and (not whole or not 1 <= cycles <= _LONGEST):
            raise ValueError(f"max_cycles is {cycles!r}; give a whole number from 1 to {_LONGEST}")
        object.__setattr__(
            self,
            "observation",
            checked_blocks("observation", "blocks", self.observation, ObservationBlock),
        )
        if self.images_apart and not any(block.shape for block in self.observation):
            raise ValueError(
                "images_apart is True, and no block of the observation is a picture; "
                'take observation="grid", or leave it out'
            )
        object.__setattr__(
            self, "reward", checked_blocks("reward", "terms", self.reward, RewardTerm)
        )
        weights_of(self.reward, self.reward_weights)
        if self.disturbances is not None:
            object.__setattr__(self, "disturbances", checked_features(self.disturbances))

    @classmethod
    def of(cls, given: Mapping[str, Any], beside: Sequence[str] = ()) -> "MissionSettings":
        """The settings of keyword arguments.

        Args:
            given: Name -> value.
            beside: Other keyword arguments of the function that takes them, for its error.

        Raises:
            ValueError: There is no such setting, or a value is none of what is allowed.
        """
        known = [field.name for field in fields(cls)]
        taken = ", ".join((*beside, *known))
        for name in given:
            if name not in known:
                raise UnknownArgumentError(
                    f"unexpected keyword argument {name!r}; there are {taken}"
                )
        named = given.get("observation")
        if isinstance(named, str):
            given = {**given, "observation": observation_named(named)}
        return cls(**given)

    @property
    def weights(self) -> NDArray[np.float64]:
        """(R,) the weights of the terms."""
        return weights_of(self.reward, self.reward_weights)

    @property
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
        return kind_of(self.action)

    @property
    def chooses(self) -> bool:
        """Whether the action is a choice."""
        return self.kind.choices > 0

    def features_in(self, scenario: Scenario) -> tuple[Feature, ...]:
        """What the missions of a scenario have of what few have."""
        return mission_features(scenario, self.disturbances)

    def limited(self, scenario: Scenario) -> Scenario:
        """The scenario with this time limit; return mode and the observed time know it."""
        if self.max_cycles is None:
            return scenario
        return scenario.model_copy(update={"max_steps": int(self.max_cycles)})
