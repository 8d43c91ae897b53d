"""Lengths as people and maps write them: 12, 12.5 m, 40 ft, 40', 40'6", ca. 50 m, 50;60."""

import math
import re
from typing import Any

_UNITS_M = {
    **dict.fromkeys(("m", "metre", "metres", "meter", "meters", "mtr"), 1.0),
    **dict.fromkeys(("ft", "feet", "foot", "'", "′", "’"), 0.3048),
    **dict.fromkeys(("in", "inch", "inches", '"', "″", "”"), 0.0254),
    "cm": 0.01,
    "km": 1000.0,
    **dict.fromkeys(("storey", "storeys", "story", "stories", "floor", "floors", "levels"), 3.2),
}
_NUMBER = re.compile(r"(\d{1,3}(?:,\d{3})+(?!\d)|\d+)(?:[.,](\d+))?\s*([a-z]+|['\"′’″”])?")


def length_m(given: Any) -> float:
    """The largest length that a number or a text names; NaN where it names none [m].

    A number without a unit is in metres. The largest is taken of "50;60" and "50-60 m", so that
    what is flown around is not lower than it may be.

    Args:
        given: Of a tag, a property or a field.
    """
    if isinstance(given, bool) or given is None:
        return math.nan
    if isinstance(given, int | float):
        try:
            return float(given)
        except OverflowError:
            return math.nan
    text = str(given).strip().lower()[:80]
    return math.nan if text.startswith("-") else _largest_m(_NUMBER.findall(text))


def length_with_unit_m(text: str) -> float:
    """The largest length in a name that has a unit: 85 of `Chimney 2, 85 m`; NaN: none [m]."""
    found = _NUMBER.findall(text.lower()[:80])
    return _largest_m([each for each in found if each[-1] in _UNITS_M])


def _largest_m(numbers: list[tuple[str, str, str]]) -> float:
    found, feet_m = [], 0.0
    for whole, part, unit in numbers:
        value = float(f"{whole.replace(',', '')}.{part or 0}") * _UNITS_M.get(unit, 1.0)
        inches = _UNITS_M.get(unit) == _UNITS_M["in"]
        found.append(value + feet_m if inches else value)
        feet_m = value if _UNITS_M.get(unit) == _UNITS_M["ft"] else 0.0
    return max(found, default=math.nan)
