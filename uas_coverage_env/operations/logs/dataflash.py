"""ArduPilot's data flash logs (.bin), of Copter 3.3 to 4.7. Their clock is that of the satellites.

Names and numbers are those of ArduPilot's log messages (libraries/AP_Logger/LogStructure.h): `BAT`
tells its monitors apart by `Inst` since 4.1 and by `Instance` in 4.0, 3.6 has `BAT2`, and before
that there were `CURR` and `CURR2`, at first in hundredths.
"""

import math
import os
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from uas_coverage_env.files.errors import InputError
from uas_coverage_env.operations.logs import messages as M
from uas_coverage_env.operations.logs.logged import Logged
from uas_coverage_env.operations.logs.telemetry import opened

_FMT, _FMT_BYTES, _HEAD = 0x80, 89, b"\xa3\x95"

_LAST_BYTES = 256

EVENTS: dict[int, M.Fact] = {
    10: M.Armed(True, is_change=True),
    11: M.Armed(False, is_change=True),
    18: M.InAir(False),
    28: M.InAir(True),
}
"""`EV.Id` -> what it says: armed, disarmed, landed, not landed. 15, AUTO_ARMED, is no arming:
Copter 4.7 says it again and again after it has disarmed, where it may take off in AUTO."""

ERRORS: dict[int, str] = {
    5: "radio failsafe",
    6: "battery failsafe",
    8: "ground station failsafe",
    9: "fence breach",
    12: "crash check",
    16: "EKF variance",
    17: "EKF failsafe",
}
"""`ERR.Subsys` -> what is told of it, if its code is not 0 (resolved)."""

_GPS, _GPS_GLITCH = 11, 2
"""`ERR.Subsys` of satellite navigation, and its code of a glitch; 0: it is over."""


def _power(monitor: int, m: Any) -> list[M.Fact]:
    values = []
    for name, unit in (("Volt", 1.0), ("Curr", 1.0), ("CurrTot", 1e-3)):
        value = float(getattr(m, name, M.UNKNOWN))
        if name != "CurrTot" and name in m.fmt.columns:
            whole = m.fmt.format[m.fmt.columns.index(name)] == "h"
            value *= 0.01 if whole else 1.0
        values.append(unit * value)
    return [M.Power(monitor, 0, *values)]


def _monitor(m: Any) -> int:
    return int(getattr(m, "Inst", getattr(m, "Instance", 0)))


def _error(m: Any) -> list[M.Fact]:
    if m.Subsys == _GPS and m.ECode in (0, _GPS_GLITCH):
        return [M.Glitch(m.ECode == _GPS_GLITCH)]
    told = ERRORS.get(m.Subsys) if m.ECode else None
    return [M.Text(told)] if told else []


def _height_m(m: Any) -> float:
    return getattr(m, "RelHomeAlt", getattr(m, "RelAlt", M.UNKNOWN))


def _ids(kind: type) -> str:
    """The events that say such a thing."""
    return ", ".join(str(number) for number, fact in EVENTS.items() if isinstance(fact, kind))


MESSAGES: M.Messages = {
    "POS": M.Message(
        "position, height above home",
        lambda m: [
            M.Position(m.Lat, m.Lng, getattr(m, "RelHomeAlt", getattr(m, "RelAlt", M.UNKNOWN)))
        ],
    ),
    "ATT": M.Message(
        "attitude", lambda m: [M.Attitude(*(math.radians(a) for a in (m.Roll, m.Pitch, m.Yaw)))]
    ),
    "BAT": M.Message("battery, by `Inst` or `Instance`", lambda m: _power(_monitor(m), m)),
    "BAT2": M.Message("second battery", lambda m: _power(1, m)),
    "CURR": M.Message("battery", lambda m: _power(0, m)),
    "CURR2": M.Message("second battery", lambda m: _power(1, m)),
    "ARM": M.Message("armed, disarmed", lambda m: [M.Armed(bool(m.ArmState), is_change=True)]),
    "EV": M.Message(
        f"armed, disarmed ({_ids(M.Armed)}), landed or not ({_ids(M.InAir)})",
        lambda m: [EVENTS[m.Id]] if m.Id in EVENTS else [],
    ),
    "ERR": M.Message(f"GPS glitch; {', '.join(ERRORS.values())}", _error),
    "MSG": M.Message("GPS glitch, failsafes", lambda m: M.facts_of_text(str(m.Message))),
}


def read_bin(path: Path, content: bytes, battery: int | None) -> list[Logged]:
    """A data flash log of ArduPilot.

    Args:
        path: The file.
        content: What it holds.
        battery: Which monitor, from 1 on; None: the first that there is.

    Raises:
        InputError: It holds no position.
    """
    streams = M.MessageStreams()
    whole, dropped = _undamaged(content)
    if not whole:
        raise InputError(f"{path}: holds no position (POS); is it the log of a flight?")
    if dropped > _LAST_BYTES:  # fewer are a last message that was not finished, or an empty page
        streams.notes.append(f"{dropped} bytes of its log are damaged, and were passed over")
    source = path
    try:
        if dropped:
            descriptor, name = tempfile.mkstemp(suffix=".bin")
            source = Path(name)
            with os.fdopen(descriptor, "wb") as file:
                file.write(whole)
        with opened(source) as log:
            while (message := log.recv_match(type=list(MESSAGES))) is not None:
                facts = MESSAGES[message.get_type()].facts(message)
                streams.add(float(message._timestamp), facts)
    finally:
        if source is not path:
            source.unlink(missing_ok=True)
    return [streams.logged(path, "POS", battery)]


def _undamaged(content: bytes) -> tuple[bytes, int]:
    """The messages of a log, and how many bytes are none; its parser stops at the first of them."""
    parts, dropped = [], 0
    for kind, first, last in _pieces(content):
        if kind:
            parts.append(content[first:last])
        else:
            dropped += last - first
    return b"".join(parts), dropped


def _pieces(content: bytes) -> Iterator[tuple[bool, int, int]]:
    """Parts of a log in their order, each of messages or of none."""
    lengths = {_FMT: _FMT_BYTES}
    at, since, end = 0, 0, len(content)
    while at + 3 <= end:
        size = lengths.get(content[at + 2], 0) if content[at : at + 2] == _HEAD else 0
        after = at + size
        if size and after <= end and (after + 2 > end or content[after : after + 2] == _HEAD):
            if content[at + 2] == _FMT:
                lengths[content[at + 3]] = content[at + 4]
            at = after
            continue
        # not even a message that ends before the next begins: look for where they go on
        if at > since:
            yield True, since, at
        since = at
        at = _goes_on(content, at + 1, lengths)
        yield False, since, at
        since = at
    if at > since:
        yield True, since, at
    if at < end:
        yield False, at, end


def _goes_on(content: bytes, at: int, lengths: dict[int, int]) -> int:
    """Where the next message begins that another one follows."""
    while (at := content.find(_HEAD, at)) >= 0:
        size = lengths.get(content[at + 2], 0) if at + 2 < len(content) else 0
        if size and (content[at + size : at + size + 2] == _HEAD or at + size == len(content)):
            return at
        at += 1
    return len(content)
