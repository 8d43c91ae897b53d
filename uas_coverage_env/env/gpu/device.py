"""Arrays on a GPU: put there, and kept up to date where the host changes a few lanes of many."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numba import config, cuda
from numpy.typing import NDArray

from uas_coverage_env.compiled.memory import Memory, Pool

# the simulator's own arrays are strange to what is called by its kernels; it takes plain ones
_SIMULATED = config.ENABLE_CUDASIM  # pyrefly: ignore[missing-attribute]


def on_device(arrays: Any) -> Any:
    """The same named tuple, of arrays and named tuples, with its arrays on the device."""
    if isinstance(arrays, np.ndarray):
        return arrays.copy() if _SIMULATED else cuda.to_device(arrays)
    return arrays._make(map(on_device, arrays))


def lane_on_host(arrays: Any, lane: int) -> Any:
    """A copy of one lane of a named tuple of arrays and named tuples on the device."""
    if isinstance(arrays, tuple):
        return type(arrays)(*(lane_on_host(array, lane) for array in arrays))
    return on_host(arrays[lane]) if arrays.size else np.zeros(arrays.shape[1:], arrays.dtype)


def write_lane(arrays: Any, lane: int, values: Any) -> None:
    """Write what `lane_on_host` has returned."""
    if isinstance(arrays, tuple):
        for array, value in zip(arrays, values, strict=True):
            write_lane(array, lane, value)
    elif arrays.size:
        write(arrays[lane], values)


def on_host(array: Any) -> NDArray[Any]:
    """A copy of an array on the device."""
    return array.copy() if _SIMULATED else array.copy_to_host()


def with_missions(there: Pool, memory: Memory, here: Pool, missions: Sequence[int]) -> Pool:
    """A pool on the device, once a few missions of it have changed on the host.

    An array that has grown is copied as a whole, of others the missions concerned.

    Args:
        there: The pool on the device; written.
        memory: What it declares.
        here: The pool of `Slots` on the host as it is now.
        missions: Which have changed.
    """
    arrays = list(there.arrays)
    changed = [(here.first[s].tolist(), memory.mission(here, s)) for s in missions]
    for f, array in enumerate(here.arrays):
        if arrays[f].size != array.size:
            arrays[f] = on_device(array)
            continue
        # those that are equal lie in one place
        places = {firsts[f]: mission[f].reshape(-1) for firsts, mission in changed}
        for first, values in places.items():
            if values.size:
                write(arrays[f][first : first + values.size], values)
    return Pool(memory.declaration(*arrays), on_device(here.first), on_device(here.sizes))


def write(view: Any, values: NDArray[Any]) -> None:
    """Write a contiguous array on the device, or a view of one."""
    if _SIMULATED:
        view[...] = values
    else:
        view.copy_to_device(values)
