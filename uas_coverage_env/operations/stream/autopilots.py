"""Autopilots that can be streamed to: modes, how they come to fly by targets, their parameters."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple


class Name(NamedTuple):
    """A parameter as a version of an autopilot calls it.

    Attributes:
        name: Its name.
        unit: What 1 of it is, in the unit that we use.
        is_whole: Whether it is a whole number on the wire, its bytes sent as if of a float.
    """

    name: str
    unit: float = 1.0
    is_whole: bool = False


@dataclass(frozen=True)
class Autopilot:
    """One kind of autopilot. Modes are numbers as in the custom mode of its heartbeat.

    Attributes:
        name: As users know it.
        number: In heartbeats.
        targets: The mode in which it flies by targets; likewise the next four.
        targets_name: Its name.
        land: Lands where it is.
        rtl: Returns straight to its launch and lands.
        hold: Stops and holds its position.
        way_back: Returns the way it came and lands; None: it knows no such.
        limits: Names of the parameters that limit how it flies, by attribute of `Limits`.
        has_sub_modes: Whether a mode is a main mode and a sub mode, in bytes 2 and 3 of its number.
        is_streamed_to: Whether the mode of targets needs a stream of them, before it is entered and
            all the time, on the ground too; otherwise it takes off by a command.
        is_bytewise: Whether it sends whole parameters as their bytes.
    """

    name: str
    number: int
    targets: int
    targets_name: str
    land: int
    rtl: int
    hold: int
    way_back: int | None
    limits: dict[str, tuple[Name, ...]]
    has_sub_modes: bool = False
    is_streamed_to: bool = False
    is_bytewise: bool = False

    def mode_params(self, mode: int) -> tuple[int, ...]:
        """How a command asks for a mode."""
        return _main_and_sub(mode) if self.has_sub_modes else (mode,)

    def told(self, mode: int | None) -> str:
        """A mode for the user."""
        known = {self.land: "LAND", self.rtl: "RTL", self.hold: "HOLD", self.way_back: "SMART_RTL"}
        if mode is not None and mode in known:
            return known[mode]
        if mode is None or not self.has_sub_modes:
            return f"mode {mode}"
        return "main mode {}, sub mode {}".format(*_main_and_sub(mode))


def _px4_mode(main: int, sub: int = 0) -> int:
    return (main << 16) | (sub << 24)


def _main_and_sub(mode: int) -> tuple[int, int]:
    return mode >> 16 & 0xFF, mode >> 24 & 0xFF


_AUTO = 4
ARDUPILOT = Autopilot(
    "ArduPilot",
    3,
    4,
    "GUIDED",
    land=9,
    rtl=6,
    hold=17,
    way_back=21,
    limits={  # by ArduCopter 4.7 and before
        "speed_mps": (Name("WP_SPD"), Name("WPNAV_SPEED", 0.01)),
        "up_mps": (Name("WP_SPD_UP"), Name("WPNAV_SPEED_UP", 0.01)),
        "down_mps": (Name("WP_SPD_DN"), Name("WPNAV_SPEED_DN", 0.01)),
        "acceleration_mps2": (Name("WP_ACC"), Name("WPNAV_ACCEL", 0.01)),
        "vertical_mps2": (Name("WP_ACC_Z"), Name("WPNAV_ACCEL_Z", 0.01)),
        "return_m": (Name("RTL_ALT_M"), Name("RTL_ALT", 0.01)),
    },
)
PX4 = Autopilot(
    "PX4",
    12,
    _px4_mode(6),
    "OFFBOARD",
    land=_px4_mode(_AUTO, 6),
    rtl=_px4_mode(_AUTO, 5),
    hold=_px4_mode(_AUTO, 3),
    way_back=None,
    limits={
        "speed_mps": (Name("MPC_XY_VEL_MAX"),),
        "up_mps": (Name("MPC_Z_VEL_MAX_UP"),),
        "down_mps": (Name("MPC_Z_VEL_MAX_DN"),),
        "acceleration_mps2": (Name("MPC_ACC_HOR"),),
        "return_m": (Name("RTL_RETURN_ALT"),),
    },
    has_sub_modes=True,
    is_streamed_to=True,
    is_bytewise=True,
)
AUTOPILOTS = {one.number: one for one in (ARDUPILOT, PX4)}
"""By their number in heartbeats."""
