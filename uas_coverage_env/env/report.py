"""What is told of a step: columns that kernels write, and the infos that are made of them."""

from dataclasses import dataclass

from uas_coverage_env.entities.state import ABSENT

CONTACT, CONTACT_WITH, LIMITS, STATUS, FILTERED, RETURNING, COVERED = range(7)
"""Columns of a report: outcome of the step (LIMITS is a mask, see `vehicle.LIMIT_NAMES`), and how
many waypoints the swarm has covered so far. Whole numbers, as Python is given them: to convert them
one by one takes a tenth of a step."""

REPORT_SIZE = COVERED + 1

ENERGY, REWARD, FIRST_TERM = range(3)
"""Columns of the amounts: energy drawn since t = 0 [Wh], the reward, and from FIRST_TERM on its
weighted terms. The reward is their sum in their order (Python's own `sum` rounds in another way
since 3.12)."""


@dataclass(frozen=True)
class InfoField:
    """One number that the info of a UAS has.

    Attributes:
        name: Its key.
        meaning: In words; Markdown.
        column: Where it stands in the report; with `of_amounts`, in the amounts.
        of_amounts: It is one of the amounts; the swarm has their sum.
        of_swarm: It is the same for all UAS, and the swarm's.
        flag: It is True or False.
        absent: What it is of a UAS that the mission does not have.
    """

    name: str
    meaning: str
    column: int
    of_amounts: bool = False
    of_swarm: bool = False
    flag: bool = False
    absent: int = 0


INFOS = (
    InfoField(
        "status",
        "(`UasStatus`) 0 flying, 1 landed, 2 lost, 3 swapping its battery pack",
        STATUS,
        absent=ABSENT,
    ),
    InfoField(
        "contact",
        "(`ContactKind`) what it was lost to: 0 nothing, 1 obstacle, 2 moving obstacle, 3 UAS, "
        "4 geofence, 5 battery, 6 an event of the scenario, 7 limits, out of control",
        CONTACT,
    ),
    InfoField(
        "contact_with",
        "the index of that obstacle or UAS in the scenario, else -1",
        CONTACT_WITH,
        absent=-1,
    ),
    InfoField(
        "limits_exceeded",
        "limits of the vehicle that it exceeds, as a mask: bit k stands for "
        "`vehicle.LIMIT_NAMES[k]`",
        LIMITS,
    ),
    InfoField("returning", "whether it flies home", RETURNING, flag=True),
    InfoField("covered", "waypoints that the swarm has covered so far", COVERED, of_swarm=True),
    InfoField(
        "energy_Wh",
        "energy drawn by this UAS so far [Wh]",
        ENERGY,
        of_amounts=True,
    ),
)
"""The infos of `uas_coverage_v0`, in their order; after them come the terms of the reward, the mask
of the actions and what the safety filter did."""
