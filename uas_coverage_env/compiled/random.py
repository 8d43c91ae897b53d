"""Random numbers in kernels: SplitMix64 (Steele, Lea, Flood 2014), whose state is one number.

The state is an array of one element, so that it can be part of the arrays of a checkpoint, and the
numbers are the same wherever the mission is flown.
"""

import math

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.compiled.kernels import COMPILED, inlined_kernel, kernel

SEEDS = 2**64
"""Seeds are below."""

_GOLDEN = np.uint64(0x9E3779B97F4A7C15)
_PER_STEP = 2.0**-53


@kernel
def mixed(z):
    """The output function of SplitMix64: every bit depends on all bits of a uint64."""
    z = (z ^ (z >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    z = (z ^ (z >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return z ^ (z >> np.uint64(31))


@kernel
def counted(seed, number):
    """A number that depends on a seed and on a count from 0 on, and has no state, uint64."""
    return mixed(mixed(seed) + np.uint64(number + 1) * _GOLDEN)


@inlined_kernel
def bits(random: NDArray[np.uint64]) -> np.uint64:
    """64 random bits.

    Args:
        random: (1,) the state; written.
    """
    random[0] = random[0] + _GOLDEN
    return mixed(random[0])


@inlined_kernel
def uniform(random: NDArray[np.uint64]) -> float:
    """A number from 0 on and below 1, every multiple of 2⁻⁵³ equally likely.

    Args:
        random: (1,) the state; written.
    """
    return np.float64(bits(random) >> np.uint64(11)) * _PER_STEP


@inlined_kernel
def normal(random: NDArray[np.uint64]) -> float:
    """A number of the standard normal distribution, from two uniform ones (Box, Muller 1958).

    Args:
        random: (1,) the state; written.
    """
    # 1 - u is above 0: its logarithm is finite
    radius = math.sqrt(-2.0 * math.log(1.0 - uniform(random)))
    return radius * math.cos(2.0 * math.pi * uniform(random))


if not COMPILED:
    # that the numbers overflow is meant; NumPy warns of it
    mixed, counted, bits = (np.errstate(over="ignore")(each) for each in (mixed, counted, bits))
