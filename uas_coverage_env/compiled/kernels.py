"""How the kernels of a step are compiled: without counting references, and so without allocating.

Numba counts a reference for every array that a kernel takes out of a named tuple or slices, with
an atomic instruction; in one step of two UAS that is as much work as the flight. The arrays of a
step outlive it, so nothing has to be counted. The price is that such a kernel cannot make arrays:
what it needs for a while lies on the stack (`stack_array`). The same source compiles for a GPU.

Whatever is compiled with these decorators is kept on disk by the contents of its sources
(`internals.py`).
"""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from llvmlite import ir
from numba import config, typeof, types
from numba.extending import intrinsic
from numpy.typing import NDArray

from uas_coverage_env.compiled import progress  # noqa: F401  that is told of each compilation
from uas_coverage_env.compiled.internals import KernelDispatcher, array_at, parts_of

COMPILED = not config.DISABLE_JIT  # pyrefly: ignore[missing-attribute]
"""Whether kernels are compiled; with NUMBA_DISABLE_JIT=1 they run as Python."""


def _decorator(**options: Any) -> Any:
    """A decorator that compiles with some options; called with more options, it makes another."""

    def decorate(function: Any = None, /, **more: Any) -> Any:
        if function is None:
            return _decorator(**options, **more)
        if not COMPILED:
            return function
        return KernelDispatcher(function, targetoptions={"nopython": True, **options})

    return decorate


kernel = _decorator(error_model="numpy", _nrt=False)
"""Compiles a function that makes no arrays and returns none."""

inlined_kernel = _decorator(error_model="numpy", _nrt=False, forceinline=True)
"""A `kernel` that becomes part of its callers. For parts of a step that take whole named tuples:
to hand over their hundred machine words takes longer than most of these parts themselves. Numba
hands this on: a `kernel` that is compiled first because such a part calls it is inlined, too."""

rare_kernel = _decorator(error_model="numpy", _nrt=False, forceinline=False)
"""A `kernel` that stays a call, though its callers are inlined. For what few steps need: its
machine code would lie between that of every step, which then fits into no cache."""

counting_kernel = _decorator(
    error_model="numpy", _nrt=False, forceinline=True, fastmath={"reassoc", "nsz"}
)
"""An `inlined_kernel` that adds floats in any order, several at a time. Only for whole numbers
below 2⁵³, which have one sum in every order: two compilations of a step must agree to the bit."""

allocating_kernel = _decorator(error_model="numpy", _nrt=True)
"""Compiles a function that makes arrays; also what it calls, unless that is a `kernel`. Takes
numba's other options: `@allocating_kernel(parallel=True)`."""


def in_turn(kernels: Sequence[Any], arguments: str) -> Any:
    """A kernel that calls others, one after the other, each with all of its arguments.

    Args:
        kernels: These; numba has no loop for them.
        arguments: Names, as in the head of a function.
    """
    known = {f"kernel_{k}": each for k, each in enumerate(kernels)}
    calls = "; ".join(f"{name}({arguments})" for name in known)
    exec(f"def run({arguments}):\n    {calls or 'pass'}", known)  # made of names alone
    return inlined_kernel(known["run"])


_LINE = 64
"""Bytes of a line of the cache."""


def machine_code(function: Any, arguments: Sequence[Any]) -> Callable[..., Any]:
    """A kernel compiled for arguments of these types, which the caller has to keep to.

    Called directly it spares numba's look at the type of each argument, a third of a short step.
    """
    if not COMPILED:
        return function
    return function.for_python.compile(tuple(map(typeof, arguments)))


def interpreted(kernel: Any) -> Callable[..., Any]:
    """The Python function of a kernel: for the few calls that are not worth compiling.

    It reads its first argument by name, so that any object with those attributes will do, but the
    kernels that it calls are compiled.
    """
    return getattr(kernel, "py_func", kernel)


