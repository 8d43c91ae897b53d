"""The state of the world, and the part of it that a player sees."""

from dataclasses import dataclass
from typing import Annotated, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.compiled.memory import Memory, Values
from uas_coverage_env.vehicle import N_STATES
from uas_coverage_env.world.disturbance import DISTURBANCE_MEMORY

FLYING, LANDED, LOST = range(3)
"""Status of a UAS. Landed and lost are final."""

ABSENT = -1
"""Status of a UAS that a mission does not have, in arrays with room for more."""

STATUS_NAMES = ("flying", "landed", "lost")


class WorldState(NamedTuple):
    """Everything that changes from step to step; the arrays are written in place."""

    x: Annotated[NDArray[np.float64], "U", N_STATES]
    """The paper's states, in the order of `vehicle.layout`."""
    reference: Annotated[NDArray[np.float64], "U", 2]
    """[m/s] velocity that the inner loop tracks now, north and east."""
    status: Annotated[NDArray[np.int64], "U", Values(ABSENT, LOST)]
    """FLYING, LANDED or LOST; ABSENT in a batch, where a mission has fewer UAS than others."""
    departed: Annotated[NDArray[np.bool_], "U"]
    """Has been farther from its start than the landing distance."""
    returning: Annotated[NDArray[np.bool_], "U"]
    """Return mode has taken over."""
    uncovered: Annotated[NDArray[np.bool_], "W"]
    """Waypoint still to be covered."""
    step: Annotated[NDArray[np.int64], 1, Values(0, "samples")]
    """Number of the sample, 0 at the start."""
    disturbance_memory: Annotated[NDArray[np.float64], "U", "D", DISTURBANCE_MEMORY]
    """What each of the D disturbances keeps for each UAS."""
    disturbance_random: Annotated[NDArray[np.uint64], "U", "D", 1]
    """The states of the generators that they draw from."""

    def copy(self) -> Self:
        """The same state in arrays of its own."""
        return self._make(array.copy() for array in self)


STATE = Memory(WorldState)


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
        departed: (U,) has been farther from its start than the landing distance.
        returning: (U,) return mode has taken over: commands are replaced by the way home.
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
    departed: NDArray[np.bool_]
    returning: NDArray[np.bool_]
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
