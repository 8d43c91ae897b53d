"""The attention network in torch, as a policy of Stable-Baselines3 (`policy.attention`)."""

from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from stable_baselines3.common.policies import ActorCriticPolicy
from torch import nn

from uas_coverage_agents.policy.attention import Attention
from uas_coverage_agents.training.actor_critic import ActorCritic
from uas_coverage_env.env import observation_columns
from uas_coverage_env.env.observation.scales import HEIGHT_M

_FIRST = int(observation_columns("waypoints", "valid")[0, 0])
_NORTH, _EAST = (observation_columns("waypoints", "direction")[0] - _FIRST).tolist()
_CLOSENESS = int(observation_columns("waypoints", "closeness")[0, 0]) - _FIRST
_BELOW = int(observation_columns("waypoints", "below")[0, 0]) - _FIRST
_UP = int(observation_columns("own", "position")[0, 2])

_BENT_ON_THE_NEAREST = 40.0
"""At first, one that is nearer by a tenth of the closeness weighs e⁴ times as much."""

_FIRST_SPEED = 0.9
"""At first, as a share of the largest."""

_HALF_CEILING_M = 25.0
"""Half the height of generated towns: what a step of 1 in the altitude that is asked for is [m]."""

_CRITIC = 128
"""Width of the layers that estimate the value; they do not fly along."""


class AttentionActor(nn.Module):
    """The network that flies, weight for weight, but for its last layer."""

    def __init__(self, network: Attention) -> None:
        super().__init__()
        self._network = network
        seen = network.features + network.keys
        self.own = nn.Linear(network.own, network.hidden)
        self.key = nn.Linear(network.features, network.keys)
        self.query = nn.Linear(network.hidden, network.keys)
        self.bent = nn.Linear(network.features, 1, bias=False)
        self.hidden = nn.Linear(network.hidden + seen, network.hidden)
        for tensor in (self.query.weight, self.query.bias, self.bent.weight):
            nn.init.zeros_(tensor)
        with torch.no_grad():
            self.bent.weight[0, _CLOSENESS] = _BENT_ON_THE_NEAREST

    def forward(self, x: torch.Tensor) -> torch.Tensor:
        """(n, inputs) -> (n, numbers that the outputs are a linear function of)."""
        network = self._network
        end = network.before + network.candidates * network.features
        own = torch.cat([x[:, : network.before], x[:, end:]], 1)
        w = x[:, network.before : end].reshape(-1, network.candidates, network.features)
        c = torch.tanh(self.own(own))
        e = torch.tanh(self.key(w))
        score = (torch.matmul(e, self.query(c)[:, :, None]) + self.bent(w))[..., 0]
        there = w[..., 0] > 0.0
        share = torch.softmax(score.masked_fill(~there, -1e9), 1) * there
        a = torch.matmul(share[:, None], torch.cat([w, e], 2))[:, 0]
        h = torch.tanh(self.hidden(torch.cat([c, a], 1)))
        return torch.cat([h, a, own], 1)


class AttentionPolicy(ActorCriticPolicy):
    """Flies with an attention network; before training, straight to the nearest open waypoint.

    Args:
        args: As of the base.
        network: The network.
        kwargs: As of the base; `ortho_init` has to be off, it would scramble the first actions.
    """

    def __init__(self, *args: Any, network: Attention, **kwargs: Any) -> None:
        self.network = network
        options: dict[str, Any] = {"ortho_init": False, **kwargs}
        super().__init__(*args, **options)

    def _build_mlp_extractor(self) -> None:
        network = self.network
        # the actor first: the order in which weights are drawn is part of what a seed means
        actor = AttentionActor(network)
        critic = nn.Sequential(
            nn.Linear(network.inputs, _CRITIC), nn.Tanh(), nn.Linear(_CRITIC, _CRITIC), nn.Tanh()
        )
        both: Any = ActorCritic(actor, network.last, critic, _CRITIC)
        self.mlp_extractor = both

    def _build(self, lr_schedule: Any) -> None:
        super()._build(lr_schedule)
        target = self.network.hidden
        own = self.network.last - self.network.own
        out: Any = self.action_net
        with torch.no_grad():
            out.weight.zero_()
            out.bias.zero_()
            out.weight[0, target + _NORTH] = _FIRST_SPEED
            out.weight[1, target + _EAST] = _FIRST_SPEED
            out.weight[2, target + _BELOW] = -HEIGHT_M / _HALF_CEILING_M
            out.weight[2, own + _UP] = 1.0

    def tensors(self) -> dict[str, NDArray[np.float32]]:
        """The weights by the names of `Attention.shapes`."""
        extractor: Any = self.mlp_extractor
        parts = {
            **extractor.actor.state_dict(),
            **{f"out.{name}": tensor for name, tensor in self.action_net.state_dict().items()},
        }
        return {k: v.detach().cpu().numpy().astype(np.float32) for k, v in parts.items()}
