"""Arrays declared once: everything that compiled code needs to know of them follows from a class.

A declaration is a named tuple whose fields say type and axes of their arrays:

    class WorldState(NamedTuple):
        x: Annotated[NDArray[np.float64], "U", N_STATES]
        status: Annotated[NDArray[np.int64], "U", Values(0, 2)]
        commands: Annotated[NDArray[np.void], COMMAND_DTYPE, "U"]

An axis is a number, or the name of a size that all arrays of a mission share. From it follow the
arrays themselves (`Memory.zeros`), those of many missions side by side (`lanes`) or end to end
(`Memory.pool`), their types for numba (`Memory.numba_type`), and what a kernel is handed: one array
of addresses (`Layout`), because to pass every array takes longer than the flight of a UAS.

The views that kernels get own nothing, as those of `borrow`: whoever makes one keeps the arrays
alive for as long, and a view must not leave compiled code.
"""

import ctypes
import math
from collections.abc import Callable, Mapping, Sequence
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
from numba import config, types
from numba.core import cgutils
from numba.extending import intrinsic
from numba.np import numpy_support
from numba.np.arrayobj import make_array
from numpy.typing import NDArray

from uas_coverage_env.borrow import view_of

T = TypeVar("T", bound=tuple)

_COMPILED = not config.DISABLE_JIT  # pyright: ignore[reportAttributeAccessIssue]

Axis = str | int


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
        values: What its elements may be; None: every finite number of its type.
    """

    name: str
    dtype: np.dtype
    axes: tuple[Axis, ...]
    values: Values | None

    def shape(self, sizes: Mapping[str, int]) -> tuple[int, ...]:
        """Its shape where the named sizes are known."""
        return tuple(sizes[axis] if isinstance(axis, str) else axis for axis in self.axes)


def _field(name: str, annotation: Any) -> Field:
    if get_origin(annotation) is not Annotated:
        raise TypeError(f"{name}: declare it as Annotated[NDArray[...], axes...]")
    array, *said = get_args(annotation)
    if isinstance(said[0], np.dtype):
        dtype = said.pop(0)
    else:
        (scalar,) = get_args(get_args(array)[1])
        dtype = np.dtype(scalar)
    values = said.pop() if isinstance(said[-1], Values) else None
    return Field(name, dtype, tuple(said), values)


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
        """New arrays of zeros.

        Args:
            sizes: Of every name.
            lanes: Length of an axis in front of all; None: no such axis.
        """
        front = () if lanes is None else (lanes,)
        return self.made_of(
            {
                field.name: np.zeros((*front, *field.shape(sizes)), dtype=field.dtype)
                for field in self.fields
            }
        )

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
            Name of an array -> lowest and highest value; these broadcast to it.
        """
        limits = {}
        for field in self.fields:
            if field.values is not None:
                high = field.values.high
                last = np.asarray(sizes[high] - 1 if isinstance(high, str) else high)
                behind = len(field.axes) + lanes - last.ndim
                limits[field.name] = (field.values.low, last.reshape(last.shape + (1,) * behind))
        return limits

    def numba_type(self) -> Any:
        """The declaration as a type of numba's."""
        return _tuple_type(self.declaration, [_array_type(field) for field in self.fields])


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


def _array_type(field: Field, n_axes: int | None = None) -> Any:
    element = numpy_support.from_dtype(field.dtype)
    return types.Array(element, len(field.axes) if n_axes is None else n_axes, "C")


def _tuple_type(declaration: Any, elements: Sequence[Any]) -> Any:
    return types.BaseTuple.from_types(tuple(elements), declaration)


def _pointer(builder: Any, pointer: Any, n_bytes: Any) -> Any:
    """A pointer, moved on by a number of bytes."""
    byte = cgutils.voidptr_t
    return builder.bitcast(builder.gep(builder.bitcast(pointer, byte), [n_bytes]), pointer.type)


def _views(context: Any, builder: Any, memory: Memory, starts: list, sizes: Mapping) -> Any:
    """The declaration, its arrays views at these pointers with sizes that are LLVM values."""
    views = []
    for field, start in zip(memory.fields, starts, strict=True):
        view_type = _array_type(field)
        element = context.get_data_type(view_type.dtype)
        shape = [
            sizes[axis] if isinstance(axis, str) else context.get_constant(types.intp, axis)
            for axis in field.axes
        ]
        itemsize = context.get_constant(types.intp, context.get_abi_sizeof(element))
        views.append(view_of(builder, context, view_type, start, shape, itemsize))
    return context.make_tuple(builder, memory.numba_type(), views)


