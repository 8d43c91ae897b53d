"""What only a flight from a log has: what is estimated, what is not known, where it covered."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

STATES = 6
"""Position and velocity."""


@dataclass(frozen=True)
class Estimate:
    """Something of a UAS that was not measured.

    Attributes:
        uas: Which UAS.
        what: `charge`, `current`, `voltage`, `height`, `position`, `attitude` or `flight`.
        how: It was estimated, in words that follow `estimated`.
    """

    uas: str
    what: str
    how: str

    def __str__(self) -> str:
        """As a line for people."""
        return f"{self.uas}: {self.what} estimated {self.how}"


@dataclass(frozen=True)
class Unknown:
    """A time in which it is not known where a UAS was; nothing is judged of it then.

    Attributes:
        uas: Which UAS.
        from_s: The last time before at which it is known [s].
        to_s: The first time after [s].
        why: In words.
    """

    uas: str
    from_s: float
    to_s: float
    why: str


@dataclass(frozen=True)
class Pass:
    """A measured state at which a UAS covered a waypoint, between two samples as a rule.

    Attributes:
        time_s: When [s].
        uas: Which UAS.
        x: Position [m] and velocity [m/s], NED.
    """

    time_s: float
    uas: str
    x: tuple[float, ...]


@dataclass(frozen=True)
class OfLog:
    """See the module.

    Attributes:
        estimates: In order of the UAS.
        unknown: Likewise.
        passes: In order of time: all that covered something, and the starts.
    """

    estimates: tuple[Estimate, ...] = ()
    unknown: tuple[Unknown, ...] = ()
    passes: tuple[Pass, ...] = ()

    def known(self, time_s: NDArray[np.float64], names: Sequence[str]) -> NDArray[np.bool_]:
        """(T, U) whether it is known where each UAS was at some times (T,)."""
        known = np.ones((len(time_s), len(names)), np.bool_)
        for one in self.unknown:
            inside = (one.from_s < time_s) & (time_s < one.to_s)
            known[inside, names.index(one.uas)] = False
        return known

    def passing(
        self, names: Sequence[str], n_states: int, dt_s: float
    ) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
        """(P, U, n_states) states of the passes, NaN of all others, and (P,) in which sample."""
        x = np.full((len(self.passes), len(names), n_states), np.nan)
        for row, one in zip(x, self.passes, strict=True):
            row[names.index(one.uas), :STATES] = one.x
        samples = [math.ceil(one.time_s / dt_s - 1e-6) for one in self.passes]
        return x, np.array(samples, np.int64)
