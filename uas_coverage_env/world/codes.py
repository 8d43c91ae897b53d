"""Names of the whole numbers that infos hold, where records and files have words."""

from enum import IntEnum

from uas_coverage_env.world import commands, outcome, state


class UasStatus(IntEnum):
    """What has become of a UAS: `infos[agent]["status"]`."""

    ABSENT = state.ABSENT
    """The mission has no such UAS, where the environment has room for a larger fleet."""
    FLYING = state.FLYING
    LANDED = state.LANDED
    LOST = state.LOST
    SWAPPING = state.SWAPPING
    """It has landed and waits for a fresh battery pack, to fly again if there is need."""


class ContactKind(IntEnum):
    """What a UAS was lost to: `infos[agent]["contact"]`."""

    NONE = outcome.NONE
    OBSTACLE = outcome.OBSTACLE
    """`contact_with` is its index in `scenario.obstacles`."""
    MOVING_OBSTACLE = outcome.MOVING_OBSTACLE
    """`contact_with` is its index in `scenario.moving_obstacles`."""
    UAS = outcome.UAS
    """`contact_with` is its index in `scenario.uas`."""
    GEOFENCE = outcome.FENCE
    BATTERY = outcome.BATTERY
    """It was discharged beyond `dod_max`."""
    FAULT = outcome.FAULT
    """An event of the scenario, `uas_lost`: no violation."""
    LIMITS = outcome.LIMITS
    """Its wrench took it beyond `vehicle.LOST_BEYOND` times its limit of speed or of tilt."""


class CommandKind(IntEnum):
    """What a UAS was told: `infos[agent]["filter"]["asked"]["kind"]`."""

    VELOCITY = commands.VELOCITY
    ACCELERATION = commands.ACCELERATION
    WRENCH = commands.WRENCH
    GO_TO = commands.GO_TO
    CLIMB = commands.CLIMB