def _in_kernels(typed: Callable[..., Any], plain: Callable[..., Any]) -> Callable[..., Any]:
    """What kernels call: generated code, or with NUMBA_DISABLE_JIT=1 plain Python."""
    made: Any = intrinsic(typed) if _COMPILED else plain
    return made


class Layout:
    """Several declarations whose arrays a kernel is handed as one array of addresses.

    Args:
        memories: The declarations. A name of a size means the same in all of them.

    Attributes:
        size: How many numbers `addresses_of` returns; more may follow them in the same array.
        views: In a kernel, the declarations as a tuple: `arena, state = layout.views(at)`; to be
            bound to a name of the module first, since numba takes no attributes of objects.
    """

    def __init__(self, *memories: Memory) -> None:
        self.memories = memories
        self.names = tuple(dict.fromkeys(name for memory in memories for name in memory.names))
        self._n_fields = sum(len(memory.fields) for memory in memories)
        self.size = self._n_fields + len(self.names)
        self.views = _in_kernels(self._typed_views, self._plain_views)

    def addresses_of(self, *missions: tuple) -> NDArray[np.int64]:
        """Where arrays lie, then their sizes; they have to stay there.

        Args:
            missions: An instance of each declaration.

        Raises:
            ValueError: An array is not what was declared, or sizes do not agree.
        """
        sizes: dict[str, int] = {}
        for memory, arrays in zip(self.memories, missions, strict=True):
            sizes = memory.sizes_of(arrays, sizes)
        addresses = [array.ctypes.data for arrays in missions for array in arrays]
        return np.array([*addresses, *(sizes[name] for name in self.names)], dtype=np.int64)

    def _plain_views(self, at: NDArray[np.int64]) -> tuple[Any, ...]:
        sizes = dict(zip(self.names, at[self._n_fields : self.size].tolist(), strict=True))
        addresses = iter(at[: self._n_fields].tolist())
        return tuple(
            memory.made_of({f.name: _at_address(next(addresses), f, sizes) for f in memory.fields})
            for memory in self.memories
        )

    def _typed_views(self, typing_context, at):
        result = types.Tuple([memory.numba_type() for memory in self.memories])

        def generate(context, builder, signature, arguments):
            given = make_array(at)(context, builder, arguments[0])
            numbers = [
                builder.load(builder.gep(given.data, [context.get_constant(types.intp, k)]))
                for k in range(self.size)
            ]
            sizes = dict(zip(self.names, numbers[self._n_fields :], strict=True))
            addresses = iter(numbers)
            made = []
            for memory in self.memories:
                starts = []
                for field in memory.fields:
                    element = context.get_data_type(_array_type(field).dtype)
                    starts.append(builder.inttoptr(next(addresses), element.as_pointer()))
                made.append(_views(context, builder, memory, starts, sizes))
            return context.make_tuple(builder, result, made)

        return result(at), generate


def _at_address(address: int, field: Field, sizes: Mapping[str, int]) -> NDArray[Any]:
    shape = field.shape(sizes)
    n_bytes = math.prod(shape) * field.dtype.itemsize
    memory = memoryview((ctypes.c_char * n_bytes).from_address(address))
    return np.ndarray(shape, field.dtype, memory)


def pool_view(memory: Memory[T]) -> Callable[[Pool, Any], T]:
    """A function for kernels, (pool, s) -> the declaration of mission s, views into the pool."""

    def typed(typing_context, pool, s):
        def generate(context, builder, signature, arguments):
            flat, first, sizes = _unpacked(context, builder, pool, arguments[0])
            at = context.cast(builder, arguments[1], s, types.intp)
            starts = [
                builder.gep(array.data, [_element(context, builder, first, at, f)])
                for f, array in enumerate(flat)
            ]
            known = {
                name: _element(context, builder, sizes, at, k)
                for k, name in enumerate(memory.names)
            }
            return _views(context, builder, memory, starts, known)

        return memory.numba_type()(pool, s), generate

    return _in_kernels(typed, memory.mission)


