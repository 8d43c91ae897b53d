"""What the messages of an autopilot's log say, whatever its format, and one `Logged` made of it."""

from bisect import bisect_left
from collections import defaultdict
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.files.errors import InputError
from uas_coverage_env.operations.logs.logged import Logged, Said, Span

FloatArray = NDArray[np.float64]
Rows = list[tuple[Any, ...]]

_TIME, _LATITUDE, _LONGITUDE, _HEIGHT = range(4)
"""Columns of the rows of positions."""

UNKNOWN = float("nan")
_LONGEST_STEP_BACK_S = 5.0
_DAMAGED = 0.05
"""Share of the positions that may be out of order, as damaged places of a file are."""


class Position(NamedTuple):
    """Degrees, and metres above home."""

    latitude_deg: float
    longitude_deg: float
    height_m: float


class Attitude(NamedTuple):
    """Of the body."""

    roll_rad: float
    pitch_rad: float
    yaw_rad: float


class Power(NamedTuple):
    """What a battery monitor measures; NaN: nothing.

    Attributes:
        monitor: Which, from 0 on.
        rank: Of the kind of message among those that tell the same; the least is believed.
        voltage_V: [V].
        current_A: [A].
        used_Ah: Since the autopilot was started [A h].
        soc: Left, by the autopilot's idea of the pack [-].
    """

    monitor: int
    rank: int
    voltage_V: float = UNKNOWN
    current_A: float = UNKNOWN
    used_Ah: float = UNKNOWN
    soc: float = UNKNOWN


class Armed(NamedTuple):
    """Whether the motors may turn; a change is told once, a state again and again."""

    yes: bool
    is_change: bool = False


class InAir(NamedTuple):
    """Whether the autopilot takes itself to be in the air."""

    yes: bool


class Glitch(NamedTuple):
    """Whether the autopilot takes its position to be wrong."""

    yes: bool


class Text(NamedTuple):
    """Something that it says."""

    text: str


Fact = Position | Attitude | Power | Armed | InAir | Glitch | Text


class Message(NamedTuple):
    """A kind of message that is read.

    Attributes:
        meaning: What it is read for, in words.
        facts: What one of them says.
    """

    meaning: str
    facts: Callable[[Any], Iterable[Fact]]


Messages = Mapping[str, Message]

GLITCH_TEXTS = (("glitch cleared", False), ("gps glitch", True))
"""What is in a text of an autopilot, in small letters, and whether its position is wrong then."""

TOLD_TEXTS = ("failsafe", "ekf variance", "crash", "fence breach", "lost")
"""Texts with one of these are told to the user."""


def facts_of_text(text: str) -> list[Fact]:
    """What a text of an autopilot says."""
    small = text.lower()
    found: list[Fact] = []
    if "prearm" in small:
        return found
    for part, wrong in GLITCH_TEXTS:
        if part in small:
            return [Glitch(wrong)]
    if any(part in small for part in TOLD_TEXTS):
        found.append(Text(text.strip()))
    return found


@dataclass(eq=False)
class MessageStreams:
    """What was logged of one vehicle, each with its time first.

    Attributes:
        rows: Kind of fact -> time and values.
        power: Monitor and rank -> time, voltage, current, used and soc.
        system: Which vehicle of a link.
        note: What its reader has to say.
    """

    rows: dict[type, Rows] = field(default_factory=lambda: defaultdict(list))
    power: dict[tuple[int, int], Rows] = field(default_factory=lambda: defaultdict(list))
    system: int | None = None
    notes: list[str] = field(default_factory=list)

    def add(self, time_s: float, facts: Iterable[Fact]) -> None:
        """Keep what a message says."""
        for fact in facts:
            if isinstance(fact, Power):
                self.power[fact.monitor, fact.rank].append((time_s, *fact[2:]))
            else:
                self.rows[type(fact)].append((time_s, *tuple(fact)))

    def logged(self, path: Path, position: str, battery: int | None) -> Logged:
        """All of it at the times of the positions.

        Args:
            path: Of the log.
            position: The message that positions are from, for who has none.
            battery: Which monitor, from 1 on; None: the first that there is.

        Raises:
            InputError: There are no positions, or no such monitor.
        """
        places = _places(path, np.array(self.rows[Position], float).reshape(-1, 4), position)
        times_s = places[:, _TIME]
        angles = np.array(self.rows[Attitude], float)
        end_s = max(float(rows[-1][0]) for rows in self.rows.values() if rows)
        return Logged(
            uas="",
            time_s=times_s,
            latitude_deg=places[:, _LATITUDE],
            longitude_deg=places[:, _LONGITUDE],
            height_m=places[:, _HEIGHT],
            attitude_rad=_attitude(angles, times_s) if len(angles) else None,
            **self._battery(path, times_s, battery),
            system=self.system,
            armed=_spans(self.rows[Armed], times_s[0], end_s),
            in_air=_spans(self.rows[InAir], times_s[0], end_s),
            glitches=_spans(self.rows[Glitch], times_s[0], end_s) or (),
            said=tuple(_once(self.rows[Text])),
            notes=tuple(self.notes),
        )

    def _battery(self, path: Path, times_s: FloatArray, asked: int | None) -> dict[str, Any]:
        """The fields of a monitor: each from the first kind of message that has it."""
        monitors = sorted({monitor for monitor, _ in self.power})
        listed = ", ".join(str(monitor + 1) for monitor in monitors) or "none"
        if asked is not None and asked - 1 not in monitors:
            raise InputError(f"{path}: has no battery monitor {asked}; it has {listed}")
        if not monitors:
            return {}
        monitor = monitors[0] if asked is None else asked - 1
        if asked is None and len(monitors) > 1:
            self.notes.append(
                f"its log has battery monitors {listed}; {monitor + 1} is used, --battery chooses"
            )
        series: dict[str, tuple[FloatArray, FloatArray]] = {}
        for rank in sorted(rank for which, rank in self.power if which == monitor):
            table = np.array(self.power[monitor, rank], float)
            for column, name in enumerate(Power._fields[2:], start=1):
                there = np.isfinite(table[:, column])
                if there.any() and name not in series:
                    series[name] = table[there, 0], table[there, column]
        if "used_Ah" in series:
            series.pop("soc", None)  # which is a share of what the autopilot takes the pack for
        elif "current_A" in series:
            series["used_Ah"] = _added_up(*series["current_A"])
        return {name: np.interp(times_s, at_s, values) for name, (at_s, values) in series.items()}


