"""Arrays of a checkpoint that are loaded: checked, since kernels check no index."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

Limits = Mapping[str, tuple[ArrayLike, ArrayLike]]
"""Name of an array -> lowest and highest value of its elements, arrays that broadcast to it."""


_FORMER = {"company": "around"}


def by_present_names(state: Mapping[str, NDArray[Any]]) -> dict[str, NDArray[Any]]:
    """The arrays by the names of this version; version 0.2 had another for one of them."""
    return {_FORMER.get(name, name): array for name, array in state.items()}


def check_like(state: Mapping[str, NDArray[Any]], own: Mapping[str, NDArray[Any]]) -> None:
    """Refuse arrays that are not as our own are.

    Raises:
        ValueError: An array is missing, surplus, or of another shape or dtype.
    """
    if set(state) != set(own):
        wrong = ", ".join(sorted(set(state) ^ set(own)))
        raise ValueError(f"the state of another environment: {wrong} missing or surplus")
    for name, array in own.items():
        given = np.asarray(state[name])
        if given.shape != array.shape or given.dtype != array.dtype:
            raise ValueError(
                f"{name} has shape {given.shape} and dtype {given.dtype}; "
                f"here it has {array.shape} and {array.dtype}"
            )


def fields_of(arrays: Mapping[str, NDArray[Any]]) -> dict[str, NDArray[Any]]:
    """Copies of the arrays, of records each field as `name.field`: files hold these."""
    plain: dict[str, NDArray[Any]] = {}
    for name, array in arrays.items():
        if array.dtype.names is None:
            plain[name] = array.copy()
        else:
            plain |= {f"{name}.{part}": array[part].copy() for part in array.dtype.names}
    return plain


def records_of(
    state: Mapping[str, NDArray[Any]], own: Mapping[str, NDArray[Any]]
) -> dict[str, NDArray[Any]]:
    """The arrays of `fields_of` put together as our own are.

    Args:
        state: See `check_like`.
        own: Our arrays.
    """
    whole: dict[str, NDArray[Any]] = {}
    for name, array in own.items():
        if array.dtype.names is None:
            whole[name] = np.asarray(state[name])
            continue
        whole[name] = np.zeros(array.shape, array.dtype)
        for part in array.dtype.names:
            whole[name][part] = state[f"{name}.{part}"]
    return whole


def check_values(state: Mapping[str, NDArray[Any]], limits: Limits) -> None:
    """Refuse numbers that are not finite, and indices that point at nothing.

    Raises:
        ValueError: An array holds such a value; names both.
    """
    for name, given in fields_of(state).items():
        wrong = np.zeros(np.shape(given), dtype=np.bool_)
        if np.issubdtype(given.dtype, np.floating):
            wrong = ~np.isfinite(given)
        elif name in limits:
            low, high = limits[name]
            wrong = (given < low) | (given > high)
        if wrong.any():
            at = np.unravel_index(int(wrong.argmax()), wrong.shape)
            place = ", ".join(str(int(k)) for k in at)
            raise ValueError(f"{name}[{place}] is {given[at]}, which no mission here can have")
