"""Telemetry that a ground station has kept (.tlog); its clock is that of the ground station."""

import os
from collections import defaultdict
from collections.abc import Iterator
from contextlib import closing, contextmanager, redirect_stderr, redirect_stdout
from pathlib import Path
from typing import Any

from uas_coverage_env.operations.logs import messages as M
from uas_coverage_env.operations.logs.logged import Logged

_STDERR = 2
_AUTOPILOT = 1
"""Component of telemetry that flies."""

_ARMED = 0x80
"""The bit of `HEARTBEAT.base_mode` (MAV_MODE_FLAG_SAFETY_ARMED)."""

_ON_GROUND, _UNDEFINED = 1, 0
"""Of MAV_LANDED_STATE."""

_NO_MILLIVOLTS = 65_535


def _sys_status(m: Any) -> list[M.Fact]:
    return [
        M.Power(
            0,
            0,
            voltage_V=_at_least(0.0, m.voltage_battery, 1e-3, but=_NO_MILLIVOLTS),
            current_A=_at_least(0.0, m.current_battery, 1e-2),
            soc=_at_least(0.0, m.battery_remaining, 1e-2),
        )
    ]


def _battery_status(m: Any) -> list[M.Fact]:
    cells = [*m.voltages, *(v for v in getattr(m, "voltages_ext", ()) if v)]
    known = [mV for mV in cells if mV != _NO_MILLIVOLTS]
    return [
        M.Power(
            m.id,
            1,
            voltage_V=1e-3 * sum(known) if known else M.UNKNOWN,
            current_A=_at_least(0.0, m.current_battery, 1e-2),
            used_Ah=_at_least(0.0, m.current_consumed, 1e-3),
            soc=_at_least(0.0, m.battery_remaining, 1e-2),
        )
    ]


def _battery2(m: Any) -> list[M.Fact]:
    voltage_V = _at_least(0.0, m.voltage, 1e-3, but=_NO_MILLIVOLTS)
    return [M.Power(1, 2, voltage_V, _at_least(0.0, m.current_battery, 1e-2))]


def _at_least(least: float, value: float, unit: float, but: float | None = None) -> float:
    """A value in its unit; NaN where it says that it is not known."""
    return unit * value if value >= least and value != but else M.UNKNOWN


def _landed(m: Any) -> list[M.Fact]:
    return [] if m.landed_state == _UNDEFINED else [M.InAir(m.landed_state != _ON_GROUND)]


MESSAGES: M.Messages = {
    "GLOBAL_POSITION_INT": M.Message(
        "position, height above home",
        lambda m: [M.Position(1e-7 * m.lat, 1e-7 * m.lon, 1e-3 * m.relative_alt)],
    ),
    "ATTITUDE": M.Message("attitude", lambda m: [M.Attitude(m.roll, m.pitch, m.yaw)]),
    "HEARTBEAT": M.Message(
        "armed, disarmed (`base_mode`)", lambda m: [M.Armed(bool(m.base_mode & _ARMED))]
    ),
    "EXTENDED_SYS_STATE": M.Message("landed or not", _landed),
    "SYS_STATUS": M.Message("first battery: voltage, current, share left", _sys_status),
    "BATTERY_STATUS": M.Message(
        "batteries by `id`: charge taken, voltage, current", _battery_status
    ),
    "BATTERY2": M.Message("second battery", _battery2),
    "STATUSTEXT": M.Message("GPS glitch, failsafes", lambda m: M.facts_of_text(str(m.text))),
}


def read_tlog(path: Path, content: bytes, battery: int | None) -> list[Logged]:
    """Telemetry that a ground station has kept, one entry for each vehicle.

    Args:
        path: The file.
        content: What it holds.
        battery: Which monitor, from 1 on; None: the first that there is.

    Raises:
        InputError: It holds no position.
    """
    del content  # its parser reads files alone
    vehicles: dict[int, M.MessageStreams] = defaultdict(M.MessageStreams)
    with opened(path) as log:
        while (message := log.recv_match(type=list(MESSAGES))) is not None:
            if message.get_srcComponent() == _AUTOPILOT:
                system = message.get_srcSystem()
                vehicles[system].system = system
                facts = MESSAGES[message.get_type()].facts(message)
                vehicles[system].add(float(message._timestamp), facts)
    flown = [streams for _, streams in sorted(vehicles.items()) if streams.rows[M.Position]]
    if not flown:
        flown = [M.MessageStreams()]
    return [streams.logged(path, "GLOBAL_POSITION_INT", battery) for streams in flown]


@contextmanager
def opened(path: Path) -> Iterator[Any]:
    """A log as pymavlink reads it, for messages in their order."""
    from pymavlink import mavutil

    with _unheard():
        log: Any = mavutil.mavlink_connection(str(path.resolve()), robust_parsing=True)
        with closing(log):
            yield log


@contextmanager
def _unheard() -> Iterator[None]:
    """Without the lines that the parsers print of each damaged place; one is compiled code."""
    kept = os.dup(_STDERR)
    try:
        with (
            open(os.devnull, "w", encoding="utf-8") as nowhere,
            redirect_stdout(nowhere),
            redirect_stderr(nowhere),
        ):
            os.dup2(nowhere.fileno(), _STDERR)
            yield
    finally:
        os.dup2(kept, _STDERR)
        os.close(kept)
