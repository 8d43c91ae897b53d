"""What is compiled for, in words: apart from what compiles, since numba is slow to import."""

from collections.abc import Iterator
from contextlib import contextmanager

_purposes = ["this program"]


def purpose() -> str:
    """What kernels are compiled for now."""
    return _purposes[-1]


@contextmanager
def compiling_for(what: str) -> Iterator[None]:
    """Say what is compiled for, for a while."""
    _purposes.append(what)
    try:
        yield
    finally:
        _purposes.pop()
