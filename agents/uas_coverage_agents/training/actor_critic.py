"""Actor and critic with nothing in common, in the place where Stable-Baselines3 has its layers."""

import torch
from torch import nn


class ActorCritic(nn.Module):
    """What SB3 calls an mlp_extractor.

    Args:
        actor: (n, inputs) -> (n, actor_width), what the action is a linear function of.
        actor_width: Its outputs.
        critic: (n, inputs) -> (n, critic_width), what the value is a linear function of.
        critic_width: Its outputs.
    """

    def __init__(
        self, actor: nn.Module, actor_width: int, critic: nn.Module, critic_width: int
    ) -> None:
        super().__init__()
        self.actor = actor
        self.critic = critic
        self.latent_dim_pi = actor_width
        self.latent_dim_vf = critic_width

    def forward(self, x: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
        """Both."""
        return self.actor(x), self.critic(x)

    def forward_actor(self, x: torch.Tensor) -> torch.Tensor:
        """What the action is a linear function of."""
        return self.actor(x)

    def forward_critic(self, x: torch.Tensor) -> torch.Tensor:
        """What the value is a linear function of."""
        return self.critic(x)
