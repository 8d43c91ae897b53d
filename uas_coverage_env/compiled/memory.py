"""Arrays declared once: everything that compiled code needs to know of them follows from a class.

A declaration is a named tuple whose fields say type and axes of their arrays:

    class WorldState(NamedTuple):
        x: Annotated[NDArray[np.float64], "U", N_STATES]
        step: Annotated[NDArray[np.int64], 1, Values(0, "samples")]
        uas: Annotated[NDArray[np.void], UAS_DTYPE, "U", {"status": Values(0, 2)}]

An axis is a number, or the name of a size that all arrays of a mission share. From it follow the
arrays themselves (`Memory.zeros`), those of many missions side by side (`lanes`) or end to end
(`Memory.pool`), the values that a checkpoint may hold (`Memory.limits`), their types for numba
(`Memory.numba_type`), and the views that kernels get (`views.py`).
"""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import (
    Annotated,
    Any,
    Generic,
    NamedTuple,
    TypeVar,
    get_args,
    get_origin,
    get_type_hints,
)

import numpy as np
from numba import typeof
from numpy.typing import NDArray

T = TypeVar("T", bound=tuple)

Axis = str | int


def record_dtype(fields: list[tuple[Any, ...]]) -> np.dtype[np.void]:
    """Type of structured arrays whose elements compiled code reads as attributes.

    Args:
        fields: Name, type and, where it is an array, shape of each, as numpy takes them.
    """
    # np.record: attributes work in plain Python too (NUMBA_DISABLE_JIT=1)
    return np.dtype((np.record, np.dtype(fields, align=True)))


@dataclass(frozen=True)
class Values:
    """What the elements of an array may be, where not every number of its type is meant.

    Attributes:
        low: The smallest value.
        high: The largest value; or the name of a size, of which the elements are indices.
    """

    low: int
    high: int | str


@dataclass(frozen=True)
class Field:
    """One array of a declaration.

    Attributes:
        name: Its name.
        dtype: Type of its elements.
        axes: A number, or the name of a size, for each axis.
        values: Of a field of its records, or of "" where it has none: what its elements may be;
            every finite number of its type, where that is not said.
    """

    name: str
    dtype: np.dtype
    axes: tuple[Axis, ...]
    values: Mapping[str, Values]

    def shape(self, sizes: Mapping[Any, Any]) -> tuple[Any, ...]:
        """Its shape where the named sizes are known."""
        return tuple(sizes[axis] if isinstance(axis, str) else axis for axis in self.axes)


def _scalars(annotation: Any) -> set[type[np.generic]]:
    """The types of elements that an annotation names.

    How an alias such as `NDArray[np.float64]` is nested differs between versions of numpy, and it
    may hide behind a name (`type Rows = NDArray[...]`).
    """
    if isinstance(annotation, type) and issubclass(annotation, np.generic):
        return {annotation}
    within = get_args(annotation) or (getattr(annotation, "__value__", None),)
    return set().union(*(_scalars(each) for each in within if each is not None))


def _field(name: str, annotation: Any) -> Field:
    if get_origin(annotation) is not Annotated:
        raise TypeError(f"{name}: declare it as Annotated[NDArray[...], axes...]")
    array, *said = get_args(annotation)
    if isinstance(said[0], np.dtype):
        dtype = said.pop(0)
    else:
        scalars = _scalars(array)
        if len(scalars) != 1:
            raise TypeError(f"{name}: {array} does not say one type of elements")
        dtype = np.dtype(scalars.pop())
    values = said.pop() if isinstance(said[-1], Values | dict) else {}
    return Field(name, dtype, tuple(said), {"": values} if isinstance(values, Values) else values)


class Pool(NamedTuple):
    """The arrays of many missions end to end, for kernels; equal arrays are stored once."""

    arrays: Any
    """The declaration, each of its arrays flat."""
    first: NDArray[np.int64]
    """(S, fields) where an array of mission s begins."""
    sizes: NDArray[np.int64]
    """(S, names of sizes) in the order of `Memory.names`."""


