"""Views of declared arrays (`memory.py`) for kernels: at addresses, into a pool, of a lane.

They own nothing: the caller keeps the arrays alive for as long, and a view must not leave compiled
code.
"""

import ctypes
import math
from collections.abc import Callable, Mapping
from functools import cached_property
from typing import Any

import numpy as np
from numba import typeof, types
from numba.core import cgutils
from numba.extending import intrinsic
from numba.np.arrayobj import make_array
from numpy.typing import NDArray

from uas_coverage_env.compiled.array_views import view_of
from uas_coverage_env.compiled.kernels import COMPILED
from uas_coverage_env.compiled.memory import Field, Memory, Pool, T


def _pointer(builder: Any, pointer: Any, n_bytes: Any) -> Any:
    """A pointer, moved on by a number of bytes."""
    byte = cgutils.voidptr_t
    return builder.bitcast(builder.gep(builder.bitcast(pointer, byte), [n_bytes]), pointer.type)


def _views(context: Any, builder: Any, memory: Memory, starts: list, sizes: Mapping) -> Any:
    """The declaration, its arrays views at these pointers with sizes that are LLVM values."""
    views = []
    for field, start in zip(memory.fields, starts, strict=True):
        view_type = field.numba_type()
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
    made: Any = intrinsic(typed) if COMPILED else plain
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
                    element = context.get_data_type(field.numba_type().dtype)
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
        return memory.lane(lanes, lane, known)

    def typed(typing_context, lanes, lane, pool, s):
        def generate(context, builder, signature, arguments):
            given_lanes, given_lane, given_pool, given_s = arguments
            parts = cgutils.unpack_tuple(builder, given_lanes)
            arrays = [
                make_array(array_type)(context, builder, part)
                for array_type, part in zip(lanes, parts, strict=True)
            ]
            at = context.cast(builder, given_lane, lane, types.intp)
            mission = context.cast(builder, given_s, s, types.intp)
            _, _, sizes = _unpacked(context, builder, pool, given_pool)
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
    tables = [
        make_array(table_type)(context, builder, table)
        for table_type, table in ((pool[1], first), (pool[2], sizes))
    ]
    return flat, tables[0], tables[1]


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


copy_arrays = _in_kernels(_copied, copy_arrays)


class Handover:
    """How the body of a parallel loop gets a tuple of tuples: numba hands it flat ones only.

    Args:
        example: Makes a tuple of the same type.

    Attributes:
        keep: In a kernel, (tuple) -> a number, good until the kernel returns.
        take: In the body of its parallel loop, (number) -> the tuple, its arrays views.
    """

    def __init__(self, example: Callable[[], Any]) -> None:
        self._example = example
        self._kept: dict[int, Any] = {}
        self.keep = _in_kernels(self._typed_keep(), self._plain_keep)
        self.take = _in_kernels(self._typed_take(), self._plain_take)

    @cached_property
    def _type(self) -> Any:
        return typeof(self._example())

    def _plain_keep(self, value: Any) -> int:
        self._kept = {id(value): value}
        return id(value)

    def _plain_take(self, number: int) -> Any:
        return self._kept[number]

    def _typed_keep(self) -> Callable[..., Any]:
        def typed(typing_context, value):
            if value != self._type:
                raise TypeError(f"a parallel loop is handed {value}, not {self._type}")

            def generate(context, builder, signature, arguments):
                owned_by_none = _without_owners(context, builder, value, arguments[0])
                place = cgutils.alloca_once_value(builder, owned_by_none)
                return builder.ptrtoint(place, context.get_value_type(types.int64))

            return types.int64(value), generate

        return typed

    def _typed_take(self) -> Callable[..., Any]:
        def typed(typing_context, number):
            def generate(context, builder, signature, arguments):
                kind = context.get_value_type(self._type).as_pointer()
                return builder.load(builder.inttoptr(arguments[0], kind))

            return self._type(types.int64), generate

        return typed


def _without_owners(context: Any, builder: Any, kind: Any, value: Any) -> Any:
    """The same value, its arrays views: to count references to them would hold up all threads."""
    if isinstance(kind, types.BaseTuple):
        kinds: Any = kind
        parts = zip(kinds, cgutils.unpack_tuple(builder, value), strict=True)
        return context.make_tuple(
            builder, kind, [_without_owners(context, builder, *part) for part in parts]
        )
    if isinstance(kind, types.Array):
        array = make_array(kind)(context, builder, value)
        array.meminfo = array.meminfo.type(None)
        array.parent = array.parent.type(None)
        return array._getvalue()
    return value
