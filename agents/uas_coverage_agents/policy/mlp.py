"""Layers one after the other: the plainest network."""

from itertools import pairwise
from typing import Annotated, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from uas_coverage_agents.policy.tensors import Tensors, Width
from uas_coverage_env.files.strict_toml import StrictModel

_ACTIVATIONS = {"tanh": np.tanh, "relu": lambda x: np.maximum(x, 0.0)}


class Mlp(StrictModel):
    """Layers one after the other: x → W x + b, an activation after all but the last.

    Attributes:
        kind: "mlp".
        inputs: Numbers that it reads.
        hidden: Widths of the layers between.
        outputs: Numbers that it gives.
        activation: Of the layers between.
        squash: Whether tanh keeps the outputs between -1 and 1.
    """

    kind: Literal["mlp"] = "mlp"
    inputs: Width
    hidden: Annotated[tuple[Width, ...], Field(max_length=8)]
    outputs: Width
    activation: Literal["tanh", "relu"]
    squash: bool = False

    def shapes(self) -> dict[str, tuple[int, ...]]:
        """Name -> shape of every tensor: `layers.0.weight`, `layers.0.bias`, ..."""
        shapes: dict[str, tuple[int, ...]] = {}
        for k, (below, above) in enumerate(pairwise((self.inputs, *self.hidden, self.outputs))):
            shapes[f"layers.{k}.weight"] = (above, below)
            shapes[f"layers.{k}.bias"] = (above,)
        return shapes

    def forward(self, tensors: Tensors, inputs: NDArray[np.floating]) -> NDArray[np.float64]:
        """Run it.

        Args:
            tensors: Those of `shapes`.
            inputs: (..., inputs).

        Returns:
            (..., outputs).
        """
        activation = _ACTIVATIONS[self.activation]
        x = np.asarray(inputs, dtype=np.float64)
        for k in range(len(self.hidden) + 1):
            if k > 0:
                x = activation(x)
            x = x @ tensors[f"layers.{k}.weight"].T + tensors[f"layers.{k}.bias"]
        return np.tanh(x) if self.squash else x
