"""The state of the world, and the part of it that a planner sees."""

from dataclasses import dataclass, field
from typing import Annotated, Any, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.compiled.kernels import inlined_kernel, rarely
from uas_coverage_env.compiled.memory import Memory, Values
from uas_coverage_env.vehicle import N_STATES, PSI, VEHICLE_DTYPE
from uas_coverage_env.world.disturbance import DISTURBANCE_MEMORY
from uas_coverage_env.world.events import (
    EVERY,
    N_BIASES,
    N_DELAYED,
    N_HEARD,
    NEVER,
    write_responds,
)

FLYING, LANDED, LOST, SWAPPING = range(4)
"""Status of a UAS. Landed and lost are final; one that swaps has landed, and may fly again with a
fresh battery pack (`world.packs`)."""

ABSENT = -1
"""Status of a UAS that a mission does not have, in arrays with room for more."""

WIND, SINK, CONSUMPTION, EXPECTED, EXPECTED_DOD = 0, 2, 3, 4, 7
"""Places in `WorldState.belief`: wind north and east [m/s], of which drag and every other steady
horizontal force are taken to come; change of the vertical speed in a step that the model does not
know [m/s]; consumption over that of the model, less 1 [-]; and what is expected at the next sample,
velocity north, east, down [m/s], and depth of discharge [-]."""

N_BELIEF = EXPECTED_DOD + 1

PACK_NUMBER, PACK_READY, PACK_COVERED, PACK_OUT = range(4)
"""Places in `WorldState.packs`: which of its packs a UAS flies with, from 0 on; the sample at which
it has the next one; whether it has covered anything with this one; and how many UAS were lost or
had landed for good at its take-off."""

N_PACK = PACK_OUT + 1

STATUS_NAMES = ("flying", "landed", "lost", "swapping")


class WorldState(NamedTuple):
    """Everything that changes from step to step; the arrays are written in place."""

    x: Annotated[NDArray[np.float64], "U", N_STATES]
    """The paper's states, in the order of `vehicle.layout`."""
    reference: Annotated[NDArray[np.float64], "U", 2]
    """[m/s] velocity that the inner loop tracks now, north and east."""
    belief: Annotated[NDArray[np.float64], "U", N_BELIEF]
    """What the inner loop believes of disturbances, see `WIND` and the names beside it. Zero where
    none is declared."""
    status: Annotated[NDArray[np.int64], "U", Values(ABSENT, SWAPPING)]
    """FLYING, LANDED, LOST or SWAPPING; ABSENT in a batch, where a mission has fewer UAS than
    others."""
    departed: Annotated[NDArray[np.bool_], "U"]
    """Has been farther from its start than the landing distance."""
    returning: Annotated[NDArray[np.bool_], "U"]
    """Return mode has it now."""
    filtered: Annotated[NDArray[np.bool_], "U"]
    """The safety filter replaced its last command."""
    uncovered: Annotated[NDArray[np.bool_], "W"]
    """Waypoint still to be covered."""
    step: Annotated[NDArray[np.int64], 1, Values(0, "samples")]
    """Number of the sample, 0 at the start."""
    disturbance_memory: Annotated[NDArray[np.float64], "U", "D", DISTURBANCE_MEMORY]
    """What each of the D disturbances keeps for each UAS."""
    disturbance_random: Annotated[NDArray[np.uint64], "U", "D", 1]
    """The states of the generators that they draw from."""
    event_step: Annotated[NDArray[np.int64], "E", Values(0, NEVER)]
    """The sample at which each of the E events happens."""
    event_uas: Annotated[NDArray[np.int64], "E", Values(EVERY, 2**31)]
    """Whom it happens to: the index of a UAS, or EVERY."""
    event_random: Annotated[NDArray[np.uint64], "E", 1]
    """The states of the generators that they draw from."""
    felt: Annotated[NDArray[np.float64], "S", N_STATES]
    """What the inner loop flies by instead of `x`: for all UAS, or for none where they are known as
    they are; likewise the next four."""
    sensed: Annotated[NDArray[np.float64], "S", N_STATES]
    """What the other parts of the autopilot fly by: the same with noise."""
    told: Annotated[NDArray[np.float64], "S", N_STATES]
    """What planners and learners are told of it: the same, later."""
    delayed: Annotated[NDArray[np.float64], "S", N_DELAYED, N_STATES]
    """The latest of `sensed`; that of sample k at k modulo their number."""
    bias: Annotated[NDArray[np.float64], "S", N_BIASES]
    """Errors that a mission draws, see `events.POSITION_BIAS` and the names beside it."""
    sensing_random: Annotated[NDArray[np.uint64], "S", 1]
    """The states of the generators that sensors draw from."""
    heard: Annotated[NDArray[np.float64], "S", N_HEARD]
    """The latest command that reached each UAS."""
    packs: Annotated[NDArray[np.int64], "B", N_PACK]
    """Of each UAS what is named beside `PACK_NUMBER`; of none where none swaps on its own."""
    true_vehicles: Annotated[NDArray[np.void], VEHICLE_DTYPE, "true vehicles"]
    """What each UAS flies, where disturbances make that another than is believed or its battery has
    further RC pairs, whose voltages are in it; else none."""
    due_step: Annotated[NDArray[np.int64], "repeats", Values(0, 2**40)]
    """The sample at which each waypoint that was covered is asked for again, 0 where it is not; of
    none where no waypoint is to be covered more than once."""

    def copy(self) -> Self:
        """The same state in arrays of its own."""
        return self._make(array.copy() for array in self)

    def as_told(self) -> Self:
        """The same arrays, `x` being what planners and learners are told."""
        return self._replace(x=self.told) if len(self.told) else self


