"""One autopilot at the other end of a MAVLink connection: what it reports, and what it is told."""

from __future__ import annotations

import math
import os
from contextlib import suppress
from typing import Any

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.files.errors import InputError
from uas_coverage_env.operations.geodesy import LocalFrame
from uas_coverage_env.operations.stream.autopilots import ARDUPILOT, AUTOPILOTS, Name
from uas_coverage_env.operations.stream.failsafes import STATION

FloatArray = NDArray[np.float64]

KINDS = ("udp", "udpin", "udpout", "tcp")
"""Of connections: `udp` (or `udpin`) listens on a port, the others connect to one."""

_SET_MODE, _ARM, _TAKE_OFF, _INTERVAL, _CHECK_ARMING = 176, 400, 22, 511, 401
_ARMED, _CUSTOM_MODE = 128, 1
_RATES_HZ = {33: 10, 1: 2}
"""Of messages: GLOBAL_POSITION_INT, SYS_STATUS."""
_READY = 0x1000_0000
"""Of SYS_STATUS: the checks before arming."""
_REAL, _WHOLE = 9, 6
_WARNING = 4
_ACCEPTED = (0, 5)
"""Answers to a command: accepted, in progress."""
_RELATIVE_FRAME = 6
_TYPE_MASK = 0b1001_1100_0000
"""Of SET_POSITION_TARGET_GLOBAL_INT: position, velocity and heading count."""


