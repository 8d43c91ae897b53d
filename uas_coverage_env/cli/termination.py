"""What ends a command from outside: Ctrl-C, a scheduler by SIGTERM, a lost terminal by SIGHUP."""

import os
import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType


@contextmanager
def terminated_as_by_hand() -> Iterator[Callable[[], bool]]:
    """In this process, SIGTERM and SIGHUP do what Ctrl-C does: what was flown so far is kept.

    SIGHUP comes where a connection to a remote machine breaks; where it is ignored (`nohup`), it
    still is. Its child processes, which inherit the handler, end at once as before.

    Yields:
        Whether one of them has come.
    """
    came: list[int] = []
    if threading.current_thread() is not threading.main_thread():  # no other may ask for signals
        yield lambda: False
        return
    here = os.getpid()

    def stop(number: int, frame: FrameType | None) -> None:
        if os.getpid() == here:
            came.append(number)
            raise KeyboardInterrupt
        signal.signal(number, before[number])
        os.kill(os.getpid(), number)

    endings: list[int] = [signal.SIGTERM]
    if hasattr(signal, "SIGHUP") and signal.getsignal(signal.SIGHUP) is not signal.SIG_IGN:
        endings.append(signal.SIGHUP)  # Windows has none
    numbers = list(endings)
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
        numbers.append(signal.SIGINT)
    before = {number: signal.getsignal(number) for number in numbers}
    before |= dict.fromkeys(endings, signal.SIG_DFL)
    outside = {number: signal.signal(number, stop) for number in numbers}
    try:
        yield lambda: bool(came)
    finally:
        for number, handler in outside.items():
            signal.signal(number, handler)