STATE = Memory(WorldState)


@inlined_kernel
def as_felt(arena, state):
    """The state as the inner loop knows it: `x` is what it flies by."""
    if rarely(arena.sensing.shape[0] > 0):
        return _with_x(state, state.felt)
    return _with_x(state, state.x)


@inlined_kernel
def as_sensed(arena, state):
    """The state as return mode, guidance and safety filter know it: `x` is what is sensed."""
    if rarely(arena.sensing.shape[0] > 0):
        return _with_x(state, state.sensed)
    return _with_x(state, state.x)


@inlined_kernel
def as_told(arena, state):
    """The state as learners know it: `x` is what they are told."""
    if rarely(arena.sensing.shape[0] > 0):
        return _with_x(state, state.told)
    return _with_x(state, state.x)


@inlined_kernel
def _with_x(state, x):
    return WorldState(
        x, state.reference, state.belief, state.status, state.departed, state.returning,
        state.filtered, state.uncovered, state.step, state.disturbance_memory,
        state.disturbance_random, state.event_step, state.event_uas, state.event_random,
        state.felt, state.sensed, state.told, state.delayed, state.bias, state.sensing_random,
        state.heard, state.packs, state.true_vehicles, state.due_step,
    )  # fmt: skip


def responding(arena: Any, state: WorldState) -> NDArray[np.bool_]:
    """(U,) which UAS take commands in the coming step."""
    responds = np.ones(len(arena.uas), dtype=np.bool_)
    if len(arena.events):
        write_responds(arena, state, responds)
    return responds


@dataclass(frozen=True, slots=True)
class SwarmState:
    """What a planner sees at a sample. The future of moving obstacles is not part of it.

    Attributes:
        time_s: [s] since the start.
        step: Number of the sample.
        names: (U,) names of the UAS.
        x: (U, 14) states as they are sensed, in the order of `vehicle.layout`. A UAS that looks
            where it flies has heading and yaw rate 0 here: its autopilot turns it, and nothing that
            a planner decides depends on that.
        reference_mps: (U, 2) [m/s] velocities that the inner loops track, north and east.
        status: (U,) FLYING, LANDED or LOST; one that swaps packs has landed.
        departed: (U,) has been farther from its start than the landing distance.
        returning: (U,) return mode has it now: commands are replaced by the way home.
        uncovered: (W,) waypoint still to be covered.
        home_m: (U, 3) [m] the starts.
        moving_position_m: (M, 3) [m] centres of moving obstacles, now.
        moving_velocity_mps: (M, 3) [m/s] their velocities, now.
        responds: (U,) takes commands now; not without its radio, nor before a late start.
        turned_rad: (U,) [rad] how far those have turned that look where they fly, 0 for the others;
            empty where none does.
        packs_left: (U,) fresh packs that each UAS may still swap for in this flight; empty where
            none swaps (`[sorties]` with `together = false`). 0 of one that waits because its last
            sortie has covered nothing.
        ground_s: (U,) [s] until a UAS that swaps is ready to take off, 0 for the others; likewise.
        again_s: (W,) [s] until each waypoint is asked for again, inf where it is not, or was; empty
            where none is (`again_after_s`).
        filtered: (U,) the safety filter replaced its last command: it is elsewhere than that would
            have taken it, which no disturbance did; empty where it is not told.
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
    responds: NDArray[np.bool_]
    turned_rad: NDArray[np.float64] = field(default_factory=lambda: np.zeros(0))
    packs_left: NDArray[np.int64] = field(default_factory=lambda: np.zeros(0, np.int64))
    ground_s: NDArray[np.float64] = field(default_factory=lambda: np.zeros(0))
    again_s: NDArray[np.float64] = field(default_factory=lambda: np.zeros(0))
    filtered: NDArray[np.bool_] = field(default_factory=lambda: np.zeros(0, np.bool_))

    @property
    def heading_rad(self) -> NDArray[np.float64]:
        """(U,) where they look, clockwise from north [rad], beyond a half turn too."""
        return self.x[:, PSI] + self.turned_rad if len(self.turned_rad) else self.x[:, PSI].copy()

    @property
    def active(self) -> tuple[str, ...]:
        """Names of the UAS that fly and need a command."""
        return tuple(
            name for name, status in zip(self.names, self.status, strict=True) if status == FLYING
        )
