"""Views into arrays that own nothing, for kernels.

A slice in numba counts a reference to its array, up and down again, with an atomic instruction
each. Twenty slices in every step of every lane cost as much as the flight. These views count
nothing: whoever makes one keeps the array alive for as long, as the arguments of a kernel are.
They must not leave compiled code.
"""

import math
from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import lower_builtin, type_callable
from numba.np.arrayobj import make_array, populate_array
from numpy.typing import NDArray


def rows_view(array: NDArray, row: int, shape: tuple[int, ...]) -> Any:
    """The elements of a C-contiguous array from the beginning of a row on, in another shape.

    Args:
        array: Any number of axes.
        row: Index along its first axis.
        shape: Shape of the view; its elements have to lie in the array.
    """
    return array[row:].reshape(-1)[: math.prod(shape)].reshape(shape)


def slice_view(array: NDArray, first: int, n: int) -> Any:
    """Some elements of a C-contiguous array one after the other, however many axes it has.

    Args:
        array: Any number of axes.
        first: Index of the first element, counted through all axes.
        n: How many.
    """
    return array.reshape(-1)[first : first + n]


def view_of(builder, context, view_type, start, shape, itemsize):
    """An array that owns nothing, of the sizes `shape`, at a pointer."""
    strides = [itemsize]
    for size in reversed(shape[1:]):
        strides.insert(0, builder.mul(strides[0], size))
    view = make_array(view_type)(context, builder)
    populate_array(
        view,
        data=start,
        shape=shape,
        strides=strides,
        itemsize=itemsize,
        meminfo=None,
        parent=None,
    )
    return view._getvalue()


def _sizes(builder, context, shape, shape_type):
    return [
        context.cast(builder, size, size_type, types.intp)
        for size, size_type in zip(cgutils.unpack_tuple(builder, shape), shape_type, strict=True)
    ]


@type_callable(rows_view)
def _type_of_rows_view(context):
    def typer(array, row, shape):
        if not isinstance(array, types.Array) or array.layout != "C":
            return None
        return types.Array(
            array.dtype, len(shape), "C", readonly=not array.mutable, aligned=array.aligned
        )

    return typer


@lower_builtin(rows_view, types.Array, types.Integer, types.BaseTuple)
def _lower_rows_view(context, builder, signature, arguments):
    array_type, row_type, shape_type = signature.args
    whole = make_array(array_type)(context, builder, arguments[0])
    row_bytes = cgutils.unpack_tuple(builder, whole.strides)[0]
    first = builder.mul(context.cast(builder, arguments[1], row_type, types.intp), row_bytes)
    start = builder.gep(builder.bitcast(whole.data, ir.IntType(8).as_pointer()), [first])
    sizes = _sizes(builder, context, arguments[2], shape_type)
    start = builder.bitcast(start, whole.data.type)
    return view_of(builder, context, signature.return_type, start, sizes, whole.itemsize)


@type_callable(slice_view)
def _type_of_slice_view(context):
    def typer(array, first, n):
        if not isinstance(array, types.Array) or array.layout != "C":
            return None
        return types.Array(array.dtype, 1, "C", readonly=not array.mutable, aligned=array.aligned)

    return typer


@lower_builtin(slice_view, types.Array, types.Integer, types.Integer)
def _lower_slice_view(context, builder, signature, arguments):
    array_type, first_type, n_type = signature.args
    whole = make_array(array_type)(context, builder, arguments[0])
    first = context.cast(builder, arguments[1], first_type, types.intp)
    size = context.cast(builder, arguments[2], n_type, types.intp)
    start = builder.gep(whole.data, [first])
    return view_of(builder, context, signature.return_type, start, [size], whole.itemsize)
