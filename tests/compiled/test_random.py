"""Random numbers in kernels: the published generator, the same compiled and in plain Python."""

import os
import subprocess
import sys

import numpy as np
import pytest

from uas_coverage_env.compiled.kernels import kernel
from uas_coverage_env.compiled.random import bits, counted, normal, uniform

DRAW = """
import numpy as np
from uas_coverage_env.compiled.random import counted, normal, uniform
random = np.array([counted(np.uint64(7), 3)])
print([float(uniform(random) if k % 2 else normal(random)) for k in range(8)])
"""


@kernel
def _fill(random, uniforms, normals, whole):
    for k in range(uniforms.shape[0]):
        uniforms[k] = uniform(random)
        normals[k] = normal(random)
        whole[k] = bits(random)


def drawn(n, start=1):
    random = np.array([start], dtype=np.uint64)
    numbers = np.zeros(n), np.zeros(n), np.zeros(n, np.uint64)
    _fill(random, *numbers)
    return numbers


def test_the_bits_are_those_of_splitmix64():
    """Written out in whole numbers of any size, as in the paper."""
    state, mask = 1234567, 2**64 - 1
    random = np.array([state], dtype=np.uint64)
    whole = np.zeros(1, np.uint64)
    for _ in range(50):
        state = (state + 0x9E3779B97F4A7C15) & mask
        z = ((state ^ (state >> 30)) * 0xBF58476D1CE4E5B9) & mask
        z = ((z ^ (z >> 27)) * 0x94D049BB133111EB) & mask
        _next_bits(random, whole)
        assert int(whole[0]) == z ^ (z >> 31)
        assert int(random[0]) == state


@kernel
def _next_bits(random, whole):
    whole[0] = bits(random)


def test_the_numbers_have_the_distributions_that_they_are_named_after():
    uniforms, normals, _ = drawn(40_000)
    assert uniforms.min() >= 0.0
    assert uniforms.max() < 1.0
    counts = np.histogram(uniforms, bins=20, range=(0.0, 1.0))[0]
    assert ((counts - 2000) ** 2 / 2000).sum() < 50.0
    assert normals.mean() == pytest.approx(0.0, abs=0.03)
    assert normals.std() == pytest.approx(1.0, rel=0.02)
    assert (normals**4).mean() == pytest.approx(3.0, rel=0.08)
    assert (np.abs(normals) < 1.96).mean() == pytest.approx(0.95, abs=0.005)
    assert abs(np.corrcoef(normals[1:], normals[:-1])[0, 1]) < 0.02


def test_seeds_and_numbers_of_missions_begin_far_apart():
    starts = {int(counted(np.uint64(s), m)) for s in range(100) for m in range(100)}
    assert len(starts) == 10_000


def test_plain_python_draws_what_compiled_code_draws():
    shown = [
        subprocess.run(
            [sys.executable, "-W", "error", "-c", DRAW],
            env={**os.environ, "NUMBA_DISABLE_JIT": off},
            capture_output=True,
            text=True,
            check=True,
        ).stdout
        for off in ("1", "0")
    ]
    assert shown[0] == shown[1]
