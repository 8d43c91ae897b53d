"""A policy of Stable-Baselines3 whose critic sees more than its actor: MAPPO's central critic.

The last numbers of an observation are the whole mission (`full_state`); only the critic reads them.
"""

from typing import Any

import torch
from gymnasium import spaces
from stable_baselines3.common.policies import ActorCriticPolicy
from stable_baselines3.common.torch_layers import BaseFeaturesExtractor


class OwnNumbers(BaseFeaturesExtractor):
    """What an actor sees of an observation: zero in place of the rest.

    Args:
        observation_space: Of the observation.
        size: How many numbers the actor sees, from the first on.
    """

    def __init__(self, observation_space: spaces.Box, size: int) -> None:
        super().__init__(observation_space, observation_space.shape[0])
        self._size = size

    def forward(self, observations: torch.Tensor) -> torch.Tensor:
        """The first numbers, as many in all as there were."""
        own = torch.zeros_like(observations)
        own[:, : self._size] = observations[:, : self._size]
        return own


class CentralCriticPolicy(ActorCriticPolicy):
    """`MlpPolicy` with a central critic.

    Args:
        *args: Of `ActorCriticPolicy`.
        actor_size: How many numbers the actor sees, from the first on; the critic sees all.
        **kwargs: Of `ActorCriticPolicy`.
    """

    def __init__(self, *args: Any, actor_size: int, **kwargs: Any) -> None:
        self._actor_size = actor_size
        options: dict[str, Any] = {**kwargs, "share_features_extractor": False}
        super().__init__(*args, **options)

    def _build_mlp_extractor(self) -> None:
        space = self.observation_space
        assert isinstance(space, spaces.Box)
        self.pi_features_extractor = OwnNumbers(space, self._actor_size)
        super()._build_mlp_extractor()
