"""The program `uas-coverage`: its first third of a second, in which it is imported.

It stands beside the packages, since to import any of them takes most of that time.
"""

import os
import signal
from types import FrameType

_STOPPED = 130  # what shells say of a program that Ctrl-C has ended


def main() -> int:
    """Import the command line and run it; returns the exit code.

    Until it is imported Ctrl-C ends the process at once: an exception in the middle of an import
    may be swallowed, or come out as another one.
    """
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
        signal.signal(signal.SIGINT, _end)
    from uas_coverage_env.cli import main as run

    try:
        if signal.getsignal(signal.SIGINT) is _end:
            signal.signal(signal.SIGINT, signal.default_int_handler)
        return run()
    except KeyboardInterrupt:  # just before a command is ready for it
        return _STOPPED


def _end(number: int, frame: FrameType | None) -> None:
    os._exit(_STOPPED)
