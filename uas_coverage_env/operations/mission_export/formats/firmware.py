"""Firmwares of autopilots, and what each calls a parameter."""

from collections.abc import Mapping
from typing import NamedTuple

COPTER_46, COPTER_47, PX4 = "copter-4.6", "copter-4.7", "px4"
FIRMWARES: Mapping[str, str] = {
    COPTER_46: "ArduCopter up to 4.6",
    COPTER_47: "ArduCopter from 4.7 on",
    PX4: "PX4",
}

INT8, INT16, INT32, FLOAT = 2, 4, 6, 9
"""MAV_PARAM_TYPE."""


class Named(NamedTuple):
    """A parameter as a firmware has it.

    Attributes:
        name: Its name.
        kind: MAV_PARAM_TYPE.
        unit: That it is in, empty: a number.
        scale: From the value of the table to that unit.
    """

    name: str
    kind: int = FLOAT
    unit: str = ""
    scale: float = 1.0


def copter(name: str, kind: int = FLOAT, unit: str = "", scale: float = 1.0) -> dict[str, Named]:
    """A parameter of ArduCopter that all versions call the same."""
    return dict.fromkeys((COPTER_46, COPTER_47), Named(name, kind, unit, scale))


def copter_cm(old: str, new: str, kind: int = FLOAT, unit: str = "m") -> dict[str, Named]:
    """One that was renamed in 4.7, which is in metres where the old one was in centimetres."""
    return {COPTER_46: Named(old, kind, f"c{unit}", 100.0), COPTER_47: Named(new, FLOAT, unit)}


def px4(name: str, kind: int = FLOAT, unit: str = "") -> dict[str, Named]:
    """A parameter of PX4."""
    return {PX4: Named(name, kind, unit)}
