"""Arrays for kernels that lie in the memory of others: views, which own nothing.

The caller keeps the memory alive; a view must not leave compiled code. The functions made
here are for kernels, with NUMBA_DISABLE_JIT=1 and on a GPU too; they have to be bound to a name of
a module, since numba takes no attributes of objects.
"""

import ctypes
import math
from collections.abc import Callable, Iterable, Iterator, Mapping
from functools import cached_property
from typing import Any

import numpy as np
from llvmlite import ir
from numba import from_dtype, typeof, types
from numba.extending import intrinsic
from numpy.typing import NDArray

from uas_coverage_env.compiled.digest import Described
from uas_coverage_env.compiled.internals import array_at, parts_of
from uas_coverage_env.compiled.kernels import COMPILED, inlined_kernel
from uas_coverage_env.compiled.memory import Field, Memory, Pool, T


def _in_kernels(typed: Callable[..., Any], plain: Callable[..., Any]) -> Callable[..., Any]:
    """What kernels call: generated code, or with NUMBA_DISABLE_JIT=1 plain Python."""
    made: Any = intrinsic(typed) if COMPILED else plain
    return made


def _plain_array_at(address: int, shape: tuple[int, ...], dtype: np.dtype) -> NDArray[Any]:
    memory = (ctypes.c_char * (math.prod(shape) * dtype.itemsize)).from_address(int(address))
    return np.ndarray(shape, dtype, memoryview(memory))


def _array_at(typing_context, address, shape, dtype):
    """The C-contiguous array at an address (int64)."""
    array = types.Array(dtype.dtype, len(shape), "C")

    def generate(context, builder, signature, arguments):
        start = builder.inttoptr(arguments[0], context.get_value_type(types.voidptr))
        return array_at(context, builder, array, start, arguments[1])

    return array(types.int64, types.UniTuple(types.intp, len(shape)), dtype), generate


def _rows_of(dtype: np.dtype | None) -> Callable[..., Any]:
    """See `rows_view` and `record_view`."""

    def plain(array: NDArray[Any], row: int, shape: int | tuple[int, ...]) -> NDArray[Any]:
        kind, size = dtype or array.dtype, int(np.prod(shape))
        of_bytes = array[row:].reshape(-1).view(np.uint8)
        return of_bytes[: size * kind.itemsize].view(kind).reshape(shape)

    def typed(typing_context, array, row, shape):
        if not isinstance(array, types.Array) or array.layout != "C":
            return None
        kind = array.dtype if dtype is None else from_dtype(dtype)
        sizes = shape if isinstance(shape, types.BaseTuple) else (shape,)
        view = types.Array(kind, len(sizes), "C", readonly=not array.mutable)
        numbers = types.UniTuple(types.intp, len(sizes)) if sizes is shape else types.intp

        def generate(context, builder, signature, arguments):
            whole = parts_of(context, builder, array, arguments[0])
            first, step = arguments[1], builder.extract_value(whole.strides, 0)
            start = builder.bitcast(whole.data, context.get_value_type(types.voidptr))
            start = builder.gep(start, [builder.mul(first, step)])
            given = arguments[2]
            if sizes is not shape:
                one = ir.Constant(context.get_value_type(types.UniTuple(types.intp, 1)), None)
                given = builder.insert_value(one, given, 0)
            return array_at(context, builder, view, start, given)

        return view(array, types.intp, numbers), generate

    return _in_kernels(typed, plain)


rows_view = _rows_of(None)
"""(array, row, shape) -> the elements of a C-contiguous array from a row on, in another shape.

The array has any number of axes; the row is an index along its first one, and the elements of the
shape have to lie in the array. A shape of one axis may be a number. A slice looks where it begins
and ends from the back, and for what lies outside: with it a step takes a twelfth longer.
"""

slice_view = rows_view
"""(array, first, n) -> n elements of an array of one axis."""


def record_view(dtype: np.dtype) -> Callable[[NDArray[np.uint64], Any, Any], NDArray[Any]]:
    """A function for kernels, (words, first, n) -> (n,) records that lie in an array of words.

    `words` is C-contiguous, of numbers of eight bytes; the first record begins with the word of
    index `first`. What is written to the records is written to the words.

    Args:
        dtype: Of the records.
    """
    return _rows_of(dtype)


def _kernel_of(arguments: str, result: str, known: dict[str, Any]) -> Any:
    """A kernel of one line that names one array after the other: numba has no loop for them."""
    known |= {"rows": rows_view, "array_at": _in_kernels(_array_at, _plain_array_at)}
    exec(f"def view({arguments}):\n    return {result}", known)  # made of declarations alone
    return inlined_kernel(known["view"])  # without compilation, as it is


def _declared(memory: Memory, arrays: Iterable[str], known: dict[str, Any]) -> str:
    """The text of a declaration with arrays that are texts; `known` gets what it names."""
    known[name := f"declaration_{len(known)}"] = memory.declaration
    return f"{name}({', '.join(arrays)})"


def _shape(field: Field, sizes: Mapping[Any, str]) -> str:
    return f"({''.join(f'{size}, ' for size in field.shape(sizes))})"


