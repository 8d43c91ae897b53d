"""Time for whoever streams: that of the machine, or one that a simulation drives."""

import time
from typing import Protocol


class Clock(Protocol):
    """What tells the time and waits."""

    def now_s(self) -> float:
        """Time since some moment [s]."""
        ...

    def wait(self, seconds: float) -> None:
        """Return after a time [s]."""
        ...


class RealClock:
    """The machine's clock."""

    def now_s(self) -> float:
        """Time since some moment [s]."""
        return time.monotonic()

    def wait(self, seconds: float) -> None:
        """Return after a time [s]."""
        time.sleep(seconds)
