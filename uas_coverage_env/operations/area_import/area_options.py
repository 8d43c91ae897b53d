"""How an area is to be looked at, where its drawing says so: height, sharpness, speed, again."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, NamedTuple

from uas_coverage_env.files.errors import InputError

_MOST_TIMES, _LONGEST_MIN = 100, 1440.0


class AreaOptions(NamedTuple):
    """What a drawing asks of an area; None: as for all.

    Attributes:
        height_m: Of the waypoints above the ground [m].
        pixel_cm: Instead: the most that a pixel may show [cm].
        speed_mps: At which a waypoint is covered, as the exposure allows [m/s].
        overlap: Share of a cell that the next picture shows again [-].
        again_after_s: Times after which it is to be seen again, each from the time before [s].
    """

    height_m: float | None = None
    pixel_cm: float | None = None
    speed_mps: float | None = None
    overlap: float | None = None
    again_after_s: tuple[float, ...] | None = None


NO_OPTIONS = AreaOptions()

_BOUNDS = {
    "height_m": (1.0, 1_000.0),
    "pixel_cm": (0.01, 1_000.0),
    "speed_mps": (0.5, 100.0),
    "overlap": (0.0, 0.9),
}

NAMES = (*_BOUNDS, "again_min")
"""The attributes of a drawing that say it; short enough for the table of a shapefile."""


def area_options_of(source: str, attributes: Mapping[str, Any]) -> AreaOptions:
    """What the attributes of a drawing ask for.

    Args:
        source: File and name, for messages.
        attributes: Those of `NAMES` that the file has, as numbers or text.

    Raises:
        InputError: One of them is no such number, or two contradict each other.
    """
    given = {name: attributes[name] for name in NAMES if attributes.get(name) not in (None, "")}
    numbers = {
        name: _number(f"{source}: {name}", given[name], *bounds)
        for name, bounds in _BOUNDS.items()
        if name in given
    }
    if "height_m" in numbers and "pixel_cm" in numbers:
        raise InputError(f"{source}: pixel_cm says how high waypoints lie; leave out height_m")
    again = minutes_of(f"{source}: again_min", given["again_min"]) if "again_min" in given else None
    return AreaOptions(**numbers, again_after_s=again)


def minutes_of(source: str, given: Any) -> tuple[float, ...]:
    """Times [s] from minutes: a number, or numbers with commas between them.

    Args:
        source: Where they are given, for messages.
        given: What is given.

    Raises:
        InputError: It is something else.
    """
    minutes = [_float(part) for part in str(given).strip("[] ").split(",")]
    if len(minutes) > _MOST_TIMES or not all(0.0 < each <= _LONGEST_MIN for each in minutes):
        raise InputError(
            f"{source} {str(given)[:40]!r} should be minutes, such as 10 or 10,20: at most "
            f"{_MOST_TIMES}, each greater than 0, at most {_LONGEST_MIN:g}"
        )
    return tuple(60.0 * each for each in minutes)


def _number(source: str, given: Any, least: float, most: float) -> float:
    number = _float(given)
    if not least <= number <= most:
        raise InputError(
            f"{source} {str(given)[:40]!r} should be a number between {least:g} and {most:g}"
        )
    return number


def _float(given: Any) -> float:
    """A number; NaN, which is within no bounds, where it is none."""
    try:
        return math.nan if isinstance(given, bool) else float(given)
    except (TypeError, ValueError, OverflowError):
        return math.nan
