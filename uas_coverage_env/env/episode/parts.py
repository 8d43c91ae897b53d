"""Blocks and terms for kernels: those of a version are part of its step, others are called."""

from collections.abc import Callable, Sequence
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.env.episode.memory import CALL_DTYPE


class Part(Protocol):
    """A block of an observation, or a term of a reward."""

    @property
    def kernels(self) -> tuple[Any, ...]:
        """What computes it."""
        ...

    @property
    def size(self) -> int:
        """How many numbers it writes."""
        ...

    @property
    def parameters(self) -> tuple[float, ...]:
        """What its kernel is handed."""
        ...


def handed_over(
    parts: Sequence[Part], own: Sequence[Part], address_of: Callable[[Any], int]
) -> tuple[NDArray[np.bool_], NDArray[np.void], NDArray[np.float64]]:
    """What kernels are told of parts.

    Args:
        parts: Those that are wanted.
        own: Those of the version, which its step contains.
        address_of: Compiles a part of another origin, and says where it lies.

    Returns:
        (1,) whether those of the version come first; the calls of the others; all parameters.

    Raises:
        ValueError: A part cannot be compiled.
    """
    begins = _compiled_as(parts[: len(own)]) == _compiled_as(own)
    column = first = 0
    calls = []
    for k, part in enumerate(parts):
        n = len(part.parameters)
        if not begins or k >= len(own):
            calls.append((address_of(part), column, part.size, first, n))
        column += part.size
        first += n
    return (
        np.array([begins]),
        np.array(calls, dtype=CALL_DTYPE),
        np.array([number for part in parts for number in part.parameters], dtype=np.float64),
    )


def _compiled_as(parts: Sequence[Part]) -> list[tuple[Any, ...]]:
    """What machine code depends on; numbers that a kernel is handed may be others."""
    return [(part.kernels, part.size, len(part.parameters)) for part in parts]