def stack_array(size: int) -> NDArray[np.float64]:
    """An array for the time of one call, in a kernel on the stack.

    Args:
        size: How many numbers; a constant.

    Returns:
        (size,) not initialised.
    """
    return np.empty(size)


def stack_array_f32(size: int) -> NDArray[np.float32]:
    """`stack_array` for single precision."""
    return np.empty(size, np.float32)


def stack_array_i64(size: int) -> NDArray[np.int64]:
    """`stack_array` for whole numbers."""
    return np.empty(size, np.int64)


def _on_the_stack(number: types.Number, element: ir.Type) -> Any:
    def make(typing_context, size):
        if not isinstance(size, types.IntegerLiteral):
            return None

        def generate(context, builder, signature, arguments):
            with builder.goto_entry_block():
                place = builder.alloca(ir.ArrayType(element, size.literal_value))
            pointer = builder.bitcast(place, context.get_value_type(types.voidptr))
            shape = context.get_value_type(types.UniTuple(types.intp, 1))([size.literal_value])
            return array_at(context, builder, signature.return_type, pointer, shape)

        return types.Array(number, 1, "C")(size), generate

    return intrinsic(prefer_literal=True)(make)


def lowest_bit(bits: int) -> int:
    """The place of the lowest bit that is set, counted from 0; in a kernel one instruction.

    Args:
        bits: Above 0.
    """
    return (int(bits) & -int(bits)).bit_length() - 1


@intrinsic
def _trailing_zeros(typing_context, bits):
    def generate(context, builder, signature, arguments):
        return builder.cttz(arguments[0], ir.Constant(ir.IntType(1), 1))

    return types.int64(types.int64), generate


def rarely(condition: bool) -> bool:
    """The same condition, known to be false nearly always.

    What follows is put behind the rest of the kernel, and what it calls stays a call: machine code
    that is passed over at each step would be fetched with what lies beside it.

    Args:
        condition: Of an `if`.
    """
    return condition


@intrinsic
def _expected_false(typing_context, condition):
    def generate(context, builder, signature, arguments):
        (given,), bit = arguments, ir.IntType(1)
        given = builder.icmp_unsigned("!=", given, given.type(0))
        kind = ir.FunctionType(bit, [bit, bit])
        return builder.call(
            builder.module.declare_intrinsic("llvm.expect", [bit], kind), [given, bit(0)]
        )

    return types.boolean(condition), generate


def prefetch(array: NDArray[Any]) -> None:
    """Bring an array into the processor's cache while the kernel goes on.

    For what is read or written later than other data of the same mission, and apart from it.

    Args:
        array: C-contiguous.
    """


def _prefetched(array):
    for at in range(0, array.size * array.itemsize, _LINE):
        _prefetch_line(array, at)


def _line_fetched(typing_context, array, at):
    """Fetch the line `at` bytes (int64) behind the beginning of an array."""

    def generate(context, builder, signature, arguments):
        flag, pointer = ir.IntType(32), context.get_value_type(types.voidptr)
        begin = parts_of(context, builder, array, arguments[0]).data
        kind = ir.FunctionType(ir.VoidType(), [pointer, flag, flag, flag])
        fetch = builder.module.declare_intrinsic("llvm.prefetch", [pointer], kind)
        place = builder.gep(builder.bitcast(begin, pointer), [arguments[1]])
        # to be written, kept in all caches, data
        builder.call(fetch, [place, flag(1), flag(3), flag(1)])
        return context.get_dummy_value()

    return types.none(array, types.int64), generate


_prefetch_line: Any = intrinsic(_line_fetched)

if COMPILED:
    made: Any = (_trailing_zeros, _expected_false, inlined_kernel(_prefetched))
    lowest_bit, rarely, prefetch = made
    stack_array = _on_the_stack(types.float64, ir.DoubleType())
    stack_array_f32 = _on_the_stack(types.float32, ir.FloatType())
    stack_array_i64 = _on_the_stack(types.int64, ir.IntType(64))