class Memory(Generic[T]):
    """What a declaration says.

    Args:
        declaration: A named tuple of annotated arrays.

    Attributes:
        declaration: As given.
        fields: Its arrays, in order.
        names: The named sizes, in the order in which they first occur.

    Raises:
        TypeError: A field is not annotated with its axes.
    """

    def __init__(self, declaration: type[T]) -> None:
        hints = get_type_hints(declaration, include_extras=True)
        self.declaration = declaration
        self.fields = tuple(_field(name, hint) for name, hint in hints.items())
        axes = (axis for field in self.fields for axis in field.axes)
        self.names = tuple(dict.fromkeys(axis for axis in axes if isinstance(axis, str)))

    def __reduce__(self) -> tuple[Any, ...]:
        return Memory, (self.declaration,)

    def made_of(self, arrays: Mapping[str, NDArray[Any]]) -> T:
        """The declaration with these arrays."""
        return self.declaration(**arrays)

    def zeros(self, sizes: Mapping[str, int], *, lanes: int | None = None) -> T:
        """New arrays: of zeros, or of the smallest value where the declaration says values.

        Args:
            sizes: Of every name.
            lanes: Length of an axis in front of all; None: no such axis.
        """
        front = () if lanes is None else (lanes,)
        arrays = {}
        for field in self.fields:
            array = arrays[field.name] = np.zeros((*front, *field.shape(sizes)), dtype=field.dtype)
            if "" in field.values and field.values[""].low:
                array[...] = field.values[""].low
        return self.made_of(arrays)

    def sizes_of(self, arrays: T, known: Mapping[str, int] | None = None) -> dict[str, int]:
        """The named sizes of arrays; this is also the check that they are what was declared.

        Args:
            arrays: The declaration.
            known: Sizes that they have to agree with.

        Raises:
            ValueError: An array is of another type or shape than declared, or not contiguous.
        """
        sizes = dict(known or {})
        for field, array in zip(self.fields, arrays, strict=True):
            where = f"{self.declaration.__name__}.{field.name}"
            if array.dtype != field.dtype or array.ndim != len(field.axes):
                raise ValueError(
                    f"{where} has dtype {array.dtype} and {array.ndim} axes; "
                    f"declared are {field.dtype} and {len(field.axes)}"
                )
            if not array.flags.c_contiguous:
                raise ValueError(f"{where} is not contiguous")
            for axis, size in zip(field.axes, array.shape, strict=True):
                expected = sizes.setdefault(axis, size) if isinstance(axis, str) else axis
                if size != expected:
                    raise ValueError(f"{where} has shape {array.shape}; axis {axis} is {expected}")
        return sizes

    def pool(self, missions: Sequence[T]) -> Pool:
        """The arrays of many missions, end to end.

        Args:
            missions: Of each, the declaration; at least one.

        Raises:
            ValueError: See `sizes_of`.
        """
        sizes = [self.sizes_of(arrays) for arrays in missions]
        first = np.zeros((len(missions), len(self.fields)), dtype=np.int64)
        flat = {}
        for f, field in enumerate(self.fields):
            flat[field.name], first[:, f] = _end_to_end([arrays[f] for arrays in missions])
        return Pool(
            self.made_of(flat),
            first,
            np.array([[each[name] for name in self.names] for each in sizes], dtype=np.int64),
        )

    def mission(self, pool: Pool, s: int) -> T:
        """The declaration of mission s of a pool, views into it."""
        sizes = dict(zip(self.names, pool.sizes[s].tolist(), strict=True))
        made = {}
        for f, field in enumerate(self.fields):
            shape = field.shape(sizes)
            first = int(pool.first[s, f])
            made[field.name] = pool.arrays[f][first : first + math.prod(shape)].reshape(shape)
        return self.made_of(made)

    def lane(self, lanes: T, lane: int, sizes: Mapping[str, int]) -> T:
        """The declaration of one lane, views of the first rows of each array in it.

        Args:
            lanes: The declaration, its arrays with an axis of lanes in front.
            lane: Which.
            sizes: Of the mission in it; sizes that are not named are those of the lanes.
        """
        return self.first_rows([array[lane] for array in lanes], sizes)

    def first_rows(self, arrays: Sequence[NDArray[Any]], sizes: Mapping[str, int]) -> T:
        """The declaration of a mission in arrays with room for a larger one, views.

        Args:
            arrays: Of each field, with room; contiguous.
            sizes: Of the mission; sizes that are not named are those of the arrays.
        """
        made = {}
        for field, array in zip(self.fields, arrays, strict=True):
            shape = tuple(
                sizes.get(str(axis), size)
                for axis, size in zip(field.axes, array.shape, strict=True)
            )
            made[field.name] = array.reshape(-1)[: math.prod(shape)].reshape(shape)
        return self.made_of(made)

    def size(self, pool: Pool, name: str) -> NDArray[np.int64]:
        """One size of all missions of a pool, (S,)."""
        return pool.sizes[:, self.names.index(name)]

    def largest(self, pool: Pool) -> dict[str, int]:
        """The largest of every size of a pool."""
        return {name: int(self.size(pool, name).max()) for name in self.names}

    def limits(
        self, sizes: Mapping[str, int | NDArray[np.int64]], *, lanes: bool
    ) -> dict[str, tuple[int, NDArray[np.int64]]]:
        """The smallest and largest values of those arrays for which the declaration says them.

        Args:
            sizes: Of the names of which elements are indices: one, or (L,) one for each mission.
            lanes: Whether the arrays have an axis of lanes in front.

        Returns:
            Name of an array, or array.field of its records -> lowest and highest value; these
            broadcast to it.
        """
        limits = {}
        for field in self.fields:
            for part, values in field.values.items():
                high = values.high
                last = np.asarray(sizes[high] - 1 if isinstance(high, str) else high)
                behind = len(field.axes) + lanes - last.ndim
                name = f"{field.name}.{part}" if part else field.name
                limits[name] = (values.low, last.reshape(last.shape + (1,) * behind))
        return limits

    def numba_type(self) -> Any:
        """The declaration as a type of numba's."""
        return typeof(self.zeros(dict.fromkeys(self.names, 0)))


def as_bytes(arrays: Iterable[NDArray[Any]]) -> list[NDArray[np.uint8]]:
    """Views of those contiguous arrays that hold anything, to be copied to and fro.

    Numpy copies records field by field, ten times as long, even where there are none.
    """
    return [array.view(np.uint8) for array in arrays if array.size]


def _end_to_end(blocks: Sequence[NDArray[Any]]) -> tuple[NDArray[Any], list[int]]:
    """Arrays as one flat array, equal ones stored once; and where each begins."""
    starts: dict[bytes, int] = {}
    kept = []
    first = []
    n = 0
    for block in blocks:
        content = block.tobytes()
        if content not in starts:
            starts[content] = n
            kept.append(block.reshape(-1))
            n += block.size
        first.append(starts[content])
    # not np.concatenate: it would repack aligned records
    elements = np.empty(n, dtype=blocks[0].dtype)
    n = 0
    for block in kept:
        elements[n : n + len(block)] = block
        n += len(block)
    return elements, first