class VehicleLink:
    """A connection to one autopilot.

    Attributes:
        name: The UAS that it flies.
        place_m: (3,) where it says it is; None before it has [m].
        heard_s: When it was heard last, by the clock of the caller; None: never [s].
        autopilot: What it is, once it has said.
        mode: Its mode; None before it has said, and after a heartbeat that is not of its autopilot.
        armed: Whether it is armed.
        velocity_mps: (3,) as it says [m/s].
        is_ready: Whether its checks before arming pass; None: it has not said.
        parameters: What it has said of its parameters, by name.
        texts: Warnings of its that have not been read yet.

    Args:
        name: The UAS that it flies.
        address: `udp:HOST:PORT` or another of `KINDS`.
        frame: Where on the Earth the plan is.

    Raises:
        InputError: The address is none, or cannot be used.
    """

    def __init__(self, name: str, address: str, frame: LocalFrame) -> None:
        self.name, self.address, self._frame = name, address, frame
        self.place_m: FloatArray | None = None
        self.heard_s: float | None = None
        self.autopilot = ARDUPILOT
        self.mode: int | None = None
        self.armed = False
        self.velocity_mps = np.zeros(3)
        self.is_ready: bool | None = None
        self.parameters: dict[str, float] = {}
        self.texts: list[str] = []
        self._has_warned = False
        self._system: int | None = None
        self._link = _connected(name, address)

    def hear(self, now_s: float) -> None:
        """Read what has arrived; nothing does over a connection that has broken.

        The first heartbeat says which system is at the other end; others over the same connection
        are not heard.

        Args:
            now_s: Time by the caller's clock [s].

        Raises:
            InputError: By its first heartbeat, its autopilot is none of `AUTOPILOTS`.
        """
        while (message := self._received()) is not None:
            kind = message.get_type()
            if message.get_srcComponent() != 1:
                continue
            if self._system is None and kind == "HEARTBEAT":
                self._meet(message)
            if message.get_srcSystem() != self._system:
                continue
            if kind == "HEARTBEAT":
                is_known = message.autopilot == self.autopilot.number
                self.mode = int(message.custom_mode) if is_known else None
                self.armed = bool(message.base_mode & _ARMED)
                self.heard_s = now_s
            elif kind == "GLOBAL_POSITION_INT":
                degrees = 1e-7 * message.lat, 1e-7 * message.lon
                if abs(degrees[0]) <= 90.0 and abs(degrees[1]) <= 180.0:
                    self.place_m = self._frame.to_ned(*degrees, 1e-3 * message.relative_alt)
                    self.velocity_mps = 0.01 * np.array([message.vx, message.vy, message.vz], float)
                    self.heard_s = now_s
            else:
                self._keep(message, kind)

    def _keep(self, message: Any, kind: str) -> None:
        if kind == "SYS_STATUS" and message.onboard_control_sensors_present & _READY:
            self.is_ready = bool(message.onboard_control_sensors_health & _READY)
        elif kind == "PARAM_VALUE":
            value = message.param_value
            if self.autopilot.is_bytewise and message.param_type == _WHOLE:
                value = float(np.float32(value).view(np.int32))
            self.parameters[message.param_id] = value
        elif kind == "STATUSTEXT" and message.severity <= _WARNING:
            self.texts.append(message.text)
            self._has_warned = True
        elif kind == "COMMAND_ACK" and message.command == _ARM:
            refused = message.result not in _ACCEPTED and not self._has_warned
            self.texts += [f"refuses to arm (MAV_RESULT {message.result})"] * refused

    def _meet(self, heartbeat: Any) -> None:
        if heartbeat.autopilot not in AUTOPILOTS:
            known = " and ".join(one.name for one in AUTOPILOTS.values())
            raise InputError(
                f"--connect {self.name}={self.address}: is autopilot {heartbeat.autopilot}; "
                f"stream knows only the modes of {known}"
            )
        self.autopilot = AUTOPILOTS[heartbeat.autopilot]
        self._system = heartbeat.get_srcSystem()

    def _received(self) -> Any:
        """The next message; None: there is none yet, or none can come."""
        with suppress(OSError):
            return self._link.recv_match(blocking=False)

    @property
    def takes_targets(self) -> bool:
        """Whether it is in the mode in which it flies by targets."""
        return self.mode == self.autopilot.targets

    def beat(self) -> None:
        """Say that a ground station is here, and ask for positions often enough."""
        self._link.mav.heartbeat_send(6, 8, 0, 0, 4)
        for message, rate_hz in _RATES_HZ.items():
            self._command(_INTERVAL, message, 1e6 / rate_hz)

    def ask_for(self, parameter: Name) -> None:
        """Ask what a parameter is."""
        name = parameter.name.encode()
        self._link.mav.param_request_read_send(self._addressee, 1, name, -1)

    def set(self, parameter: Name, value: float) -> None:
        """Set a parameter, in its own unit."""
        kind = _REAL
        if parameter.is_whole:
            kind, value = _WHOLE, float(np.int32(value).view(np.float32))
        self._link.mav.param_set_send(self._addressee, 1, parameter.name.encode(), value, kind)

    def check_arming(self) -> None:
        """Ask it to say why it would not arm."""
        self._command(_CHECK_ARMING)

    def set_mode(self, mode: int) -> None:
        """Ask for a mode."""
        self._command(_SET_MODE, _CUSTOM_MODE, *self.autopilot.mode_params(mode))

    def arm(self) -> None:
        """Ask it to arm."""
        self._command(_ARM, 1)

    def disarm(self) -> None:
        """Ask it to disarm, which it does on the ground only."""
        self._command(_ARM, 0)

    def take_off(self, height_m: float) -> None:
        """Ask it to climb to a height above home [m]."""
        self._command(_TAKE_OFF, 0, 0, 0, 0, 0, 0, height_m)

    def go(self, place_m: FloatArray, velocity_mps: FloatArray) -> None:
        """Send where it is to be now, facing north, in degrees: its own metres are of a sphere.

        Args:
            place_m: (3,) [m].
            velocity_mps: (3,) [m/s].
        """
        latitude, longitude, height = self._frame.to_geodetic(place_m).tolist()
        whole = round(1e7 * latitude), round(1e7 * longitude)
        velocity = (float(value) for value in velocity_mps)
        self._link.mav.set_position_target_global_int_send(
            0, self._addressee, 1, _RELATIVE_FRAME, _TYPE_MASK, *whole, height,
            *velocity, 0.0, 0.0, 0.0, 0.0, 0.0
        )  # fmt: skip

    def close(self) -> None:
        """End the connection."""
        self._link.close()

    @property
    def _addressee(self) -> int:
        return 1 if self._system is None else self._system

    def _command(self, command: int, *params: float) -> None:
        padded = (*params, *(0.0,) * (7 - len(params)))
        self._link.mav.command_long_send(self._addressee, 1, command, 0, *padded)

    def off_m(self, place_m: FloatArray) -> float:
        """How far it is from a place; infinite where it has not said [m]."""
        if self.place_m is None:
            return math.inf
        return float(np.linalg.norm(self.place_m - place_m))


def check_address(name: str, address: str) -> None:
    """Refuse what is no address.

    Args:
        name: The UAS that it is for.
        address: `udp:HOST:PORT` or another of `KINDS`.

    Raises:
        InputError: It is none.
    """
    kind, *where = address.split(":")
    if kind not in KINDS or len(where) != 2 or not where[0] or not _is_port(where[1]):
        raise InputError(
            f"--connect {name[:40]}={address[:60]}: should be like udp:127.0.0.1:14550 "
            f"({', '.join(KINDS)})"
        )


def _connected(name: str, address: str) -> Any:
    os.environ.setdefault("MAVLINK20", "1")  # before the first import
    from pymavlink import mavutil

    check_address(name, address)
    try:
        return mavutil.mavlink_connection(address, source_system=STATION, robust_parsing=True)
    except OSError as error:
        raise InputError(
            f"--connect {name}={address[:60]}: cannot be used ({error.strerror or error})"
        ) from error


def _is_port(text: str) -> bool:
    return text.isascii() and text.isdecimal() and len(text) <= 5 and 0 < int(text) < 65_536