def _added_up(times_s: FloatArray, current_A: FloatArray) -> tuple[FloatArray, FloatArray]:
    """What a current has taken since its first time [A h]."""
    steps_Ah = 0.5 * (current_A[1:] + current_A[:-1]) * np.diff(times_s) / 3_600.0
    return times_s, np.append(0.0, np.cumsum(steps_Ah))


def _places(path: Path, places: FloatArray, position: str) -> FloatArray:
    """The positions that can be: known, on the Earth, in order of time."""
    known = np.isfinite(places).all(axis=1)
    known &= (places[:, _LATITUDE : _LONGITUDE + 1] != 0.0).any(axis=1)  # not known yet: at 0, 0
    known &= (np.abs(places[:, _LATITUDE]) <= 90.0) & (np.abs(places[:, _LONGITUDE]) <= 180.0)
    places = places[known]
    if len(places) < 2:
        raise InputError(f"{path}: holds no position ({position}); is it the log of a flight?")
    times_s = places[:, _TIME]
    kept = _in_order(times_s)
    back_s = np.maximum.accumulate(times_s) - times_s
    late = back_s > _LONGEST_STEP_BACK_S
    # a damaged place has any time; a clock that was set goes on from where it is
    if late.any() and (~kept).mean() > _DAMAGED:
        at = int(late.argmax())
        raise InputError(
            f"{path}: its clock goes back by {back_s.max():.0f} s, "
            f"{times_s[at - 1] - times_s[0]:.0f} s after its beginning; cut out one flight"
        )
    return places[kept]


def _in_order(times_s: FloatArray) -> NDArray[np.bool_]:
    """(N,) the most entries that can be kept so that each is later than the one before."""
    if (np.diff(times_s) > 0.0).all():
        return np.ones(len(times_s), np.bool_)
    ends: list[float] = []  # the least last time of a row of each length
    rows: list[int] = []
    before = np.full(len(times_s), -1)
    for n, time_s in enumerate(times_s.tolist()):
        length = bisect_left(ends, time_s)
        before[n] = rows[length - 1] if length else -1
        ends[length : length + 1], rows[length : length + 1] = [time_s], [n]
    kept = np.zeros(len(times_s), np.bool_)
    n = rows[-1]
    while n >= 0:
        kept[n], n = True, before[n]
    return kept


def _spans(rows: Rows, first_s: float, last_s: float) -> tuple[Span, ...] | None:
    """When a state lasted; one that a log ends in lasts until then. None: nothing is told of it."""
    if not rows:
        return None
    spans, since_s = [], None
    for n, (time_s, yes, *is_change) in enumerate(sorted(rows)):
        if yes:
            since_s = time_s if since_s is None else since_s
            continue
        if n == 0 and any(is_change):  # it ends what the log began in
            since_s = first_s
        if since_s is not None:
            spans.append(Span(since_s, time_s))
        since_s = None
    if since_s is not None:
        spans.append(Span(since_s, max(last_s, since_s), is_open=True))
    return tuple(spans)


def _once(rows: Rows) -> list[Said]:
    """The texts without those that are said again and again."""
    found: dict[Any, Said] = {}
    for time_s, text in sorted(rows):
        found.setdefault(str(text).lower(), Said(time_s, str(text)))
    return list(found.values())


def _attitude(angles: FloatArray, times_s: FloatArray) -> FloatArray:
    """(N, 3) roll, pitch, yaw at times [rad]; yaw does not go round at the north."""
    turned = np.unwrap(angles[:, 1:], axis=0)
    found = [np.interp(times_s, angles[:, 0], column) for column in turned.T]
    return (np.stack(found, axis=1) + np.pi) % (2.0 * np.pi) - np.pi
