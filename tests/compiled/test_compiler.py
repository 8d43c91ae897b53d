"""A kernel is compiled for Python, and as a part of the kernels that call it."""

import gc
import pickle

import numpy as np
import pytest
from numba import njit, prange

from uas_coverage_env.compiled.kernels import allocating_kernel, inlined_kernel, kernel


@kernel
def square(x):
    return x * x


@inlined_kernel
def norm(values):
    total = 0.0
    for k in range(values.shape[0]):
        total += square(values[k])
    return total


@kernel
def distance(a, b, room):
    for k in range(room.shape[0]):
        room[k] = a[k] - b[k]
    return norm(room)


@kernel
def factorial(n):
    if n < 2:
        return 1
    return n * factorial(n - 1)


@kernel
def twice_factorial(n):
    return 2 * factorial(n)


@kernel
def refused(x):
    if x < 0.0:
        raise ValueError("below zero")
    return x


@kernel
def refused_below(x):
    return refused(x - 1.0)


@allocating_kernel(parallel=True)
def squares(values):
    out = np.empty_like(values)
    for k in prange(values.shape[0]):
        out[k] = square(values[k])
    return out


@allocating_kernel
def sum_of_squares(values):
    return squares(values).sum()


def test_what_only_kernels_call_is_not_made_callable():
    @kernel
    def inner(x):
        return x + 1.0

    @kernel
    def outer(x):
        return inner(x)

    assert outer(1.0) == 2.0
    assert outer.for_python.signatures
    assert not inner.for_python.signatures
    assert inner.signatures or outer.for_python.stats.cache_hits


def test_a_kernel_is_called_by_kernels_and_by_python():
    assert norm(np.arange(3.0)) == 5.0
    assert distance(np.arange(3.0), np.zeros(3), np.zeros(3)) == 5.0
    assert norm(np.arange(4.0)) == 14.0


def test_a_function_of_numbas_own_calls_kernels():
    @njit
    def outside(x):
        return square(x) + 1.0

    assert outside(3.0) == 10.0


def test_a_kernel_that_calls_itself_is_compiled():
    assert twice_factorial(5) == 240
    assert factorial(4) == 24


def test_an_error_in_a_part_reaches_python():
    assert refused_below(2.0) == 1.0
    with pytest.raises(ValueError, match="below zero"):
        refused_below(0.5)


def test_threads_call_parts():
    assert squares(np.arange(4.0)).tolist() == [0.0, 1.0, 4.0, 9.0]
    assert sum_of_squares(np.arange(4.0)) == 14.0


def test_a_kernel_handed_to_another_process_is_a_kernel():
    assert pickle.loads(pickle.dumps(square))(3.0) == 9.0


@pytest.mark.parametrize("collecting", [True, False])
def test_compilation_leaves_the_garbage_collector_as_it_was(collecting):
    @kernel
    def cube(x):
        return x * square(x)

    before = gc.isenabled()
    try:
        (gc.enable if collecting else gc.disable)()
        assert cube(2.0) == 8.0
        assert gc.isenabled() == collecting
    finally:
        (gc.enable if before else gc.disable)()


def test_bad_arguments_are_refused_in_the_part_that_they_reach():
    with pytest.raises(Exception, match="square"):
        norm(np.array(["text"]))
