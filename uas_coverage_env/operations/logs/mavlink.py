"""Logs of autopilots: ArduPilot's data flash logs (.bin) and telemetry of a ground station (.tlog).

Positions are those of its estimator; messages of other rates are put to their times. One file is
one UAS, and the clocks of several share the time of the satellites (.bin) or of the ground station
(.tlog).
"""

import os
from collections.abc import Callable, Iterator, Mapping
from contextlib import closing, contextmanager, redirect_stderr, redirect_stdout
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.files.errors import InputError
from uas_coverage_env.files.plain_files import read_bytes
from uas_coverage_env.operations.logs.logged import Logged

FloatArray = NDArray[np.float64]
Rows = dict[str, list[list[float]]]

_MOST_BYTES = 500_000_000
_LONGEST_STEP_BACK_S = 5.0
_STDERR = 2
_AUTOPILOT = 1
"""Component of telemetry that flies."""

_TIME = 0
_LATITUDE, _LONGITUDE, _HEIGHT = range(1, 4)
_ANGLES = slice(1, 4)
_VOLTAGE, _CURRENT, _USED = range(1, 4)
"""Columns of the rows of positions, attitudes and batteries, after the time."""

_BIN: Mapping[str, Callable[[Any], list[float]]] = {
    "POS": lambda m: [m.Lat, m.Lng, m.RelHomeAlt],
    "ATT": lambda m: [m.Roll, m.Pitch, m.Yaw],
    "BAT": lambda m: [m.Volt, m.Curr, 1e-3 * m.CurrTot],
}
_TLOG: Mapping[str, Callable[[Any], list[float]]] = {
    "GLOBAL_POSITION_INT": lambda m: [1e-7 * m.lat, 1e-7 * m.lon, 1e-3 * m.relative_alt],
    "ATTITUDE": lambda m: np.degrees([m.roll, m.pitch, m.yaw]).tolist(),
    "BATTERY_STATUS": lambda m: [
        1e-3 * m.voltages[0],
        1e-2 * m.current_battery,
        m.current_consumed,
    ],
    "SYS_STATUS": lambda m: [1e-3 * m.voltage_battery, 1e-2 * m.current_battery],
}


def read_bin(path: Path) -> list[Logged]:
    """A data flash log of ArduPilot.

    Args:
        path: The file.

    Raises:
        InputError: It cannot be read, or holds no position.
    """
    rows = _rows(path, _BIN, lambda m: m.get_type() != "BAT" or getattr(m, "Inst", 0) == 0)
    return [_logged(path, rows, "POS", "ATT", rows.get("BAT"), rows.get("BAT"))]


def read_tlog(path: Path) -> list[Logged]:
    """Telemetry that a ground station has kept, of one vehicle.

    Args:
        path: The file.

    Raises:
        InputError: It cannot be read, holds no position, or several vehicles.
    """
    systems: set[int] = set()

    def flies(message: Any) -> bool:
        if message.get_srcComponent() != _AUTOPILOT:
            return False
        systems.add(message.get_srcSystem())
        if message.get_type() == "BATTERY_STATUS":
            return message.id == 0 and message.current_consumed >= 0  # below: not known
        return True

    rows = _rows(path, _TLOG, flies)
    if len(systems) > 1:
        numbers = ", ".join(map(str, sorted(systems)))
        raise InputError(f"{path}: holds several vehicles (systems {numbers}); give a file of each")
    used = [[row[_TIME], 0.0, 0.0, 1e-3 * row[_USED]] for row in rows.get("BATTERY_STATUS", [])]
    power = [row for row in rows.get("SYS_STATUS", []) if row[_CURRENT] >= 0.0]  # below: not known
    return [_logged(path, rows, "GLOBAL_POSITION_INT", "ATTITUDE", power, used)]


def _rows(
    path: Path,
    wanted: Mapping[str, Callable[[Any], list[float]]],
    accepted: Callable[[Any], bool],
) -> Rows:
    """Time and values of the messages of each kind."""
    from pymavlink import mavutil

    read_bytes(path, _MOST_BYTES)  # a plain file, and no device to listen to
    rows: Rows = {}
    try:
        with _unheard():
            log: Any = mavutil.mavlink_connection(str(path.resolve()), robust_parsing=True)
            with closing(log):
                while (message := log.recv_match(type=list(wanted))) is not None:
                    kind = message.get_type()
                    if accepted(message):
                        values = [float(value) for value in wanted[kind](message)]
                        rows.setdefault(kind, []).append([float(message._timestamp), *values])
    except ModuleNotFoundError:
        raise
    except Exception as error:  # its parsers raise whatever a damaged file makes them
        raise InputError(f"{path}: cannot be read as a log: {error}") from error
    return rows


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


def _logged(
    path: Path,
    rows: Rows,
    position: str,
    attitude: str,
    power: list[list[float]] | None,
    used: list[list[float]] | None,
) -> Logged:
    if len(rows.get(position, [])) < 2:
        raise InputError(f"{path}: holds no position ({position}); is it the log of a flight?")
    places = np.array(rows[position])
    # places that were not known yet are at 0, 0; a clock may say the same time twice
    places = places[(np.abs(places[:, _LATITUDE : _LONGITUDE + 1]) > 0.0).any(axis=1)]
    back_s = -np.diff(places[:, _TIME])
    if (back_s > _LONGEST_STEP_BACK_S).any():
        at_s = places[int(back_s.argmax()), _TIME] - places[0, _TIME]
        raise InputError(
            f"{path}: its clock goes back by {back_s.max():.0f} s, {at_s:.0f} s after its "
            f"beginning; cut out one flight"
        )
    places = places[np.append(True, np.diff(np.maximum.accumulate(places[:, _TIME])) > 0.0)]
    times_s = places[:, _TIME]

    def at_times(table: list[list[float]] | None, column: int) -> FloatArray | None:
        if not table:
            return None
        found = np.array(table)
        return np.interp(times_s, found[:, _TIME], found[:, column])

    angles = rows.get(attitude)
    return Logged(
        uas="",
        time_s=times_s,
        latitude_deg=places[:, _LATITUDE],
        longitude_deg=places[:, _LONGITUDE],
        height_m=places[:, _HEIGHT],
        attitude_rad=_attitude(np.array(angles), times_s) if angles else None,
        used_Ah=at_times(used, _USED),
        voltage_V=at_times(power, _VOLTAGE),
        current_A=at_times(power, _CURRENT),
    )


def _attitude(angles: FloatArray, times_s: FloatArray) -> FloatArray:
    """(N, 3) roll, pitch, yaw at times [rad]; yaw does not go round at the north."""
    turned = np.unwrap(np.radians(angles[:, _ANGLES]), axis=0)
    found = [np.interp(times_s, angles[:, _TIME], column) for column in turned.T]
    return (np.stack(found, axis=1) + np.pi) % (2.0 * np.pi) - np.pi
