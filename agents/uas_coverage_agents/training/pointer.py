"""The pointer network in torch, as a policy of sb3-contrib; see `policy.pointer.Pointer`."""

from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from sb3_contrib.common.maskable.policies import MaskableActorCriticPolicy
from torch import nn

from uas_coverage_agents.policy.pointer import HOME_AT_FIRST, Pointer
from uas_coverage_agents.training.actor_critic import ActorCritic
from uas_coverage_agents.waypoint.layout import TEAM

_ROLLOUT = [
    n for n, f in enumerate(TEAM.features) if f.name in ("total", "longest", "left", "blocked")
]
"""Columns that tell, linearly, most of what a mission will still cost."""


class SetPooling(nn.Module):
    """Candidates and team in; what each candidate, and what all together are like, out."""

    def __init__(self, pointer: Pointer) -> None:
        super().__init__()
        self._team = pointer.team
        self._shape = (pointer.candidates, pointer.features)
        self.candidate = nn.ModuleList(
            [nn.Linear(pointer.features, pointer.hidden), nn.Linear(pointer.hidden, pointer.hidden)]
        )
        self.team = nn.Linear(pointer.team + pointer.hidden, pointer.hidden)

    def forward(self, x: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor, torch.Tensor]:
        """(..., inputs) -> candidates (..., K, features), e (..., K, hidden), t (..., hidden)."""
        team = x[:, : self._team]
        candidates = x[:, self._team :].reshape(-1, *self._shape)
        there = candidates[..., :1]
        e = candidates
        for layer in self.candidate:
            e = torch.relu(layer(e))
        e = e * there
        mean = e.sum(1) / there.sum(1).clamp(min=1.0)
        return candidates, e, torch.relu(self.team(torch.cat([team, mean], 1)))


class PointerActor(nn.Module):
    """The network that flies, weight for weight."""

    def __init__(self, pointer: Pointer) -> None:
        super().__init__()
        h = pointer.hidden
        self._way = pointer.way
        self._prior = pointer.prior
        self.pool = SetPooling(pointer)
        self.score_candidate = nn.Linear(h, h, bias=False)
        self.score_team = nn.Linear(h, h)
        self.score_out = nn.Linear(h, 1, bias=False)
        self.home_0 = nn.Linear(h, h)
        self.home_1 = nn.Linear(h, 1)
        # at first the nearest candidate wins
        nn.init.zeros_(self.score_out.weight)
        nn.init.zeros_(self.home_1.weight)
        nn.init.constant_(self.home_1.bias, HOME_AT_FIRST)

    def forward(self, x: torch.Tensor) -> torch.Tensor:
        """(..., inputs) -> (..., K+1) scores."""
        candidates, e, t = self.pool(x)
        hidden = torch.relu(self.score_candidate(e) + self.score_team(t)[:, None])
        way = candidates[..., self._way]
        scores = self.score_out(hidden).squeeze(-1) - self._prior * (way - way[:, :1])
        return torch.cat([scores, self.home_1(torch.relu(self.home_0(t)))], 1)


class Critic(nn.Module):
    """What is behind the estimate of the value; it does not fly along."""

    def __init__(self, pointer: Pointer) -> None:
        super().__init__()
        self.pool = SetPooling(pointer)
        self.out = nn.Linear(pointer.hidden, pointer.hidden)

    def forward(self, x: torch.Tensor) -> torch.Tensor:
        """(..., inputs) -> (..., hidden + columns of the greedy rollout)."""
        _, _, t = self.pool(x)
        return torch.cat([torch.relu(self.out(t)), x[:, _ROLLOUT]], 1)


class PointerPolicy(MaskableActorCriticPolicy):
    """Chooses by the scores of a pointer network.

    Args:
        args: As of the base.
        pointer: The network.
        kwargs: As of the base; `ortho_init` has to be off, it would scramble the first scores.
    """

    def __init__(self, *args: Any, pointer: Pointer, **kwargs: Any) -> None:
        self.pointer = pointer
        options: dict[str, Any] = {"ortho_init": False, **kwargs}
        super().__init__(*args, **options)

    def _build_mlp_extractor(self) -> None:
        pointer = self.pointer
        critic_width = pointer.hidden + len(_ROLLOUT)
        both: Any = ActorCritic(
            PointerActor(pointer), pointer.outputs, Critic(pointer), critic_width
        )
        self.mlp_extractor = both

    def _build(self, lr_schedule: Any) -> None:
        super()._build(lr_schedule)
        self.action_net = nn.Identity()
        nn.init.zeros_(self.value_net.weight)
        # the base class made it for the layer that was replaced
        options: dict[str, Any] = {"lr": lr_schedule(1.0), **self.optimizer_kwargs}
        self.optimizer = self.optimizer_class(self.parameters(), **options)

    def tensors(self) -> dict[str, NDArray[np.float32]]:
        """The weights of the actor by the names of `Pointer.shapes`."""
        names = {
            "pool.candidate.": "candidate.",
            "pool.team.": "team.",
            "score_candidate.": "score.candidate.",
            "score_team.": "score.team.",
            "score_out.": "score.out.",
            "home_0.": "home.0.",
            "home_1.": "home.1.",
        }
        tensors = {}
        extractor: Any = self.mlp_extractor
        for name, tensor in extractor.actor.state_dict().items():
            for ours, theirs in names.items():
                if name.startswith(ours):
                    name = theirs + name.removeprefix(ours)
                    break
            tensors[name] = tensor.detach().cpu().numpy().astype(np.float32)
        return tensors
