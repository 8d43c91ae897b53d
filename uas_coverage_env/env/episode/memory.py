"""What learners add to the world, declared once: see `uas_coverage_env.compiled.memory`."""

from typing import Annotated, NamedTuple

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.compiled.memory import Memory, Values, record_dtype
from uas_coverage_env.compiled.views import Layout
from uas_coverage_env.entities.commands import COMMAND_DTYPE
from uas_coverage_env.entities.outcome import OUTCOME_DTYPE
from uas_coverage_env.entities.state import STATE
from uas_coverage_env.env.observation.nearest import N_AROUND, NEIGHBOURS_DTYPE, NO_TARGET
from uas_coverage_env.env.observation.notes import NOTES_DTYPE
from uas_coverage_env.env.observation.scales import K_WAYPOINTS, SCALES_DTYPE
from uas_coverage_env.env.observation.waypoints import FIXED_DTYPE
from uas_coverage_env.env.report import REPORT_SIZE
from uas_coverage_env.env.rewards.potentials import N_POTENTIALS
from uas_coverage_env.world.arena import ARENA

LOWEST, MIDDLE, HIGHEST = range(3)
"""Columns of the ranges: what -1, 0 and 1 mean for a number of an action."""

WHICH, ADDRESS, CHOOSES, GOES_TO = range(4)
"""Columns of the call of an action: which kind it is, the address of its kernel, whether it is a
choice, and whether it goes to places (see `act`)."""

CALL_DTYPE = record_dtype(
    [
        # where its kernel lies
        ("address", "i8"),
        # first number that it writes, and how many
        ("column", "i8"),
        ("width", "i8"),
        # first parameter that it is handed, and how many
        ("first", "i8"),
        ("parameters", "i8"),
    ]
)
"""The call of a block of an observation, or of a term of a reward, at its address."""


class Tables(NamedTuple):
    """What does not change during a mission."""

    ranges: Annotated[NDArray[np.float64], "U", "A", HIGHEST + 1]
    """Of the numbers of an action, see `LOWEST`."""
    scales: Annotated[NDArray[np.void], SCALES_DTYPE, "U"]
    """What the numbers of an observation are divided by."""
    neighbours: Annotated[NDArray[np.void], NEIGHBOURS_DTYPE, "W"]
    fixed: Annotated[NDArray[np.void], FIXED_DTYPE, "U", "W"]


class Learners(NamedTuple):
    """What changes from step to step."""

    asked: Annotated[NDArray[np.float64], "U", "A"]
    """The actions of the coming step, A numbers for each UAS."""
    targets: Annotated[NDArray[np.int64], "U", Values(NO_TARGET, "W")]
    """Where each is flying to (waypoint action)."""
    candidates: Annotated[NDArray[np.int64], "U", K_WAYPOINTS, Values(-1, "W")]
    """The open waypoints in the order of the latest observation; -1 where there are no more."""
    around: Annotated[NDArray[np.float32], "W", N_AROUND]
    """What is open around each waypoint, see `write_around`."""
    notes: Annotated[NDArray[np.void], NOTES_DTYPE, "U"]
    """What blocks of the observation have in common, see `ObservationBlock.needs`."""
    potentials: Annotated[NDArray[np.float64], "U", N_POTENTIALS]
    """Of the step before, where the reward has them, see `env.rewards.potentials`."""
    report: Annotated[NDArray[np.int64], "U", REPORT_SIZE]
    """Of the latest step, see `env.report`."""
    amounts: Annotated[NDArray[np.float64], "U", "P"]
    """Of the latest step: likewise, P = FIRST_TERM + R."""


class FirstObservation(NamedTuple):
    """What is seen."""

    observation: Annotated[NDArray[np.float32], "U", "V"]
    """V numbers for each UAS."""


class Scratch(NamedTuple):
    """What every step writes anew."""

    commands: Annotated[NDArray[np.void], COMMAND_DTYPE, "U"]
    outcome: Annotated[NDArray[np.void], OUTCOME_DTYPE, "U"]
    values: Annotated[NDArray[np.float64], "U", "A"]
    """The numbers of an action in their units."""
    looks: Annotated[NDArray[np.bool_], "U"]
    """It observes in this step."""


class Acting(NamedTuple):
    """The kind of action, for kernels."""

    call: Annotated[NDArray[np.int64], GOES_TO + 1]
    """See `WHICH` and the names beside it."""
    parameters: Annotated[NDArray[np.float64], "action parameters"]


class Paying(NamedTuple):
    """The R terms of a reward, for kernels."""

    weights: Annotated[NDArray[np.float64], "R"]
    begins_as_version: Annotated[NDArray[np.bool_], 1]
    """The terms of the version come first: they are part of the step."""
    calls: Annotated[NDArray[np.void], CALL_DTYPE, "reward calls"]
    """Of each other term."""
    parameters: Annotated[NDArray[np.float64], "reward parameters"]
    """Of all of them."""


class Observing(NamedTuple):
    """The blocks of an observation, for kernels."""

    begins_as_version: Annotated[NDArray[np.bool_], 1]
    """The blocks of the version come first: they are part of the step."""
    calls: Annotated[NDArray[np.void], CALL_DTYPE, "observation calls"]
    """Of each other block."""
    parameters: Annotated[NDArray[np.float64], "observation parameters"]
    """Of all of them."""


TABLES, LEARNERS, FIRST_OBSERVATION = Memory(Tables), Memory(Learners), Memory(FirstObservation)
SCRATCH, ACTING = Memory(Scratch), Memory(Acting)
PAYING, OBSERVING = Memory(Paying), Memory(Observing)

EPISODE = Layout(ARENA, STATE, TABLES, LEARNERS, SCRATCH, ACTING, PAYING, OBSERVING)
"""All that a step of one mission works on."""
