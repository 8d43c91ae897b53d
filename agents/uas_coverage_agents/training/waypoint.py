"""Learning to choose waypoints: one network for every UAS, by PPO with masked choices."""

from typing import cast

import numpy as np
from numpy.typing import NDArray
from sb3_contrib import MaskablePPO
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.vec_env import VecEnv

from uas_coverage_agents.policy.description import Observation
from uas_coverage_agents.policy.networks import Network
from uas_coverage_agents.training.config import PpoSettings, TrainingConfig
from uas_coverage_agents.training.moving_obstacles import some_with_moving_obstacles
from uas_coverage_agents.training.pointer import PointerPolicy
from uas_coverage_agents.training.scenarios import training_scenarios
from uas_coverage_agents.training.waypoint_env import WaypointVecEnv
from uas_coverage_agents.waypoint.policy_runner import network, observation
from uas_coverage_agents.waypoint.settings import WaypointSettings


class WaypointLearner:
    """See `Learner`."""

    def lanes(self, config: TrainingConfig, seed: int) -> VecEnv:
        """Teams on the scenarios of the configuration, some of them with moving obstacles."""
        settings = _settings(config)
        scenarios = some_with_moving_obstacles(
            training_scenarios(config.scenarios, seed), settings.moving_share, seed
        )
        return WaypointVecEnv(scenarios, settings, config.num_envs, seed)

    def model(self, config: TrainingConfig, lanes: VecEnv, seed: int) -> BaseAlgorithm:
        """A model that takes the nearest waypoint at first."""
        settings, learning = _settings(config), cast(PpoSettings, config.learning)
        return MaskablePPO(
            PointerPolicy,
            lanes,
            **learning.keywords,
            policy_kwargs={"pointer": network(settings.hidden, settings.prior)},
            device="cpu",
            seed=seed,
        )

    def export(self, model: BaseAlgorithm) -> tuple[Network, dict[str, NDArray[np.float32]]]:
        """The pointer network and its weights."""
        policy = cast(PointerPolicy, model.policy)
        return policy.pointer, policy.tensors()

    def observation(self, config: TrainingConfig) -> Observation:
        """What that network reads."""
        return observation()


def _settings(config: TrainingConfig) -> WaypointSettings:
    return cast(WaypointSettings, config.policy)
