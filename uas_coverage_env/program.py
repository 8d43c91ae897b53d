"""The program `uas-coverage`, and Ctrl-C in the third of a second in which it is imported."""

import os
import signal
import sys
from collections.abc import Iterator
from contextlib import contextmanager

_NAME = "uas-coverage"
_STOPPED = 130  # what shells say of a program that Ctrl-C has ended


def main() -> int:
    """Import the command line and run it; returns the exit code."""
    try:
        with ctrl_c_ends_the_program():
            from uas_coverage_env.cli import main as run
        return run()
    except KeyboardInterrupt:  # just before a command is ready for it
        return _STOPPED


@contextmanager
def ctrl_c_ends_the_program() -> Iterator[None]:
    """In the program, and in no other, Ctrl-C ends the process at once and without a word.

    An exception in the middle of an import may be swallowed, or come out as another one.
    """
    if not _is_running() or signal.getsignal(signal.SIGINT) is not signal.default_int_handler:
        yield
        return
    signal.signal(signal.SIGINT, lambda number, frame: os._exit(_STOPPED))
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, signal.default_int_handler)


def _is_running() -> bool:
    """Whether this process is `uas-coverage` or `python -m uas_coverage_env`."""
    name = os.path.basename("".join(sys.argv[:1])).removesuffix(".exe")
    return name == _NAME or sys.orig_argv[1:3] == ["-m", "uas_coverage_env"]
