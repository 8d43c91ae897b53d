"""Ctrl-C between two steps of a flight, not in the middle of one.

An exception that a signal raises comes anywhere: between two lists of the record, or inside a
library, which may swallow it, turn it into another error, or crash.
"""

import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from uas_coverage_env.flight.flight import Flight

_ENDINGS = tuple(
    getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name)
)


@contextmanager
def interruptions_noted() -> Iterator[Callable[[], bool]]:
    """Note the first signal that would raise, and let the second one do so.

    Signals that end the process at once, or that nobody handles in Python, do as before; so do all
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

    if threading.current_thread() is threading.main_thread():
        for number in _ENDINGS:
            handler = signal.getsignal(number)
            if callable(handler):
                before[number] = handler
                signal.signal(number, note)
    try:
        yield lambda: bool(noted)
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def unless_stopped(flight: "Flight") -> "Flight":
    """The same flight, if it came to its end: half a flight says nothing of its planner.

    Raises:
        KeyboardInterrupt: It was stopped by hand.
    """
    if flight.ended == "stopped":
        raise KeyboardInterrupt
    return flight
