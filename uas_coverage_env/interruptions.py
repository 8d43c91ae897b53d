"""Ctrl-C, SIGTERM and SIGHUP: while the program is imported, in a command, and in a flight.

An exception that a signal raises comes anywhere: in the middle of an import, between two lists of a
record, or inside a library, which may swallow it, turn it into another error, or crash. So none is
raised while the program is imported, and in a flight only the second signal raises one.
"""

import os
import signal
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType
from typing import Any

PROGRAM = "uas-coverage"
STOPPED = 128 + signal.SIGINT
"""What shells say of a program that Ctrl-C has ended; of another signal, 128 and its number."""

_ENDINGS = tuple(
    getattr(signal, name) for name in ("SIGTERM", "SIGHUP") if hasattr(signal, name)
)  # Windows has one of them

_came: list[int] = []
"""The signals that came while the command of this process ran, the first one first."""


@contextmanager
def ctrl_c_ends_the_program() -> Iterator[None]:
    """In the program, and in no other, Ctrl-C ends the process at once and without a word."""
    if not _is_running() or signal.getsignal(signal.SIGINT) is not signal.default_int_handler:
        yield
        return
    signal.signal(signal.SIGINT, lambda number, frame: os._exit(STOPPED))
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, signal.default_int_handler)


def _is_running() -> bool:
    """Whether this process is `uas-coverage` or `python -m uas_coverage_env`."""
    name = os.path.basename("".join(sys.argv[:1])).removesuffix(".exe")
    return name == PROGRAM or sys.orig_argv[1:3] == ["-m", "uas_coverage_env"]


@contextmanager
def signals_stop_a_command() -> Iterator[Callable[[], int]]:
    """In this process, SIGTERM and SIGHUP do what Ctrl-C does: what was flown so far is kept.

    SIGHUP comes where a connection to a remote machine breaks; where it is ignored (`nohup`), it
    still is. Child processes, which inherit the handler, end at once as before.

    Yields:
        The exit code that tells of the first signal; 0 while none has come.
    """
    _came.clear()
    if not _may_ask_for_signals():
        yield lambda: 0
        return
    here = os.getpid()
    endings = [one for one in _ENDINGS if signal.getsignal(one) is not signal.SIG_IGN]
    as_before: dict[int, Any] = dict.fromkeys(endings, signal.SIG_DFL)
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
        as_before[signal.SIGINT] = signal.default_int_handler

    def stop(number: int, frame: FrameType | None) -> None:
        if os.getpid() == here:
            _came.append(number)
            raise KeyboardInterrupt
        signal.signal(number, as_before[number])
        os.kill(os.getpid(), number)

    outside = {number: signal.signal(number, stop) for number in as_before}
    try:
        yield lambda: 128 + _came[0] if _came else 0
    finally:
        for number, handler in outside.items():
            signal.signal(number, handler)


@contextmanager
def signals_noted() -> Iterator[Callable[[], bool]]:
    """Note the first signal that would raise, and let the second one do so.

    Signals that end the process at once, or that nothing handles in Python, do as before; so do all
    outside of the main thread, which alone may ask for them.

    Yields:
        Whether one has come.
    """
    noted: list[int] = []
    before: dict[int, Any] = {}

    def note(number: int, frame: FrameType | None) -> None:
        if noted:
            before[number](number, frame)
        noted.append(number)
        _came.append(number)

    if _may_ask_for_signals():
        for number in (signal.SIGINT, *_ENDINGS):
            handler = signal.getsignal(number)
            if callable(handler):
                before[number] = handler
                signal.signal(number, note)
    try:
        yield lambda: bool(noted)
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def _may_ask_for_signals() -> bool:
    return threading.current_thread() is threading.main_thread()
