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
from numba.extending import intrinsic, overload
from numba.np.arrayobj import make_array, populate_array
from numpy.typing import NDArray


def borrow(array: NDArray, row: int, shape: tuple[int, ...]) -> Any:
    """The elements of a C-contiguous array from the beginning of a row on, in another shape.

    Args:
        array: Any number of axes.
        row: Index along its first axis.
        shape: Shape of the view; its elements have to lie in the array.
    """
    return array[row:].reshape(-1)[: math.prod(shape)].reshape(shape)


@intrinsic
def _borrow(typing_context, array, row, shape):
    view = types.Array(
        array.dtype, len(shape), "C", readonly=not array.mutable, aligned=array.aligned
    )

    def generate(context, builder, signature, arguments):
        array_type, row_type, shape_type = signature.args
        whole = make_array(array_type)(context, builder, arguments[0])
        row_bytes = cgutils.unpack_tuple(builder, whole.strides)[0]
        first = builder.mul(context.cast(builder, arguments[1], row_type, types.intp), row_bytes)
        start = builder.gep(builder.bitcast(whole.data, ir.IntType(8).as_pointer()), [first])
        sizes = [
            context.cast(builder, size, size_type, types.intp)
            for size, size_type in zip(
                cgutils.unpack_tuple(builder, arguments[2]), shape_type, strict=True
            )
        ]
        strides = [whole.itemsize]
        for size in reversed(sizes[1:]):
            strides.insert(0, builder.mul(strides[0], size))
        part = make_array(signature.return_type)(context, builder)
        populate_array(
            part,
            data=builder.bitcast(start, whole.data.type),
            shape=sizes,
            strides=strides,
            itemsize=whole.itemsize,
            meminfo=None,
            parent=None,
        )
        return part._getvalue()

    return view(array, row, shape), generate


@overload(borrow)
def _compiled_borrow(array, row, shape):
    if isinstance(array, types.Array) and array.layout == "C":
        # the typing context is numba's own argument
        return lambda array, row, shape: _borrow(array, row, shape)  # pyright: ignore
    return None
