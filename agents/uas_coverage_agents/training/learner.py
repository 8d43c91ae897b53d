"""What a learner is to the training loop; there is one per interface of a policy."""

from typing import Protocol

import numpy as np
from numpy.typing import NDArray
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.vec_env import VecEnv

from uas_coverage_agents.policy.description import Observation
from uas_coverage_agents.policy.networks import Network
from uas_coverage_agents.training.config import TrainingConfig


class StatefulVecEnv(Protocol):
    """A `VecEnv` that is checkpointed and restored, bit for bit."""

    def state_dict(self) -> dict[str, NDArray[np.generic]]:
        """Everything that changes, as plain arrays by name."""
        ...

    def load_state_dict(self, state: dict[str, NDArray[np.generic]]) -> None:
        """Go on from there; the lanes were made from the same configuration and seed."""
        ...


class Learner(Protocol):
    """How policies of one interface are trained."""

    def lanes(self, config: TrainingConfig, seed: int) -> VecEnv:
        """The environment to learn in, seeded; it is a `StatefulVecEnv` too."""
        ...

    def model(self, config: TrainingConfig, lanes: VecEnv, seed: int) -> BaseAlgorithm:
        """The untrained model, on the processor; the loop sets the learning rate."""
        ...

    def export(self, model: BaseAlgorithm) -> tuple[Network, dict[str, NDArray[np.float32]]]:
        """The network that flies, and its weights."""
        ...

    def observation(self, config: TrainingConfig) -> Observation:
        """What that network reads."""
        ...
