"""What ends a command from outside: a scheduler or a container asks with SIGTERM."""

import os
import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType


@contextmanager
def terminated_as_by_hand() -> Iterator[None]:
    """In this process, SIGTERM does what Ctrl-C does: what was flown up to there is kept.

    Its child processes, which inherit the handler, end at once as before.
    """
    if threading.current_thread() is not threading.main_thread():  # no other may ask for signals
        yield
        return
    here = os.getpid()

    def stop(number: int, frame: FrameType | None) -> None:
        if os.getpid() == here:
            raise KeyboardInterrupt
        signal.signal(number, signal.SIG_DFL)
        os.kill(os.getpid(), number)

    before = signal.signal(signal.SIGTERM, stop)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, before)
