"""What learners add to the world, declared once: see `uas_coverage_env.memory`."""

from typing import Annotated, NamedTuple

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.env.actions import RANGES_DTYPE
from uas_coverage_env.env.layout import K_WAYPOINTS, OBSERVATION_SIZE
from uas_coverage_env.env.nearest import NEIGHBOURS_DTYPE, NO_TARGET
from uas_coverage_env.env.observation import SCALES_DTYPE
from uas_coverage_env.env.rewards import REWARD_TERMS
from uas_coverage_env.memory import Memory, Values
from uas_coverage_env.views import Layout
from uas_coverage_env.world import COMMAND_DTYPE, OUTCOME_DTYPE
from uas_coverage_env.world.arena import ARENA
from uas_coverage_env.world.state import STATE

ENERGY, CONTACT, CONTACT_WITH, STATUS, FILTERED, RETURNING, COVERED, REWARD = range(
    len(REWARD_TERMS), len(REWARD_TERMS) + 8
)
"""Columns of a report behind the reward terms: energy drawn since t = 0 [Wh], outcome of the step,
number of waypoints that the swarm has covered so far, and the sum of the reward terms, added up in
their order (Python's own `sum` rounds in another way since 3.12)."""

REPORT_SIZE = REWARD + 1


class Tables(NamedTuple):
    """What does not change during a mission."""

    ranges: Annotated[NDArray[np.void], RANGES_DTYPE, "U"]
    """What the numbers of an action mean."""
    scales: Annotated[NDArray[np.void], SCALES_DTYPE, "U"]
    """What the numbers of an observation are divided by."""
    neighbours: Annotated[NDArray[np.void], NEIGHBOURS_DTYPE, "W"]


class Learners(NamedTuple):
    """What changes from step to step."""

    asked: Annotated[NDArray[np.float64], "U", "A"]
    """The actions of the coming step, A numbers for each UAS."""
    targets: Annotated[NDArray[np.int64], "U", Values(NO_TARGET, "W")]
    """Where each is flying to (waypoint action)."""
    candidates: Annotated[NDArray[np.int64], "U", K_WAYPOINTS, Values(-1, "W")]
    """The open waypoints in the order of the latest observation; -1 where there are no more."""
    company: Annotated[NDArray[np.float32], "W", 2]
    """See `count_company`."""
    report: Annotated[NDArray[np.float64], "U", REPORT_SIZE]
    """Reward terms of the latest step, then the columns named above."""


class Look(NamedTuple):
    """What is seen."""

    observation: Annotated[NDArray[np.float32], "U", OBSERVATION_SIZE]


class Scratch(NamedTuple):
    """What every step writes anew."""

    commands: Annotated[NDArray[np.void], COMMAND_DTYPE, "U"]
    outcome: Annotated[NDArray[np.void], OUTCOME_DTYPE, "U"]


class Prices(NamedTuple):
    """What rewards are made of."""

    weights: Annotated[NDArray[np.float64], len(REWARD_TERMS)]


TABLES, LEARNERS, LOOK = Memory(Tables), Memory(Learners), Memory(Look)
SCRATCH, PRICES = Memory(Scratch), Memory(Prices)

EPISODE = Layout(ARENA, STATE, TABLES, LEARNERS, SCRATCH, PRICES)
"""All that a step of one mission works on."""
