"""Small networks, compiled: numbers in, one number out."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from uas_coverage_agents.policy.networks import Mlp
from uas_coverage_agents.policy.tensors import Tensors
from uas_coverage_env.compiled.kernels import allocating_kernel


class Layers(NamedTuple):
    """Two hidden layers with relu and one output; inputs along the first axis."""

    weight_0: NDArray[np.float64]
    bias_0: NDArray[np.float64]
    weight_1: NDArray[np.float64]
    bias_1: NDArray[np.float64]
    weight_2: NDArray[np.float64]
    bias_2: NDArray[np.float64]


def layers_of(network: Mlp, tensors: Tensors, name: str) -> Layers:
    """The tensors of a part of a policy, in the order in which they are used."""
    arrays = [np.array(tensors[name + part].T, np.float64, order="C") for part in network.shapes()]
    layers = Layers(*arrays)
    return layers._replace(weight_2=layers.weight_2[:, 0].copy())


@allocating_kernel
def value_of(layers, x):
    """The output for one row of inputs."""
    first = layers.bias_0.copy()
    for a in range(x.shape[0]):
        if x[a] != 0.0:
            first += x[a] * layers.weight_0[a]
    second = layers.bias_1.copy()
    for a in range(first.shape[0]):
        if first[a] > 0.0:
            second += first[a] * layers.weight_1[a]
    out = layers.bias_2[0]
    for a in range(second.shape[0]):
        if second[a] > 0.0:
            out += second[a] * layers.weight_2[a]
    return out
