"""Tells that kernels are being compiled, for what, and how far that is: a user waits for it.

Where logging is set up, it is an INFO record of the logger `uas_coverage_env`, otherwise a
line on stderr; a level above INFO on that logger silences both. `listening` takes their place.
"""

import logging
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

NOTICE = "compiling for {purpose}: up to a minute, and kept on disk for later runs ..."

PATIENCE_S = 1.0
"""A process that compiles no longer than this says nothing."""

_SHARE_OF_PARTS = 0.75
"""What the kernels of a step take; then their machine code is made, all at once."""

Listener = Callable[[float | None], object]
"""Called with the share of a compilation that is done, in [0, 1], and with None at its end."""

_logger = logging.getLogger("uas_coverage_env")


def _say_it_once() -> Listener:
    """Says it once for each purpose."""
    said: set[str] = set()

    def listener(share: float | None) -> None:
        purpose = COMPILATIONS.purpose
        if purpose in said or _logger.level > logging.INFO:
            return
        said.add(purpose)
        notice = NOTICE.format(purpose=purpose)
        if _logger.isEnabledFor(logging.INFO) and _logger.hasHandlers():
            _logger.info(notice)
        else:
            sys.stderr.write(f"uas_coverage_env: {notice}\n")
            sys.stderr.flush()

    return listener


class Compilations:
    """What a process compiles for Python, one kernel after the other.

    Attributes:
        listener: Told once the process has spent more than PATIENCE_S.
        purpose: What they are for, in words.
        n_compiled: Kernels compiled so far, each of its parts counted.
        spent_s: What that has taken [s].
    """

    def __init__(self) -> None:
        self.listener = _say_it_once()
        self.purpose = "this program"
        self.n_compiled = 0
        self.spent_s = 0.0
        self._since_s = 0.0
        self._depth = 0
        self._compiles = False
        self._made: set[Any] = set()
        self._count: Callable[[], int] = int
        self._n_parts = 0

    @contextmanager
    def one(self, count: Callable[[], int]) -> Iterator[None]:
        """A kernel is compiled, or read from the disk.

        Args:
            count: Says how many kernels it consists of.
        """
        self._depth += 1
        if self._depth == 1:
            self._count, self._compiles = count, False
            self._since_s = time.perf_counter()
            self._made.clear()
        try:
            yield
        finally:
            self._depth -= 1
            if self._depth == 0 and self._compiles:
                if self._patience_is_over():
                    self.listener(None)
                self.spent_s += time.perf_counter() - self._since_s

    def begun(self) -> None:
        """A kernel, or a part of it, is not on the disk."""
        self.n_compiled += 1
        if self._depth == 0:  # a function of numba's own calls a kernel
            return
        if not self._compiles:
            self._compiles = True
            self._n_parts = self._count()
        self._tell()

    def made(self, part: Any) -> None:
        """A kernel that another one calls is there."""
        self._made.add(part)
        if self._compiles:
            self._tell()

    def _tell(self) -> None:
        if self._patience_is_over():
            self.listener(_SHARE_OF_PARTS * min(len(self._made) / max(self._n_parts, 1), 1.0))

    def _patience_is_over(self) -> bool:
        return self.spent_s + time.perf_counter() - self._since_s > PATIENCE_S


COMPILATIONS = Compilations()


@contextmanager
def listening(listener: Listener) -> Iterator[None]:
    """Have compilations told to another listener for a while."""
    before, COMPILATIONS.listener = COMPILATIONS.listener, listener
    try:
        yield
    finally:
        COMPILATIONS.listener = before


@contextmanager
def compiling_for(purpose: str) -> Iterator[None]:
    """Say what is compiled for, for a while."""
    before, COMPILATIONS.purpose = COMPILATIONS.purpose, purpose
    try:
        yield
    finally:
        COMPILATIONS.purpose = before
