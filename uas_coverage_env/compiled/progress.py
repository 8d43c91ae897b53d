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

from numba.core import event

from uas_coverage_env.compiled.internals import KernelDispatcher, MachineCode
from uas_coverage_env.compiled.purpose import purpose

NOTICE = "compiling for {purpose}: up to a minute, and kept on disk for later runs ..."

PATIENCE_S = 1.0
"""A process that compiles no longer than this says nothing."""

_LEFT_BY_A_KERNEL = 0.98
"""Share of what is left to do that is left after one more kernel: a step has some hundred."""

Listener = Callable[[float | None], object]
"""Called with the share of a compilation that is done, in [0, 1], and with None at its end."""

_logger = logging.getLogger("uas_coverage_env")


def _say_once(share: float | None) -> None:
    """Says it once for each purpose, and not where a bar has shown it before."""
    if purpose() in COMPILATIONS.told or _logger.level > logging.INFO:
        return
    notice = NOTICE.format(purpose=purpose())
    if _logger.isEnabledFor(logging.INFO) and _logger.hasHandlers():
        _logger.info(notice)
    else:
        print(f"uas_coverage_env: {notice}", file=sys.stderr, flush=True)


class Compilations(event.Listener):
    """What a process compiles, as numba tells: kernels, and the kernels that they call.

    How many there are is not known before; a share says that it goes on.

    Attributes:
        listener: Told once the process has spent more than PATIENCE_S.
        told: The purposes that a listener was told of.
        n_compiled: Kernels compiled so far, each of its parts counted.
        n_made: Those of them that are ready, since the listener began to listen.
        spent_s: Time spent on that [s].
        processor_s: Processor time spent on that [s].
    """

    def __init__(self) -> None:
        self.listener: Listener = _say_once
        self.told: set[str] = set()
        self.n_compiled = 0
        self.spent_s = self._since_s = 0.0
        self.processor_s = self._busy_since_s = 0.0
        self._depth = self.n_made = 0

    def on_start(self, event: Any) -> None:
        """A kernel that is not on the disk is compiled."""
        if isinstance(event.data["dispatcher"], KernelDispatcher | MachineCode):
            self.n_compiled += 1
            self._depth += 1
            if self._depth == 1:
                self._since_s = time.perf_counter()
                self._busy_since_s = time.process_time()
            self._tell()

    def on_end(self, event: Any) -> None:
        """It is there, or cannot be compiled."""
        if isinstance(event.data["dispatcher"], KernelDispatcher | MachineCode):
            self._depth -= 1
            self.n_made += 1
            self._tell()
            if self._depth == 0:
                self.spent_s += time.perf_counter() - self._since_s
                self.processor_s += time.process_time() - self._busy_since_s

    def _tell(self) -> None:
        if self.spent_s + time.perf_counter() - self._since_s > PATIENCE_S:
            self.listener(1.0 - _LEFT_BY_A_KERNEL**self.n_made if self._depth else None)
            self.told.add(purpose())


COMPILATIONS = Compilations()
event.register("numba:compile", COMPILATIONS)


@contextmanager
def listening(listener: Listener) -> Iterator[None]:
    """Have compilations told to another listener for a while."""
    before, COMPILATIONS.listener, COMPILATIONS.n_made = COMPILATIONS.listener, listener, 0
    try:
        yield
    finally:
        COMPILATIONS.listener = before
