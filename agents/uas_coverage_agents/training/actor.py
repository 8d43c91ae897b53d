"""The network `policy.actor.Actor` in torch, to be learned; values have layers of their own."""

from itertools import pairwise
from typing import Any

import torch
from torch import Tensor, nn

from uas_coverage_agents.policy.actor import Actor
from uas_coverage_agents.training.learner import Arrays

_LEAST_SPREAD = 0.05
"""What varies less in the first rows is scaled as if it varied so much."""

_AT_FIRST = 0.1
"""The last layers begin with weights of this share: all choices are much alike."""

_SPEEDS = (0.8, 0.5)
"""Velocities begin with these, within each of `REACHES_M`: some 5 m/s, less from 10 m on."""

_LOW = -1.5
"""Home begins with this height near its end: so low that noise does not keep a UAS from landing."""

_SELDOM = -2.0
"""Scores of home, and of velocities to no place, begin with this; those of candidates with 0."""


class ActorCritic(nn.Module):
    """What is learned.

    Args:
        network: What it is in NumPy.
    """

    offset: Tensor
    scale: Tensor
    each_offset: Tensor
    each_scale: Tensor

    def __init__(self, network: Actor) -> None:
        super().__init__()
        self.network, last = network, network.hidden[-1]
        self._indices: dict[Any, Tensor] = {}
        self.layers, self.judge = (_layers(network.features, network.hidden) for _ in range(2))
        self.others = nn.Linear(last + network.features, network.others)
        self.value = nn.Linear(last, 1)
        small: list[nn.Linear] = [self.others, self.value]
        self.register_buffer("offset", torch.zeros(network.features))
        self.register_buffer("scale", torch.ones(network.features))
        if each := network.candidates:
            self.one = nn.Linear(each.inputs, each.width)
            self.all = nn.Linear(last, each.width, bias=False)
            pointing = network.pointing is not None
            self.score = nn.Linear(each.width, network.per_candidate, bias=pointing)
            small.append(self.score)
            self.register_buffer("each_offset", torch.zeros(each.inputs))
            self.register_buffer("each_scale", torch.ones(each.inputs))
        with torch.no_grad():
            for layer in small:
                layer.weight.mul_(_AT_FIRST)
                if layer.bias is not None:
                    layer.bias.zero_()
            if network.pointing:
                self._point_at_first()

    def _point_at_first(self) -> None:
        """Fly there at some speed; seldom home, and low when near; no other numbers are given."""
        (first, near), end = self.network.heights_at, self.network.per_candidate
        speeds = torch.tensor(_SPEEDS)
        self.score.bias[1:first] = speeds
        self.others.bias[1:first] = speeds
        self.others.bias[0] = self.others.bias[end] = _SELDOM
        self.others.bias[near:end] = _LOW

    def read(self, observed: Tensor) -> tuple[Tensor, Tensor | None]:
        """What a forward pass reads of the observations of some rows, where they lie."""
        read, each = self.network.read(observed, torch, self._at), None
        if self.network.candidates is not None:
            each = self.network.read_of_each(observed, torch, self._at)
        return read, each

    def _at(self, columns: Any) -> Tensor:
        """An index of columns, which is made once and lies where the weights do."""
        if columns not in self._indices:
            self._indices[columns] = torch.tensor(columns, dtype=torch.int64).to(self.offset.device)
        return self._indices[columns]

    def standardise(self, read: Tensor, each: Tensor | None, exists: Tensor | None) -> None:
        """Take the means and spreads of some rows as the ones to expect.

        Args:
            read: (N, features).
            each: (N, candidates, their inputs); None: there are none.
            exists: (N, candidates) which of them are there; None: those of which any is not 0.
        """
        _standardise(read, self.offset, self.scale)
        if each is not None:
            exists = each[:, :, :-2].any(2) if exists is None else exists
            _standardise(each[exists], self.each_offset, self.each_scale)

    def outputs(self, read: Tensor, each: Tensor | None) -> Tensor:
        """(N, outputs), as `Actor.forward`."""
        seen = (read - self.offset) * self.scale
        x = self.layers(seen)
        others = self.others(torch.cat([x, seen], 1))
        if each is None:
            return others
        one = self.one((each - self.each_offset) * self.each_scale)
        scored = self.score(torch.tanh(one + self.all(x)[:, None]))
        if self.network.pointing:
            return self.network.pointed(torch, scored, others, read, each)
        return torch.cat([scored[:, :, 0], others], 1)

    def values(self, read: Tensor) -> Tensor:
        """(N,) what the critic expects."""
        return self.value(self.judge((read - self.offset) * self.scale))[:, 0]

    def tensors(self) -> Arrays:
        """Those of `Actor.shapes`."""
        own = {name: tensor.detach().cpu().numpy() for name, tensor in self.state_dict().items()}
        names = {"offset": "offset", "scale": "scale"}
        names |= {f"others.{part}": f"others.{part}" for part in ("weight", "bias")}
        for k in range(len(self.network.hidden)):
            names |= {f"layers.{k}.{p}": f"layers.{2 * k}.{p}" for p in ("weight", "bias")}
        if self.network.candidates is not None:
            parts = "one.weight", "one.bias", "all.weight", "score.weight"
            names |= {f"candidates.{part}": part for part in parts}
            names |= {f"candidates.{part}": f"each_{part}" for part in ("offset", "scale")}
        if self.network.pointing is not None:
            names["candidates.score.bias"] = "score.bias"
        return {name: own[found] for name, found in names.items()}


def _layers(inputs: int, hidden: tuple[int, ...]) -> nn.Sequential:
    layers: list[nn.Module] = []
    for below, above in pairwise((inputs, *hidden)):
        layers += [nn.Linear(below, above), nn.Tanh()]
    return nn.Sequential(*layers)


def _standardise(rows: Tensor, offset: Tensor, scale: Tensor) -> None:
    offset.copy_(rows.mean(0))
    scale.copy_(1.0 / rows.std(0).clamp(min=_LEAST_SPREAD))
