"""What an observation is made of: blocks, each a table of numbers and a kernel that writes them."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from uas_coverage_env.files.blocks import check_parameters, numbered


@dataclass(frozen=True)
class Feature:
    """Some numbers of an observation.

    Attributes:
        name: What they are; a Python identifier.
        size: How many.
        low: Smallest value.
        high: Largest value; what lies beyond is clipped.
        meaning: In words, with scale.
    """

    name: str
    size: int
    low: float
    high: float
    meaning: str


@dataclass(frozen=True)
class Group:
    """Features that belong together, `repeats` times in a row.

    Attributes:
        name: Of what.
        repeats: How often all features follow one another.
        features: In order.
    """

    name: str
    repeats: int
    features: tuple[Feature, ...]

    @property
    def size(self) -> int:
        """How many numbers."""
        return self.repeats * self.width

    @property
    def width(self) -> int:
        """How many numbers before the features repeat."""
        return sum(feature.size for feature in self.features)

    @property
    def columns(self) -> Any:
        """The first column of each feature, as a named tuple: kernels write by these names."""
        firsts = []
        column = 0
        for feature in self.features:
            firsts.append(column)
            column += feature.size
        return numbered((feature.name for feature in self.features), firsts)


@dataclass(frozen=True)
class ObservationBlock(Group):
    """A group of features and the kernel that writes them.

    The kernel is `write(arena, state, tables, learners, i, parameters, row)`, compiled with
    `uas_coverage_env.compiled.kernels.kernel`:

    - `arena`, the mission (`world.Arena`); `state`, the world (`world.WorldState`);
    - `tables` and `learners`, what the environment adds (`env.episode.memory`);
    - `i`, the index of the UAS that observes;
    - `parameters`, (P,) float64, those of the block;
    - `row`, (size,) float32, this block's numbers, to be written within their bounds. It holds
      what was written there before.

    Attributes:
        write: The kernel.
        parameters: Finite numbers that it is handed.
        shape: (channels, rows, columns) where the numbers, from 0 to 1, are a picture; see
            `images_apart` of the environments. Empty where they are none.
        needs: Kernels `note(arena, state, tables, learners, i)` that are called before, once for
            all blocks of an observation that have them; they write to `learners.notes[i]`.

    Raises:
        ValueError: A parameter is not finite, or the shape has another size than the group.
    """

    write: Any
    parameters: tuple[float, ...] = ()
    shape: tuple[int, ...] = ()
    needs: tuple[Any, ...] = ()

    def __post_init__(self) -> None:
        check_parameters(f"observation block {self.name}", self.parameters)
        if self.shape and (len(self.shape) != 3 or math.prod(self.shape) != self.size):
            raise ValueError(
                f"observation block {self.name}: shape is {self.shape}; give (channels, rows, "
                f"columns) of {self.size} numbers"
            )

    @property
    def kernels(self) -> tuple[Any, ...]:
        """What computes it."""
        return (self.write, *self.needs)


def flag(name: str, meaning: str) -> Feature:
    """One number from 0 to 1."""
    return Feature(name, 1, 0.0, 1.0, meaning)


def firsts_of(groups: Sequence[Group]) -> Any:
    """The first column of each group of an observation, as a named tuple."""
    firsts = []
    column = 0
    for group in groups:
        firsts.append(column)
        column += group.size
    return numbered((group.name for group in groups), firsts)


DIRECTION = "unit vector to it, north and east; 0 where it is straight above or below"
