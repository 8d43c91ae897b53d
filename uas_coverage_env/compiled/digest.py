"""What a kernel is made from: its code and constants, and those of all that it names.

Compiled code holds the code and the constants of other modules. Whether it is still true depends on
them, and on nothing else of these modules: neither comments nor docstrings make a kernel another
one.
"""

import hashlib
import sys
from abc import ABC, abstractmethod
from collections.abc import Iterator
from enum import Enum
from functools import cached_property, partial
from pathlib import Path
from types import CodeType, FunctionType, MethodType, ModuleType
from typing import Any
from weakref import WeakKeyDictionary

import numpy as np

_LIBRARIES = {"numba", "numpy", "llvmlite", *sys.stdlib_module_names}
"""Known by their versions."""

MACHINERY = hashlib.sha256(
    b"".join(path.read_bytes() for path in sorted(Path(__file__).parent.glob("*.py")))
).hexdigest()
"""Of this package, which decides how kernels are compiled."""

_HERE = " at 0x"
"""In the text of what only one process knows, by its address."""

_digests: WeakKeyDictionary[FunctionType, str] = WeakKeyDictionary()
"""Of functions that name nothing around them: those that do have another within others."""

_NOTHING = sys.maxsize
_outermost = _NOTHING
"""Place of the outermost value that was named from within it, in what is described now."""


class Described(ABC):
    """What says by itself what compiled code takes from it: its other attributes do not count."""

    @abstractmethod
    def described(self) -> str:
        """A text, the same in each process."""


def digest_of(kernel: Any) -> str | None:
    """What tells a kernel from any other, also from what it was before an edit.

    Args:
        kernel: What numba makes of a function.

    Returns:
        A text; None where it names what only this process knows.
    """
    text = _described(kernel, ())
    return None if _HERE in text else text


def _described(value: Any, within: tuple[Any, ...]) -> str:
    """A text of a value that is the same in each process; it lies within others, or is one."""
    for place, other in enumerate(within):
        if value is other:
            return _again(place, within)
    inside = (*within, value)
    kind = type(value)
    if isinstance(value, FunctionType):
        return _function(value, within)
    if isinstance(value, Described):
        return f"{kind.__qualname__} {value.described()}"
    if isinstance(value, ModuleType):
        return f"module {value.__name__}"
    if isinstance(value, type):
        members = [*value] if issubclass(value, Enum) else getattr(value, "_fields", "")
        return f"class {value.__module__}.{value.__qualname__} {members}"
    if isinstance(value, np.ndarray):
        return f"array {value.dtype} {value.shape} {hashlib.sha256(value.tobytes()).hexdigest()}"
    if isinstance(value, tuple | list):
        return f"{kind.__qualname__} {[_described(each, inside) for each in value]}"
    if isinstance(value, set | frozenset):
        return f"{kind.__qualname__} {sorted(_described(each, inside) for each in value)}"
    if isinstance(value, dict):
        return f"dict {[(repr(key), _described(each, inside)) for key, each in value.items()]}"
    if isinstance(value, MethodType):
        return f"{_described(value.__self__, inside)} {_described(value.__func__, inside)}"
    if isinstance(value, partial):
        return f"partial {_described((value.func, value.args, value.keywords), inside)}"
    if hasattr(value, "py_func"):  # of a kernel, how it is compiled counts as well
        options = _described(sorted(value.targetoptions.items()), inside)
        return f"kernel {options} {_described(value.py_func, inside)}"
    if hasattr(value, "__wrapped__"):  # an intrinsic of numba's, a cached function
        return f"{kind.__qualname__} {_described(value.__wrapped__, inside)}"
    if _of_a_library(kind) or not hasattr(value, "__dict__"):
        return f"{kind.__qualname__} {value!r}"
    # what it has computed since says nothing new
    said = {
        name: each
        for name, each in vars(value).items()
        if not isinstance(getattr(kind, name, None), cached_property)
    }
    return f"{kind.__qualname__} {_described(said, inside)}"


def _again(place: int, within: tuple[Any, ...]) -> str:
    """A value that lies within itself is told by how far out it begins."""
    global _outermost
    _outermost = min(_outermost, place)
    return f"again {len(within) - place}"


def _of_a_library(value: Any) -> bool:
    return str(value.__module__).partition(".")[0] in _LIBRARIES


def _function(function: FunctionType, within: tuple[Any, ...]) -> str:
    if _of_a_library(function):
        return f"function {function.__module__}.{function.__qualname__}"
    digest = _digests.get(function)
    if digest is None:
        global _outermost
        before, _outermost = _outermost, _NOTHING
        text = "\n".join(_lines(function, (*within, function)))
        digest = _HERE if _HERE in text else hashlib.sha256(text.encode()).hexdigest()
        if _outermost >= len(within):
            _digests[function] = digest
        _outermost = min(_outermost, before)
    return f"function {function.__qualname__} {digest}"


def _lines(function: FunctionType, within: tuple[Any, ...]) -> Iterator[str]:
    names: set[str] = set()
    yield from _code(function.__code__, names, function.__doc__)
    yield _described((function.__defaults__, function.__kwdefaults__), within)
    for cell in function.__closure__ or ():
        yield _described(cell.cell_contents, within)
    yield from _named(function.__globals__, names, within)


def _code(code: CodeType, names: set[str], docstring: str | None = None) -> Iterator[str]:
    """Lines of a code; the names that it uses, attributes among them, are added to `names`."""
    names |= set(code.co_names)
    yield f"{code.co_code.hex()} {code.co_names} {code.co_varnames} {code.co_freevars}"
    for k, constant in enumerate(code.co_consts):
        if isinstance(constant, CodeType):
            yield from _code(constant, names)
        elif k > 0 or constant != docstring:
            yield _described(constant, ())


def _named(there: dict[str, Any], names: set[str], within: tuple[Any, ...]) -> Iterator[str]:
    """Lines of those values of a module that are named."""
    for name in sorted(names & there.keys()):
        value = there[name]
        yield f"{name} {_described(value, within)}"
        if not isinstance(value, ModuleType) or value.__name__.partition(".")[0] in _LIBRARIES:
            continue
        place = next((k for k, other in enumerate(within) if other is value), None)
        if place is None:
            yield from _named(vars(value), names, (*within, value))
        else:
            yield _again(place, within)
