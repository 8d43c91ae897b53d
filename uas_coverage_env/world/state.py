"""The state of the world, and the part of it that a player sees."""

from dataclasses import dataclass
from typing import NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

FLYING, LANDED, LOST = range(3)
"""Status of a UAS. Landed and lost are final."""

STATUS_NAMES = ("flying", "landed", "lost")


class WorldState(NamedTuple):
    """Everything that changes from step to step; the arrays are written in place."""

    x: NDArray[np.float64]
    """(U, 14) the paper's states, in the order of `vehicle.layout`."""
    reference: NDArray[np.float64]
    """(U, 2) [m/s] velocity that the inner loop tracks now, north and east."""
    status: NDArray[np.int64]
    """(U,) FLYING, LANDED or LOST."""
    departed: NDArray[np.bool_]
    """(U,) has been farther from its start than the landing distance."""
    returning: NDArray[np.bool_]
    """(U,) return mode has taken over."""
    uncovered: NDArray[np.bool_]
    """(W,) waypoint still to be covered."""
    step: NDArray[np.int64]
    """(1,) number of the sample, 0 at the start."""

    def copy(self) -> Self:
        """The same state in arrays of its own."""
        return self._make(array.copy() for array in self)


@dataclass(frozen=True, slots=True)
class SwarmState:
    """What a player sees at a sample. The future of moving obstacles is not part of it.

    Attributes:
        time_s: [s] since the start.
        step: Number of the sample.
        names: (U,) names of the UAS.
        x: (U, 14) states, in the order of `vehicle.layout`.
        reference_mps: (U, 2) [m/s] velocities that the inner loops track, north and east.
        status: (U,) FLYING, LANDED or LOST.
        uncovered: (W,) waypoint still to be covered.
        home_m: (U, 3) [m] the starts.
        moving_position_m: (M, 3) [m] centres of moving obstacles, now.
        moving_velocity_mps: (M, 3) [m/s] their velocities, now.
    """

    time_s: float
    step: int
    names: tuple[str, ...]
    x: NDArray[np.float64]
    reference_mps: NDArray[np.float64]
    status: NDArray[np.int64]
    uncovered: NDArray[np.bool_]
    home_m: NDArray[np.float64]
    moving_position_m: NDArray[np.float64]
    moving_velocity_mps: NDArray[np.float64]

    @property
    def active(self) -> tuple[str, ...]:
        """Names of the UAS that fly and need a command."""
        return tuple(
            name for name, status in zip(self.names, self.status, strict=True) if status == FLYING
        )
