"""Kernels that are called at their address: compiled by themselves, and only if they are needed.

Numba puts the machine code of what a kernel calls into that kernel, and optimises it again in each
kernel above. What is large, or not known when a step is compiled (a sensor that a user brings), is
not part of a step: the step is given addresses and calls what lies there.
"""

import inspect
from collections.abc import Callable
from functools import cache
from typing import Any

from numba import types
from numba.core import errors
from numba.extending import intrinsic

from uas_coverage_env.compiled.internals import address_of, call_at
from uas_coverage_env.compiled.kernels import COMPILED
from uas_coverage_env.plugins.users_code import described, place_of_function


class Signature:
    """What all kernels that are called at one place take and return.

    Args:
        names: Of the arguments, separated by blanks.
        arguments: A function that returns their types.
        result: Type of what they return.

    Attributes:
        call: In a kernel, `call(address, *arguments)`; to be bound to a name of the module first.
    """

    def __init__(
        self,
        names: str,
        arguments: Callable[[], tuple[types.Type, ...]],
        result: types.Type = types.none,
    ) -> None:
        self._names = names.split()
        self._arguments = arguments
        self._result = result
        self.call: Any = _made(self._names, arguments, result) if COMPILED else _call_plain

    def address_of(self, kernel: Any, **constants: int) -> int:
        """Compile a kernel, or load it from the cache, and say where it lies.

        Args:
            kernel: Takes what is named.
            **constants: Whole numbers among the arguments for whose values alone it is compiled;
                they are handed over all the same.

        Returns:
            Its address, for one process: it must not be kept in what travels to another. With
            NUMBA_DISABLE_JIT=1, a number that stands for it.

        Raises:
            ValueError: It cannot be compiled for these arguments, or returns something else.
        """
        if not COMPILED:
            return _kept(kernel)
        arguments = tuple(
            types.literal(constants[name]) if name in constants else kind
            for name, kind in zip(self._names, self._arguments(), strict=True)
        )
        return _address_of(kernel, arguments, self._result)


_PLAIN: list[Callable[..., Any]] = []


@cache
def _kept(function: Callable[..., Any]) -> int:
    _PLAIN.append(function)
    return len(_PLAIN) - 1


def _call_plain(number: int, *arguments: Any) -> Any:
    return _PLAIN[number](*arguments)


@cache  # numba takes milliseconds to find it again
def _address_of(kernel: Any, arguments: tuple[types.Type, ...], result: types.Type) -> int:
    name = getattr(kernel, "__name__", repr(kernel))
    if not hasattr(kernel, "get_compile_result"):
        raise ValueError(
            f"{name} is no compiled function; decorate it with compiled.kernels.kernel"
        )
    try:
        code, returned = address_of(kernel, result(*arguments))
    except Exception as error:  # numba raises anything at what it cannot compile
        where = place_of_function(kernel.py_func)
        raise ValueError(f"{name} cannot be compiled: {described(error)}{where}") from error
    if returned != result:
        raise ValueError(f"{name} returns {returned}; it should return {result}")
    return code


def _made(
    names: list[str], arguments: Callable[[], tuple[types.Type, ...]], result: types.Type
) -> Any:
    def typed(typing_context, address, *given):
        given = tuple(types.unliteral(each) for each in given)
        expected = arguments()
        if given != expected:
            # at an address there is nothing that would notice
            raise errors.TypingError(f"a kernel here takes {expected}, not {given}")

        def generate(context, builder, signature, values):
            address, *handed_over = values
            value = call_at(context, builder, address, result, expected, handed_over)
            return context.get_dummy_value() if result == types.none else value

        return result(types.int64, *expected), generate

    # numba reads from the signature how many arguments there are
    typed.__signature__ = inspect.Signature(  # pyrefly: ignore[missing-attribute]
        [
            inspect.Parameter(name, inspect.Parameter.POSITIONAL_OR_KEYWORD)
            for name in ("typing_context", "address", *names)
        ]
    )
    return intrinsic(typed)
