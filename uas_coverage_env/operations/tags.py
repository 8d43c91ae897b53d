"""What tags of OpenStreetMap say: what stands on the ground, how high, and where streets are."""

import re
from collections import Counter
from collections.abc import Mapping
from typing import Any, NamedTuple

STOREY_M = 3.2
ROOF_M = 2.0
"""Added to the levels where none are tagged for the roof: levels do not count it."""

BUILDING, FOREST, POWER_LINE, MAST = "building", "forest", "power_line", "mast"

GUESSED_M: Mapping[str, float] = {
    **dict.fromkeys(("garage", "garages", "shed", "carport", "hut"), 4.0),
    "greenhouse": 5.0,
    **dict.fromkeys(("house", "detached", "semidetached_house", "residential"), 9.0),
    **dict.fromkeys(("terrace", "retail"), 10.0),
    **dict.fromkeys(("school", "public"), 13.0),
    "industrial": 14.0,
    "apartments": 20.0,
    "church": 35.0,
}
"""Height of a building without height and levels, by its kind: a guess on the high side."""

GUESSED_OTHER_M = 10.0

_HIGHEST_M = 1_000.0
_HEIGHT = re.compile(r"\s*(\d{1,4}(?:[.,]\d+)?)\s*(m|ft|')?\s*")
_LEVELS = re.compile(r"\s*(\d{1,3}(?:\.\d+)?)\s*")


class Tagged(NamedTuple):
    """What a tag stands for.

    Attributes:
        kind: Of the obstacle that it becomes.
        half_width_m: Of a line, or the radius of a point; areas have an outline of their own [m].
        guessed_m: Its height, where no tag says it: a guess on the high side [m].
    """

    kind: str
    half_width_m: float
    guessed_m: float


_TREES = Tagged(FOREST, 4.0, 20.0)

STANDING: Mapping[tuple[str, str], Tagged] = {
    ("natural", "wood"): Tagged(FOREST, 0.0, 30.0),
    ("landuse", "forest"): Tagged(FOREST, 0.0, 30.0),
    ("natural", "tree"): _TREES,
    ("natural", "tree_row"): _TREES,
    ("power", "line"): Tagged(POWER_LINE, 10.0, 60.0),
    ("power", "tower"): Tagged(POWER_LINE, 10.0, 60.0),
    ("power", "minor_line"): Tagged(POWER_LINE, 3.0, 15.0),
    ("power", "pole"): Tagged(POWER_LINE, 3.0, 15.0),
    ("generator:source", "wind"): Tagged(MAST, 80.0, 250.0),
    ("man_made", "mast"): Tagged(MAST, 3.0, 100.0),
    ("man_made", "tower"): Tagged(MAST, 5.0, 100.0),
    ("man_made", "chimney"): Tagged(MAST, 5.0, 100.0),
    ("man_made", "water_tower"): Tagged(MAST, 10.0, 50.0),
    ("man_made", "silo"): Tagged(MAST, 5.0, 30.0),
}
"""Key and value of a tag -> what stands there; buildings are told by any value of theirs."""

STREETS_M: Mapping[str, float] = {
    **dict.fromkeys(("motorway", "trunk"), 7.0),
    **dict.fromkeys(("motorway_link", "primary", "secondary"), 4.5),
    **dict.fromkeys(("tertiary", "residential", "living_street", "unclassified"), 3.0),
    "service": 2.0,
}
"""Half the width of a street that is drawn, by the tag `highway` [m]."""


def standing_of(tags: Mapping[str, Any]) -> Tagged | None:
    """What stands there; None: nothing that is known to."""
    kind = tags.get("building") or tags.get("building:part")
    if kind and kind != "no":
        return Tagged(BUILDING, 0.0, GUESSED_M.get(str(kind), GUESSED_OTHER_M))
    return next((what for (key, value), what in STANDING.items() if tags.get(key) == value), None)


def height_m(
    tags: Mapping[str, Any], guessed_m: float, unread: Counter[str] | None = None
) -> tuple[float, bool]:
    """Height above the ground, and whether the tags say it.

    `height` counts before `building:levels`; 12, 12.5 m, 40 ft and 40' are read.

    Args:
        tags: Of OpenStreetMap.
        guessed_m: The height where they do not say it [m].
        unread: Counts the tags that cannot be read.
    """
    for key in ("height", "building:height", "est_height"):
        found = _match(_HEIGHT, key, tags, unread)
        if found:
            value = float(found[1].replace(",", "."))
            value *= 0.3048 if found[2] in ("ft", "'") else 1.0
            if 0.0 < value <= _HIGHEST_M:
                return value, True
    levels = _match(_LEVELS, "building:levels", tags, unread)
    if levels and float(levels[1]) > 0.0:
        roof = _match(_LEVELS, "roof:levels", tags, unread)
        return float(levels[1]) * STOREY_M + (float(roof[1]) * STOREY_M if roof else ROOF_M), True
    return guessed_m, False


def _match(
    pattern: re.Pattern[str], key: str, tags: Mapping[str, Any], unread: Counter[str] | None
) -> re.Match[str] | None:
    text = str(tags.get(key) or "")
    found = pattern.fullmatch(text)
    if text and found is None and unread is not None:
        unread[f"{key}={text[:40]}"] += 1
    return found