class Layout:
    """Several declarations whose arrays a kernel is handed as one array of addresses.

    Args:
        memories: The declarations. A name of a size means the same in all of them.

    Attributes:
        size: How many numbers `addresses_of` returns; more may follow them in the same array.
        views: In a kernel, the declarations as a tuple: `arena, state = views(at)`.
    """

    def __init__(self, *memories: Memory) -> None:
        self.memories = memories
        self.names = tuple(dict.fromkeys(name for memory in memories for name in memory.names))
        self._n_fields = sum(len(memory.fields) for memory in memories)
        self.size = self._n_fields + len(self.names)
        self.views = self._views()

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

    def _views(self) -> Any:
        sizes = {name: f"at[{self._n_fields + k}]" for k, name in enumerate(self.names)}
        known: dict[str, Any] = {}
        made, k = [], 0
        for memory in self.memories:
            arrays = []
            for field in memory.fields:
                known[f"dtype_{k}"] = field.dtype
                arrays.append(f"array_at(at[{k}], {_shape(field, sizes)}, dtype_{k})")
                k += 1
            made.append(_declared(memory, arrays, known))
        return _kernel_of("at", f"({', '.join(made)},)", known)


def replaced(memory: Memory[T], name: str) -> Callable[[T, Any], T]:
    """A function for kernels, (arrays, array) -> the declaration with this array of that name."""
    known: dict[str, Any] = {}
    kept = ("array" if f.name == name else f"arrays.{f.name}" for f in memory.fields)
    return _kernel_of("arrays, array", _declared(memory, kept, known), known)


def pool_view(memory: Memory[T]) -> Callable[[Pool, Any], T]:
    """A function for kernels, (pool, s) -> the declaration of mission s, views into the pool."""
    known: dict[str, Any] = {}
    arrays = [
        f"rows(pool.arrays.{field.name}, pool.first[s, {f}], {_shape(field, _sizes(memory))})"
        for f, field in enumerate(memory.fields)
    ]
    return _kernel_of("pool, s", _declared(memory, arrays, known), known)


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

    known: dict[str, Any] = {}
    arrays = []
    for field in memory.fields:
        lanes = {axis: f"lanes.{field.name}.shape[{k + 1}]" for k, axis in enumerate(field.axes)}
        shape = _shape(field, lanes | _sizes(sized_by))
        arrays.append(f"rows(lanes.{field.name}, lane, {shape})")
    return _kernel_of("lanes, lane, pool, s", _declared(memory, arrays, known), known)


def _sizes(memory: Memory) -> dict[str, str]:
    """The text of each size of mission s of a pool."""
    return {name: f"pool.sizes[s, {k}]" for k, name in enumerate(memory.names)}


def _copied(typing_context, source, target):
    def generate(context, builder, signature, arguments):
        for k, kind in enumerate(target):
            given, written = (
                parts_of(context, builder, kind, builder.extract_value(each, k))
                for each in arguments
            )
            n_bytes = builder.mul(given.nitems, given.itemsize)
            places = [
                builder.bitcast(each.data, context.get_value_type(types.voidptr))
                for each in (written, given)
            ]
            kinds = [each.type for each in (*places, n_bytes)]
            copy = builder.module.declare_intrinsic("llvm.memcpy", kinds)
            builder.call(copy, [*places, n_bytes, ir.IntType(1)(0)])
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


class Handover(Described):
    """How kernels get many arrays in one array of numbers: to hand over each takes longer.

    Args:
        example: Makes a tuple of the same types: of arrays, int64 and such tuples.

    Attributes:
        take: In a kernel, (numbers) -> the tuple, its arrays views.
        take_first: Likewise, the first member of the tuple alone, which compiles faster.
    """

    def __init__(self, example: Callable[[], Any]) -> None:
        self._example = example
        self._kept: dict[int, Any] = {}
        self.take = self._taking(lambda whole: whole)
        self.take_first = self._taking(lambda whole: whole[0])

    @cached_property
    def _type(self) -> Any:
        return typeof(self._example())

    def described(self) -> str:
        """The types: no signature of a kernel that is handed numbers has them."""
        return str(self._type)

    def numbers_of(self, value: Any) -> NDArray[np.int64]:
        """What `take` makes the tuple of; its arrays have to stay where they are.

        Raises:
            TypeError: It is of other types than the example.
        """
        if not COMPILED:
            self._kept[id(value)] = value
            return np.array([id(value)])
        if typeof(value) != self._type:
            raise TypeError(f"{typeof(value)} is handed over, not {self._type}")
        return np.array(list(_numbers_of(value)), dtype=np.int64)

    def _taking(self, part_of: Callable[[Any], Any]) -> Any:
        def typed(typing_context, numbers):
            kind = part_of(self._type)

            def generate(context, builder, signature, arguments):
                at = parts_of(context, builder, numbers, arguments[0]).data
                return builder.load(builder.bitcast(at, context.get_value_type(kind).as_pointer()))

            return kind(types.Array(types.int64, 1, "C")), generate

        return _in_kernels(typed, lambda numbers: part_of(self._kept[int(numbers[0])]))


def _numbers_of(value: Any) -> Iterator[int]:
    """The words of an array as numba has it in memory, owned by nothing; or a number.

    An array may lie on a GPU, and so may what is made of the words.
    """
    if isinstance(value, tuple):
        for each in value:
            yield from _numbers_of(each)
    elif hasattr(value, "shape"):
        there = getattr(value, "__cuda_array_interface__", None)
        at = there["data"][0] if there else value.ctypes.data
        yield from (0, 0, value.size, value.dtype.itemsize, at)
        yield from (*value.shape, *value.strides)
    else:
        yield value
