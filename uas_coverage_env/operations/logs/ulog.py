"""PX4's logs (.ulg), by the fields of its uORB messages.

The clock is that of the satellites (`vehicle_gps_position.time_utc_usec`), and without any the one
that starts with the autopilot.
"""

import io
import math
from collections.abc import Callable, Iterator, Mapping
from contextlib import redirect_stdout
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from uas_coverage_env.files.errors import InputError
from uas_coverage_env.operations.logs import messages as M
from uas_coverage_env.operations.logs.logged import Logged

_EARTH_M = 6_371_000.0
_GLOBAL, _LOCAL = "vehicle_global_position", "vehicle_local_position"
_ARMED = 2
"""Of `vehicle_status.arming_state`, in all versions."""

Row = Mapping[str, Any]
_HOME_ALT = "home_alt"
"""What is added to a row of a position: the altitude of home at that time [m]."""


def _local(m: Row) -> list[M.Fact]:
    """PX4's map: azimuthal equidistant on a sphere."""
    ahead, aside = m["x"] / _EARTH_M, m["y"] / _EARTH_M
    far = math.hypot(ahead, aside)
    ref, east = math.radians(m["ref_lat"]), math.radians(m["ref_lon"])
    if not (math.isfinite(far) and math.isfinite(ref)):
        return []
    scale = math.sin(far) / far if far else 1.0
    latitude = math.asin(math.cos(far) * math.sin(ref) + ahead * scale * math.cos(ref))
    below = math.cos(far) * math.cos(ref) - ahead * scale * math.sin(ref)
    longitude = east + math.atan2(aside * scale, below)
    height_m = m["ref_alt"] - m["z"] - m[_HOME_ALT]
    return [M.Position(math.degrees(latitude), math.degrees(longitude), height_m)]


def _attitude(m: Row) -> list[M.Fact]:
    w, x, y, z = (m[f"q[{k}]"] for k in range(4))
    return [
        M.Attitude(
            math.atan2(2.0 * (w * x + y * z), 1.0 - 2.0 * (x * x + y * y)),
            math.asin(max(-1.0, min(1.0, 2.0 * (w * y - z * x)))),
            math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z)),
        )
    ]


def _power(m: Row) -> list[M.Fact]:
    def known(least: float, unit: float, *names: str) -> float:
        value = next((float(m[name]) for name in names if name in m), M.UNKNOWN)
        return unit * value if value >= least else M.UNKNOWN

    return [
        M.Power(
            m["multi_id"],
            0,
            voltage_V=known(1e-3, 1.0, "voltage_v", "voltage_filtered_v"),
            current_A=known(0.0, 1.0, "current_a", "current_filtered_a"),
            used_Ah=known(0.0, 1e-3, "discharged_mah"),
            soc=known(0.0, 1.0, "remaining"),
        )
    ]


MESSAGES: M.Messages = {
    "vehicle_global_position": M.Message(
        "position", lambda m: [M.Position(m["lat"], m["lon"], m["alt"] - m[_HOME_ALT])]
    ),
    "vehicle_local_position": M.Message("position, where the global one is not logged", _local),
    "home_position": M.Message("altitude of home", lambda m: []),
    "vehicle_gps_position": M.Message("time of the satellites", lambda m: []),
    "vehicle_attitude": M.Message("attitude", _attitude),
    "battery_status": M.Message("batteries, by instance", _power),
    "vehicle_status": M.Message(
        "armed, disarmed (`arming_state`)", lambda m: [M.Armed(m["arming_state"] == _ARMED)]
    ),
    "vehicle_land_detected": M.Message("landed or not", lambda m: [M.InAir(not m["landed"])]),
}
"""Topic -> what is read of it; texts that were logged are read, too."""

TEXTS = M.Message("GPS glitch, failsafes", lambda m: M.facts_of_text(m))


def read_ulg(path: Path, content: bytes, battery: int | None) -> list[Logged]:
    """A log of PX4.

    Args:
        path: The file.
        content: What it holds.
        battery: Which monitor, from 1 on; None: the first that there is.

    Raises:
        InputError: It holds no position, or lacks a field.
    """
    from pyulog import ULog

    with redirect_stdout(io.StringIO()):  # it prints what is damaged
        log: Any = ULog(io.BytesIO(content), list(MESSAGES))
    streams = M.MessageStreams()
    if log.file_corruption:
        streams.notes.append("parts of its log are damaged, and were passed over")
    topics: dict[str, list[Any]] = {}
    for topic in log.data_list:
        topics.setdefault(topic.name, []).append(topic)
    offset_s = _offset_s(topics)
    home_alt = _home_alt(topics, streams)
    for name, message in MESSAGES.items():
        if name == _LOCAL and _GLOBAL in topics:
            continue
        for topic in topics.get(name, []):
            # of all but batteries, others are spare sensors or estimates of their own
            if topic.multi_id and name != "battery_status":
                continue
            try:
                for time_s, row in _rows(topic, home_alt):
                    streams.add(offset_s + time_s, message.facts(row))
            except KeyError as error:
                raise InputError(f"{path}: {name} of its log has no field {error}") from error
    for said in log.logged_messages:
        streams.add(offset_s + 1e-6 * said.timestamp, TEXTS.facts(said.message))
    return [streams.logged(path, _GLOBAL, battery)]


def _rows(topic: Any, home_alt: Callable[[Any], Any]) -> Iterator[tuple[float, dict[str, Any]]]:
    """Time [s] and fields of each message of a topic, with its instance and the height of home."""
    columns = {name: values.tolist() for name, values in topic.data.items()}
    times_us = topic.data["timestamp"]
    if topic.name in (_GLOBAL, _LOCAL):
        columns[_HOME_ALT] = home_alt(times_us).tolist()
    for n, time_us in enumerate(times_us.tolist()):
        row = {name: values[n] for name, values in columns.items()}
        yield 1e-6 * time_us, {**row, "multi_id": topic.multi_id}


def _home_alt(topics: Mapping[str, list[Any]], streams: M.MessageStreams) -> Callable[[Any], Any]:
    """The altitude of home at times (N,) as it was set last, or will be first [m]."""
    for name, field, instead in (
        ("home_position", "alt", ""),
        (_LOCAL, "ref_alt", "the origin of its own map"),
        (_GLOBAL, "alt", "where it began"),
    ):
        for topic in topics.get(name, [])[:1]:
            known = np.isfinite(topic.data[field])
            if not known.any():
                continue
            if instead:
                streams.notes.append(f"its log has no home_position: heights are above {instead}")
            set_us, alt = topic.data["timestamp"][known], topic.data[field][known]
            if name == _GLOBAL:
                set_us, alt = set_us[:1], alt[:1]
            return partial(_as_set_last, set_us, alt)
    return lambda times_us: np.zeros(len(times_us))


def _as_set_last(set_us: Any, values: Any, times_us: Any) -> Any:
    last = np.searchsorted(set_us, times_us, side="right") - 1
    return values[np.maximum(last, 0)]


def _offset_s(topics: Mapping[str, list[Any]]) -> float:
    """From the clock of the autopilot to that of the satellites [s]; 0 where there is none."""
    for topic in topics.get("vehicle_gps_position", []):
        utc_us = topic.data.get("time_utc_usec")
        if utc_us is not None and (utc_us > 0).any():
            known = utc_us > 0
            ahead_us = utc_us[known].astype(np.int64) - topic.data["timestamp"][known].astype(
                np.int64
            )
            return 1e-6 * float(np.median(ahead_us))
    return 0.0