def lane_view(memory: Memory[T], sized_by: Memory) -> Callable[[T, Any, Pool, Any], T]:
    """A function for kernels, (lanes, lane, pool, s) -> the declaration of one lane, views.

    The arrays of a lane have room for the largest mission; the view has the sizes of mission s of
    a pool, and uses the first rows of its lane.

    Args:
        memory: What lies in the lanes.
        sized_by: What lies in the pool; sizes that it does not name are those of the lanes.

    Raises:
        TypeError: An axis that varies with the mission is not the first: the rest of a lane would
            lie in between.
    """
    for field in memory.fields:
        if set(field.axes[1:]) & set(sized_by.names):
            raise TypeError(f"{field.name}: only its first axis may be of a size of the mission")

    def plain(lanes: T, lane: int, pool: Pool, s: int) -> T:
        known = dict(zip(sized_by.names, pool.sizes[s].tolist(), strict=True))
        made = {}
        for field, array in zip(memory.fields, lanes, strict=True):
            mine = array[lane]
            shape = tuple(
                known.get(str(axis), size)
                for axis, size in zip(field.axes, mine.shape, strict=True)
            )
            made[field.name] = mine.reshape(-1)[: math.prod(shape)].reshape(shape)
        return memory.made_of(made)

    def typed(typing_context, lanes, lane, pool, s):
        def generate(context, builder, signature, arguments):
            parts = cgutils.unpack_tuple(builder, arguments[0])
            arrays = [
                make_array(array_type)(context, builder, part)
                for array_type, part in zip(lanes, parts, strict=True)
            ]
            at = context.cast(builder, arguments[1], lane, types.intp)
            mission = context.cast(builder, arguments[3], s, types.intp)
            _, _, sizes = _unpacked(context, builder, pool, arguments[2])
            known = {
                name: _element(context, builder, sizes, mission, k)
                for k, name in enumerate(sized_by.names)
            }
            starts = []
            for field, array in zip(memory.fields, arrays, strict=True):
                stride = cgutils.unpack_tuple(builder, array.strides)[0]
                starts.append(_pointer(builder, array.data, builder.mul(at, stride)))
                shape = cgutils.unpack_tuple(builder, array.shape)[1:]
                for axis, size in zip(field.axes, shape, strict=True):
                    if isinstance(axis, str):
                        known.setdefault(axis, size)
            return _views(context, builder, memory, starts, known)

        return memory.numba_type()(lanes, lane, pool, s), generate

    return _in_kernels(typed, plain)


def _unpacked(context: Any, builder: Any, pool: Any, value: Any) -> tuple[list[Any], Any, Any]:
    """The flat arrays of a pool, and its two tables."""
    arrays, first, sizes = cgutils.unpack_tuple(builder, value)
    flat = [
        make_array(array_type)(context, builder, array)
        for array_type, array in zip(pool[0], cgutils.unpack_tuple(builder, arrays), strict=True)
    ]
    tables = (
        make_array(table_type)(context, builder, table)
        for table_type, table in ((pool[1], first), (pool[2], sizes))
    )
    return flat, *tables


def _element(context: Any, builder: Any, table: Any, row: Any, column: int) -> Any:
    """An element of a C-contiguous table of intp."""
    width = cgutils.unpack_tuple(builder, table.shape)[1]
    at = builder.add(builder.mul(row, width), context.get_constant(types.intp, column))
    return builder.load(builder.gep(table.data, [at]))


def _copied(typing_context, source, target):
    def generate(context, builder, signature, arguments):
        for kind, given, written in zip(
            target,
            cgutils.unpack_tuple(builder, arguments[0]),
            cgutils.unpack_tuple(builder, arguments[1]),
            strict=True,
        ):
            origin = make_array(kind)(context, builder, given)
            copy = make_array(kind)(context, builder, written)
            cgutils.raw_memcpy(builder, copy.data, origin.data, copy.nitems, copy.itemsize)
        return context.get_dummy_value()

    if source != target:
        return None
    return types.none(source, target), generate


def copy_arrays(source: Any, target: Any) -> None:
    """Copy all arrays of a declaration into those of another of the same sizes, in a kernel too.

    Args:
        source: The declaration.
        target: Likewise; its arrays are written.
    """
    for given, written in zip(source, target, strict=True):
        written[...] = given


if _COMPILED:
    copy_arrays = intrinsic(_copied)  # pyright: ignore[reportAssignmentType]
