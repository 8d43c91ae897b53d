"""What a vehicle does without its companion: parameters that are set before it arms.

The table decides, and `docs/streaming.md` shows it.
"""

from __future__ import annotations

from typing import NamedTuple

from uas_coverage_env.operations.stream.autopilots import ARDUPILOT, PX4, Name

STATION = 250
"""Our MAVLink system id: of our own, so that no other ground station is taken for us."""
BLIND_S = 0.5
PATIENCE_S = 15.0
"""So long an ArduPilot waits for us where it stands, before it goes home."""


class Setting(NamedTuple):
    """A parameter that decides what a vehicle does alone.

    Attributes:
        autopilot: Of which autopilot.
        names: What its versions call it.
        value: What it is set to where flying straight home is clear from everywhere on the way.
        otherwise: What it is set to where it is not.
        must: Whether a vehicle that does not have it, or does not take it, is not flown.
        why: What it does.
    """

    autopilot: str
    names: tuple[Name, ...]
    value: float
    otherwise: float
    must: bool
    why: str


SETTINGS = (
    Setting(
        *(ARDUPILOT.name, (Name("GUID_TIMEOUT"),), BLIND_S, BLIND_S, True),
        f"without a target for {BLIND_S:g} s it brakes and hovers; by default it flies straight on "
        "for 3 s",
    ),
    Setting(
        *(ARDUPILOT.name, (Name("FS_GCS_ENABLE"),), 3, 4, True),
        "without our heartbeat it flies home the way it came (SmartRTL) and lands; where it cannot "
        "retrace that: straight home (3), or, where that is not clear, it lands (4)",
    ),
    Setting(
        *(ARDUPILOT.name, (Name("FS_GCS_TIMEOUT"),), PATIENCE_S, PATIENCE_S, True),
        f"that happens after {PATIENCE_S:g} s",
    ),
    Setting(
        *(ARDUPILOT.name, (Name("MAV_GCS_SYSID"), Name("SYSID_MYGCS")), STATION, STATION, True),
        "only our heartbeat counts; with another ground station's, a dead companion would not be "
        "noticed",
    ),
    Setting(
        *(ARDUPILOT.name, (Name("MAV_GCS_SYSID_HI"),), 0, 0, False),
        "likewise (from ArduCopter 4.7 on)",
    ),
    Setting(
        *(PX4.name, (Name("COM_OBL_RC_ACT", is_whole=True),), 3, 4, True),
        "without targets for `COM_OF_LOSS_T` it flies straight home at `RTL_RETURN_ALT` (3), or, "
        "where that is not clear, it lands (4)",
    ),
)
