"""Codes of the world: whole numbers in arrays and infos, words in records and files.

Each is declared here once. Kernels take the plain numbers, which `state`, `outcome` and `commands`
give names of their own: numba compares a member of an enumeration with no float.
"""

from enum import IntEnum
from typing import Literal

DynamicsName = Literal["lpv", "nonlinear"]
"""The paper's linear model, or 6-DOF with exact power."""


class UasStatus(IntEnum):
    """What has become of a UAS: `infos[agent]["status"]`.

    Landed and lost are final.
    """

    ABSENT = -1
    """The mission has no such UAS, where the environment has room for a larger fleet."""
    FLYING = 0
    LANDED = 1
    LOST = 2
    SWAPPING = 3
    """It has landed and waits for a fresh battery pack, to fly again if there is need."""


class ContactKind(IntEnum):
    """What a UAS was lost to: `infos[agent]["contact"]`."""

    NONE = 0
    OBSTACLE = 1
    """`contact_with` is its index in `scenario.obstacles`."""
    MOVING_OBSTACLE = 2
    """`contact_with` is its index in `scenario.moving_obstacles`."""
    UAS = 3
    """`contact_with` is its index in `scenario.uas`."""
    GEOFENCE = 4
    BATTERY = 5
    """It was discharged beyond `dod_max`."""
    FAULT = 6
    """An event of the scenario, `uas_lost`: no violation."""
    LIMITS = 7
    """Its wrench took it beyond `vehicle.LOST_BEYOND` times its limit of speed or of tilt."""


class CommandKind(IntEnum):
    """What a UAS was told: `infos[agent]["filter"]["asked"]["kind"]`."""

    VELOCITY = 0
    ACCELERATION = 1
    WRENCH = 2
    GO_TO = 3
    CLIMB = 4
    """North, east and down velocity: what the safety filter brakes with, without an altitude to
    hold, so that braking on is the same flight in every step. Planners cannot give it; a kind of
    action can."""
