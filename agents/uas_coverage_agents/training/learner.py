"""What the training loop trains: anything that learns in rounds and can be put aside between them.

A class that learns (`LearnerSettings.algorithm`) is one of two kinds.

- *With the interface of Stable-Baselines3*, as all classes of that library and of sb3-contrib have:
  made as `Class(policy, env, seed=, device=, **learning)`, it has `learn(total_timesteps,
  reset_num_timesteps=False)`, `predict(observation, state=, episode_start=, deterministic=)` and
  `num_timesteps`. What it needs, its `predict` says: one with `action_masks` is shown the masks of
  choices, and what it gives as state it is given back in the next step. What it has learned are its
  `get_parameters()` and its replay buffer; a class that is no `BaseAlgorithm` has `state_dict()`
  and `load_state_dict(state)` instead, of arrays.
- *A `Learner` of its own*, which is made with the whole settings and finds its own missions.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from uas_coverage_agents.policy import Policy, PolicyDescription
from uas_coverage_agents.policy.description import (
    Interface,
    Observation,
    ScenarioFamily,
    Training,
)
from uas_coverage_agents.policy.networks import Network
from uas_coverage_env.plugins.installed import version_of

_PACKAGES = ("uas-coverage-env", "numpy", "torch", "stable-baselines3", "sb3-contrib")

Arrays = dict[str, NDArray[Any]]


SEEDS_APART = 1000
"""The seed of a round is this times the seed of the training, and the number of the round."""


@dataclass(frozen=True)
class Learned:
    """What flies.

    Attributes:
        interface: What the outputs of the network mean.
        network: What computes them.
        observation: What it reads.
        tensors: Its weights.
    """

    interface: Interface
    network: Network
    observation: Observation
    tensors: Mapping[str, NDArray[Any]]

    def policy(self, scenarios: ScenarioFamily, training: Training) -> Policy:
        """The same as it will be read from its file; float64 holds float32 exactly."""
        description = PolicyDescription(
            interface=self.interface,
            network=self.network,
            observation=self.observation,
            scenarios=scenarios,
            training=training,
            versions={name: version_of(name) or "not installed" for name in _PACKAGES},
        )
        kept = {name: np.asarray(array, np.float32) for name, array in self.tensors.items()}
        return Policy(description, {name: each.astype(np.float64) for name, each in kept.items()})


@dataclass
class Told:
    """What a learner tells of a round.

    Attributes:
        rows: Steps so far, and numbers by name.
    """

    rows: list[tuple[int, dict[str, float]]] = field(default_factory=list)

    def add(self, steps: int, **numbers: float) -> None:
        """Tell some numbers."""
        self.rows.append((steps, {k: float(v) for k, v in numbers.items() if np.isfinite(v)}))


class Learner(Protocol):
    """Made as `Class(settings, missions, seed)`; each round has a fresh one and a seed of its own.

    What decides how the training goes on is in `state_dict`: a round is a function of the settings,
    its seed and the state before, so that it can be done again, or on another machine.
    """

    @property
    def steps(self) -> int:
        """Flown steps learned from so far: decisions of a UAS, or of the swarm as one agent."""
        ...

    def learn(self, number: int, told: Told) -> None:
        """Do a round, from 0 on."""
        ...

    def state_dict(self) -> Arrays:
        """What is known between two rounds; plain arrays."""
        ...

    def load_state_dict(self, state: Mapping[str, NDArray[Any]]) -> None:
        """Know it again.

        Raises:
            InputError: It is that of another learner.
        """
        ...

    def learned(self) -> Learned:
        """What would fly now."""
        ...
