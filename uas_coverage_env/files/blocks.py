"""Blocks with a kernel, which users write as well: what every tuple of them has to satisfy."""

from collections import namedtuple
from collections.abc import Iterable, Sequence
from math import isfinite
from numbers import Real
from typing import Any, TypeVar

T = TypeVar("T")


def checked_blocks(
    argument: str, nouns: str, blocks: Any, kind: type[T], *, least: int = 1
) -> tuple[T, ...]:
    """The blocks that an argument gives.

    Args:
        argument: Its name.
        nouns: What the blocks are called.
        blocks: What was given.
        kind: Their class, with a `name`.
        least: How many there must be.

    Raises:
        ValueError: They are not of this class, too few, or two have one name.
    """
    if isinstance(blocks, kind | str) or not isinstance(blocks, Sequence):
        raise ValueError(f"{argument} is {blocks!r}; give a tuple of {nouns}")
    for block in blocks:
        if not isinstance(block, kind):
            raise ValueError(f"{argument}: {block!r} is no {kind.__name__}")
    names = [block.name for block in blocks]
    if len(names) < least or len(set(names)) < len(names):
        raise ValueError(f"{argument}: {nouns} are named {names}; give each a name of its own")
    return tuple(blocks)


def numbered(names: Iterable[str], numbers: Iterable[int]) -> Any:
    """Numbers by their names: a named tuple, whose fields are constants to a kernel.

    Args:
        names: Of the fields.
        numbers: The value of each.
    """
    made: Any = namedtuple
    return made("numbers", [*names])(*numbers)


def check_parameters(what: str, parameters: Sequence[Any]) -> None:
    """Refuse parameters of a kernel that are not finite numbers.

    Args:
        what: The block, in words.
        parameters: Those that it hands to its kernel.

    Raises:
        ValueError: One is not finite, or no number.
    """
    for k, number in enumerate(parameters):
        real = isinstance(number, Real) and not isinstance(number, bool)
        if not real or not isfinite(number):
            raise ValueError(f"{what}: parameters[{k}] is {number!r}; give a finite number")
