"""Columns of numbers made rows, for kernels: as the processor shuffles them, four by four."""

from collections.abc import Callable
from typing import Any

from llvmlite import ir
from numba import types
from numba.extending import intrinsic
from numpy.typing import NDArray

from uas_coverage_env.compiled.internals import parts_of
from uas_coverage_env.compiled.kernels import COMPILED

_FOUR = 4
_FLOAT, _INDEX = ir.FloatType(), ir.IntType(64)
_FLOATS = ir.VectorType(_FLOAT, _FOUR)


def transposing(n: int, width: int, stride: int) -> Callable[[Any, Any], None]:
    """A function for kernels, (columns, rows): rows[width * k + c] = columns[stride * c + k].

    From a loop the compiler makes one move a number, or scattered ones that take even longer.

    Args:
        n: Number of rows; a multiple of four.
        width: Number of columns, likewise.
        stride: From one column to the next; at least n.

    Returns:
        A function of two float32 arrays of one axis, C-contiguous, of at least width * stride and
        n * width numbers.

    Raises:
        ValueError: A number is no multiple of four.
    """
    if n % _FOUR or width % _FOUR:
        raise ValueError(f"{n} rows of {width} numbers; give multiples of {_FOUR}")

    def plain(columns: NDArray[Any], rows: NDArray[Any]) -> None:
        of_columns = columns[: width * stride].reshape(width, stride)
        rows[: n * width].reshape(n, width)[...] = of_columns[:, :n].T

    def typed(typing_context, columns, rows):
        def generate(context, builder, signature, arguments):
            given, written = (
                parts_of(context, builder, kind, array).data
                for kind, array in zip((columns, rows), arguments, strict=True)
            )
            for k in range(0, n, _FOUR):
                for c in range(0, width, _FOUR):
                    fours = [
                        builder.load(_four_at(builder, given, stride * (c + j) + k), align=4)
                        for j in range(_FOUR)
                    ]
                    for j, four in enumerate(_across(builder, *fours)):
                        place = _four_at(builder, written, width * (k + j) + c)
                        builder.store(four, place, align=4)
            return context.get_dummy_value()

        return types.none(columns, rows), generate

    made: Any = intrinsic(typed) if COMPILED else plain
    return made


def _four_at(builder: Any, begin: Any, at: int) -> Any:
    return builder.bitcast(builder.gep(begin, [_INDEX(at)]), _FLOATS.as_pointer())


def _across(builder: Any, first: Any, second: Any, third: Any, fourth: Any) -> list[Any]:
    """Four vectors of the first, second, third and fourth numbers of four vectors."""

    def mixed(one: Any, other: Any, *which: int) -> Any:
        return builder.shuffle_vector(one, other, ir.VectorType(ir.IntType(32), _FOUR)(which))

    across = []
    for pair in ((0, 4, 1, 5), (2, 6, 3, 7)):
        one, other = mixed(first, second, *pair), mixed(third, fourth, *pair)
        across += [mixed(one, other, 0, 1, 4, 5), mixed(one, other, 2, 3, 6, 7)]
    return across
