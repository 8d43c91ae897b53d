"""The state of the world, and the part of it that a planner sees."""

from dataclasses import dataclass, field
from typing import Annotated, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.compiled.kernels import inlined_kernel, rarely
from uas_coverage_env.compiled.memory import Memory, Values, record_dtype
from uas_coverage_env.compiled.views import replaced
from uas_coverage_env.entities.codes import UasStatus
from uas_coverage_env.vehicle.layout import N_STATES, PSI
from uas_coverage_env.vehicle.record import VEHICLE_DTYPE

ABSENT, FLYING, LANDED, LOST, SWAPPING = map(int, UasStatus)

STATUS_NAMES = tuple(status.name.lower() for status in UasStatus if status != ABSENT)

WIND, SINK, CONSUMPTION, EXPECTED, EXPECTED_DOD = 0, 2, 3, 4, 7
"""Places in the belief of a UAS: wind north and east [m/s], of which drag and every other steady
horizontal force are taken to come; change of the vertical speed in a step that the model does not
know [m/s]; consumption over that of the model, less 1 [-]; and what is expected at the next sample,
velocity north, east, down [m/s], and depth of discharge [-]."""

N_BELIEF = EXPECTED_DOD + 1

EVERY = -2
"""In place of the index of a UAS: all of them."""

NEVER = 2**62
"""The sample of what does not happen, and the steps of what does not end."""

UAS_STATE_DTYPE = record_dtype(
    [
        # [m/s] velocity that the inner loop tracks now, north and east
        ("reference_mps", "f8", (2,)),
        # what the inner loop believes of disturbances, see `WIND`; zero where none is declared
        ("belief", "f8", (N_BELIEF,)),
        # FLYING, LANDED, LOST or SWAPPING; ABSENT in a batch, where a mission has fewer UAS
        ("status", "i8"),
        # it takes no command before this sample
        ("responds_from_step", "i8"),
        # has been farther from its start than the landing distance
        ("departed", "?"),
        # return mode has it now
        ("returning", "?"),
        # the safety filter replaced its last command
        ("filtered", "?"),
    ]
)

EVENT_STATE_DTYPE = record_dtype(
    [
        # the sample at which it happens
        ("step", "i8"),
        # which UAS it happens to: an index, or EVERY
        ("uas", "i8"),
        # the state of the generator that it draws from
        ("random", "u8", (1,)),
    ]
)

PACK_STATE_DTYPE = record_dtype(
    [
        # which of its packs a UAS flies with, from 0 on
        ("number", "i8"),
        # the sample at which it has the next one
        ("ready_step", "i8"),
        # how many UAS were lost or had landed for good at its take-off
        ("out", "i8"),
        # it has covered something with this one
        ("covered", "?"),
    ]
)


class WorldState(NamedTuple):
    """Everything that changes from step to step; the arrays are written in place.

    A record of each entity, and the paper's states and what is uncovered as arrays: models and
    vector instructions take them so.
    """

    x: Annotated[NDArray[np.float64], "U", N_STATES]
    """The paper's states, in the order of `vehicle.layout`."""
    uas: Annotated[
        NDArray[np.void],
        UAS_STATE_DTYPE,
        "U",
        {"status": Values(ABSENT, SWAPPING), "responds_from_step": Values(0, 2 * NEVER - 1)},
    ]
    uncovered: Annotated[NDArray[np.bool_], "W"]
    """Waypoint still to be covered."""
    step: Annotated[NDArray[np.int64], 1, Values(0, "samples")]
    """Number of the sample, 0 at the start."""
    events: Annotated[
        NDArray[np.void],
        EVENT_STATE_DTYPE,
        "E",
        {"step": Values(0, NEVER), "uas": Values(EVERY, 2**31)},
    ]
    packs: Annotated[NDArray[np.void], PACK_STATE_DTYPE, "B"]
    """Of each UAS; of none where none swaps on its own."""
    true_vehicles: Annotated[NDArray[np.void], VEHICLE_DTYPE, "true vehicles"]
    """What each UAS flies, where features make that another than is believed or its battery has
    further RC pairs, whose voltages are in it; else none."""
    due_step: Annotated[NDArray[np.int64], "repeats", Values(0, 2**40)]
    """The sample at which each waypoint that was covered is asked for again, 0 where it is not; of
    none where no waypoint is to be covered more than once."""
    estimated: Annotated[NDArray[np.float64], "S", N_STATES]
    """What the inner loop flies by instead of `x`: for all UAS, or for none where they are known as
    they are; likewise the next two."""
    measured: Annotated[NDArray[np.float64], "S", N_STATES]
    """What the other parts of the autopilot fly by: the same with noise."""
    observed: Annotated[NDArray[np.float64], "S", N_STATES]
    """What planners and learners are told of it: the same, later."""
    memory: Annotated[NDArray[np.uint64], "memory words"]
    """The records of the features that the mission has, see `features.feature`."""

    def copy(self) -> Self:
        """The same state in arrays of its own."""
        return self._make(array.copy() for array in self)

    def as_observed(self) -> Self:
        """The same arrays, `x` being what planners and learners are told."""
        return self._replace(x=self.observed) if len(self.observed) else self


STATE = Memory(WorldState)
_with_x = replaced(STATE, "x")


@inlined_kernel
def as_estimated(state):
    """The state as the inner loop knows it: `x` is what it flies by."""
    if rarely(state.estimated.shape[0] > 0):
        return _with_x(state, state.estimated)
    return _with_x(state, state.x)


@inlined_kernel
def as_measured(state):
    """The state as return mode, guidance and safety filter know it: `x` is what is measured."""
    if rarely(state.measured.shape[0] > 0):
        return _with_x(state, state.measured)
    return _with_x(state, state.x)


@inlined_kernel
def as_observed(state):
    """The state as learners know it: `x` is what they are told."""
    if rarely(state.observed.shape[0] > 0):
        return _with_x(state, state.observed)
    return _with_x(state, state.x)


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
        home_m: (U, 3) [m] where they land.
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
        away: (U,) flies, but takes no commands, and is therefore shown to planners as landed: to be
            kept clear of; empty where none is.
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
    away: NDArray[np.bool_] = field(default_factory=lambda: np.zeros(0, np.bool_))

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
