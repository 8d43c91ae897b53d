"""Arrays on a GPU: put there, and kept up to date where the host changes a few lanes of many."""

from collections.abc import Sequence
from importlib.util import find_spec
from typing import Any

import numpy as np
from numba import config, cuda
from numpy.typing import NDArray

from uas_coverage_env.compiled.memory import Memory, Pool

# the simulator's own arrays are strange to what is called by its kernels; it takes plain ones
_SIMULATED = config.ENABLE_CUDASIM  # pyrefly: ignore[missing-attribute]


def check_gpu() -> None:
    """Say what is missing where missions cannot fly on a GPU.

    Raises:
        ImportError: numba-cuda is not installed.
        RuntimeError: There is no GPU.
    """
    if _SIMULATED:
        return
    if find_spec("numba_cuda") is None:
        raise ImportError(
            'device="cuda" needs numba-cuda: pip install "uas-coverage-env[gpu]" (or take "cpu")'
        )
    if not cuda.is_available():
        raise RuntimeError(
            'device="cuda" needs an NVIDIA GPU, and CUDA finds none (nvidia-smi shows those that '
            'there are, with their driver): install the driver, or take device="cpu"'
        )


def is_simulated() -> bool:
    """Whether numba's simulator is taken for a GPU."""
    return _SIMULATED


def on_device(arrays: Any) -> Any:
    """The same named tuple, of arrays and named tuples, with its arrays on the device."""
    if isinstance(arrays, np.ndarray):
        return arrays.copy() if _SIMULATED else cuda.to_device(arrays)
    return arrays._make(map(on_device, arrays))


def is_on_device(given: Any) -> bool:
    """Whether an array lies on the device already."""
    return hasattr(given, "__cuda_array_interface__")


def as_device_array(given: Any) -> Any:
    """An array of any library that lies on the device, to be read in place."""
    return cuda.as_cuda_array(given)


def on_host(array: Any) -> NDArray[Any]:
    """A copy of an array on the device."""
    return array.copy() if _SIMULATED else array.copy_to_host()


def write(view: Any, values: NDArray[Any]) -> None:
    """Write an array on the device, or a view of one, that is contiguous."""
    if not view.size:
        return
    if _SIMULATED:
        view[...] = values
    else:
        view.copy_to_device(np.ascontiguousarray(values))


def lane_on_host(arrays: Any, lane: int) -> Any:
    """A copy of one lane of a named tuple of arrays and named tuples on the device.

    The axis of lanes remains, with a length of one.
    """
    if isinstance(arrays, tuple):
        return type(arrays)(*(lane_on_host(array, lane) for array in arrays))
    if not arrays.size:
        return np.zeros((1, *arrays.shape[1:]), arrays.dtype)
    return on_host(arrays[lane : lane + 1])


def write_lane(arrays: Any, lane: int, values: Any) -> None:
    """Write what `lane_on_host` has returned."""
    if isinstance(arrays, tuple):
        for array, value in zip(arrays, values, strict=True):
            write_lane(array, lane, value)
    elif arrays.size:
        write(arrays[lane : lane + 1], values)


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
            write(arrays[f][first : first + values.size], values)
    return Pool(memory.declaration(*arrays), on_device(here.first), on_device(here.sizes))
