"""What a vehicle does when something fails: the table that reports and docs follow from."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any, NamedTuple

from uas_coverage_env.operations.mission_export.mission_file import MissionFile
from uas_coverage_env.operations.mission_export.return_paths import RETRACE, RETURN, Span


class Failure(NamedTuple):
    """One of the things that fail.

    Attributes:
        event: What it is.
        copter: What ArduCopter does then, by `ReturnPath.action`; `{height:g}` is the height of its
            return [m].
        px4: Likewise PX4.
        checked: Whether that way is known to be clear and affordable, as the docs say it.
    """

    event: str
    copter: Mapping[str, str]
    px4: Mapping[str, str]
    checked: str


def _always(text: str) -> dict[str, str]:
    return {RETURN: text, RETRACE: text}


_RETURNS = "brakes, climbs to {height:g} m where it is lower, flies straight home and lands"
_BACK = "flies back the way it came (SmartRTL) and lands; where it does not know it, lands there"
_ALONG = (
    "flies along its mission, back or on to its end, whichever has fewer waypoints left, and lands"
)
_HOME = {RETURN: _RETURNS, RETRACE: _BACK}
_PX4_HOME = {RETURN: _RETURNS, RETRACE: _ALONG}
_GOES_ON = _always("flies its mission to the end and lands")
_LANDS = _always("lands where it is")

FAILURES: tuple[Failure, ...] = (
    Failure(
        "low charge",
        _HOME,
        _PX4_HOME,
        "way and charge, from every second of the flight, obstacles, zones and fence; other UAS, "
        "where all are in time",
    ),
    Failure("critical charge", _LANDS, _LANDS, "no"),
    Failure(
        "radio control or ground station lost in the mission",
        _GOES_ON,
        _GOES_ON,
        "yes, it is the plan",
    ),
    Failure(
        "radio control lost while a pilot flies it", _HOME, _PX4_HOME, "not from where a pilot is"
    ),
    Failure("outside of the fence or in a zone", _HOME, _PX4_HOME, "not from there"),
    Failure("place not known (no satellites)", _LANDS, _LANDS, "no"),
)


def failures_of(one: MissionFile, *, px4: bool) -> list[tuple[str, str]]:
    """What a vehicle with this file does when something fails: (event, what).

    Args:
        one: The file.
        px4: Whether PX4 flies it; else, ArduPilot.
    """
    rows = []
    for failure in FAILURES:
        says = (failure.px4 if px4 else failure.copter)[one.home.action]
        rows.append((failure.event, says.format(height=one.home.height_m)))
    return rows


def low_charge(one: MissionFile) -> dict[str, Any]:
    """At what charge it comes home and how, for the report."""
    levels = one.levels
    return {
        "action": one.home.action,
        "soc": round(levels.low_soc, 4),
        "voltage_V": round(levels.low_V, 2),
        "critical_soc": round(levels.critical_soc, 4),
        "critical_voltage_V": round(levels.critical_V, 2),
        "suffices": levels.suffices,
        "stops_close": [_span(span) for span in one.home.braking],
        "close_to": [{"name": span.of, **_span(span)} for span in one.home.near],
    }


def _span(span: Span) -> dict[str, float]:
    return {"from_s": round(span.from_s, 1), "to_s": round(span.to_s, 1)}


def not_safe(one: MissionFile) -> Iterator[str]:
    """What of that cannot be promised, as phrases that follow the name of a file."""
    levels, last = one.levels, (one.in_wind or one.still).legs[-1]
    if not levels.suffices:
        yield (
            f"has no safe way home for low charge: it may take {levels.low_soc:.0%}, and a flight "
            f"as planned has {max(last.soc, 0.0):.0%} left before it lands: the failsafe would "
            f"break it off; plan for less, or with a larger pack{_or_a_higher_ceiling(one)}"
        )
    if one.home.braking:
        yield (
            f"is closer to an obstacle, a zone or the fence than its radius if it is stopped "
            f"{_when(one.home.braking)} s after its start"
        )
    for name in dict.fromkeys(span.of for span in one.home.near):
        spans = [span for span in one.home.near if span.of == name]
        yield f"comes too close to {name} if it comes home early, {_when(spans)} s after its start"


def _or_a_higher_ceiling(one: MissionFile) -> str:
    if one.home.action == RETURN:
        return ""
    return ", or with a fence so high that it can return straight instead of the way that it came"


def _when(spans: Sequence[Span]) -> str:
    told = [
        f"{s.from_s:.0f}" if s.from_s == s.to_s else f"{s.from_s:.0f} to {s.to_s:.0f}"
        for s in spans[:3]
    ]
    more = f" (+{len(spans) - 3} more)" if len(spans) > 3 else ""
    return ", ".join(told) + more
