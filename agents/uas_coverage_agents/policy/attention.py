"""Attention over the waypoints that are seen: what the weighted one is like decides."""

from typing import Literal, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import field_validator, model_validator

from uas_coverage_agents.policy.tensors import Tensors, Width
from uas_coverage_env.files.strict_toml import StrictModel

_NOT_THERE = -1e9
"""Score of a candidate that is not there; its weight is zero in any case."""


class Attention(StrictModel):
    """Attention over candidates, whatever their number and order.

    What is known beside the candidates becomes c = tanh(W₁ own + b₁), a candidate w becomes the
    key e = tanh(W₂ w + b₂). It is weighed by the softmax of (W₃ c + b₃) · e + w₄ · w over the
    candidates that are there; a is the weighted mean of [w, e], zero without candidates.
    h = tanh(W₅ [c, a] + b₅), and the outputs are W₆ [h, a, own] + b₆.

    Attributes:
        kind: "attention"; older files say "gaze".
        inputs: `before` numbers, `features` of each of the `candidates`, and some more numbers.
        outputs: How many.
        before: Numbers before the candidates.
        candidates: How many there are at most.
        features: Numbers about a candidate; the first is 1, or 0 where there is none.
        keys: Width of a key.
        hidden: Width of c and h.
    """

    kind: Literal["attention", "gaze"] = "attention"
    inputs: Width
    outputs: Width
    before: Width
    candidates: Width
    features: Width
    keys: Width
    hidden: Width

    @field_validator("kind")
    @classmethod
    def _present_name(cls, kind: str) -> str:
        return "attention"

    @model_validator(mode="after")
    def _sizes_fit(self) -> Self:
        if self.inputs < self.before + self.candidates * self.features:
            raise ValueError(
                f"inputs is {self.inputs}, but before + candidates * features is "
                f"{self.before + self.candidates * self.features}; that is no less"
            )
        return self

    @property
    def own(self) -> int:
        """Numbers beside the candidates."""
        return self.inputs - self.candidates * self.features

    @property
    def last(self) -> int:
        """Numbers that the outputs are a linear function of: h, a and own."""
        return self.hidden + self.features + self.keys + self.own

    def shapes(self) -> dict[str, tuple[int, ...]]:
        """Name -> shape of every tensor."""
        seen = self.features + self.keys
        return {
            "own.weight": (self.hidden, self.own),
            "own.bias": (self.hidden,),
            "key.weight": (self.keys, self.features),
            "key.bias": (self.keys,),
            "query.weight": (self.keys, self.hidden),
            "query.bias": (self.keys,),
            "bent.weight": (1, self.features),
            "hidden.weight": (self.hidden, self.hidden + seen),
            "hidden.bias": (self.hidden,),
            "out.weight": (self.outputs, self.last),
            "out.bias": (self.outputs,),
        }

    def forward(self, tensors: Tensors, inputs: NDArray[np.floating]) -> NDArray[np.float64]:
        """Run it.

        Args:
            tensors: Those of `shapes`.
            inputs: (..., inputs).

        Returns:
            (..., outputs).
        """

        def layer(name: str, value: NDArray[np.float64]) -> NDArray[np.float64]:
            return value @ tensors[f"{name}.weight"].T + tensors[f"{name}.bias"]

        x = np.asarray(inputs, dtype=np.float64)
        end = self.before + self.candidates * self.features
        own = np.concatenate([x[..., : self.before], x[..., end:]], axis=-1)
        w = x[..., self.before : end].reshape(*x.shape[:-1], self.candidates, self.features)
        c = np.tanh(layer("own", own))
        e = np.tanh(layer("key", w))
        score = (e @ layer("query", c)[..., None] + w @ tensors["bent.weight"].T)[..., 0]
        there = w[..., 0] > 0.0
        # the largest is taken off, so that no power overflows
        score = np.where(there, score, _NOT_THERE)
        power = np.exp(score - score.max(axis=-1, keepdims=True)) * there
        share = power / np.maximum(power.sum(axis=-1, keepdims=True), 1.0)
        a = (share[..., None] * np.concatenate([w, e], axis=-1)).sum(axis=-2)
        h = np.tanh(layer("hidden", np.concatenate([c, a], axis=-1)))
        return layer("out", np.concatenate([h, a, own], axis=-1))
