"""Autopilots that can be streamed to: their modes, and how they come to fly by targets."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Autopilot:
    """One kind of autopilot. Modes are numbers as in the custom mode of its heartbeat.

    Attributes:
        name: As users know it.
        number: In heartbeats.
        targets: The mode in which it flies by targets; likewise the next three.
        targets_name: Its name.
        land: Lands where it is.
        rtl: Returns to its launch and lands.
        hold: Stops and holds its position.
        has_sub_modes: Whether a mode is a main mode and a sub mode, in bytes 2 and 3 of its number.
        is_streamed_to: Whether the mode of targets needs a stream of them, before it is entered and
            all the time, on the ground too; otherwise it takes off by a command.
    """

    name: str
    number: int
    targets: int
    targets_name: str
    land: int
    rtl: int
    hold: int
    has_sub_modes: bool = False
    is_streamed_to: bool = False

    def mode_params(self, mode: int) -> tuple[int, ...]:
        """How a command asks for a mode."""
        return _main_and_sub(mode) if self.has_sub_modes else (mode,)

    def told(self, mode: int | None) -> str:
        """A mode for the user."""
        if mode is None or not self.has_sub_modes:
            return f"mode {mode}"
        return "main mode {}, sub mode {}".format(*_main_and_sub(mode))


def _px4_mode(main: int, sub: int = 0) -> int:
    return (main << 16) | (sub << 24)


def _main_and_sub(mode: int) -> tuple[int, int]:
    return mode >> 16 & 0xFF, mode >> 24 & 0xFF


_AUTO = 4
ARDUPILOT = Autopilot("ArduPilot", 3, 4, "GUIDED", land=9, rtl=6, hold=17)
PX4 = Autopilot(
    "PX4",
    12,
    _px4_mode(6),
    "OFFBOARD",
    land=_px4_mode(_AUTO, 6),
    rtl=_px4_mode(_AUTO, 5),
    hold=_px4_mode(_AUTO, 3),
    has_sub_modes=True,
    is_streamed_to=True,
)
AUTOPILOTS = {one.number: one for one in (ARDUPILOT, PX4)}
"""By their number in heartbeats."""
