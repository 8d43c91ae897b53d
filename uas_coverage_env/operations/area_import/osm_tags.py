"""Kinds of what stands on the ground: tags of OpenStreetMap, heights, and where streets are."""

import math
import re
from collections import Counter
from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple

from uas_coverage_env.operations.area_import.length_texts import length_m

STOREY_M = 3.2
ROOF_M = 2.0
"""Added to the levels where none are tagged for the roof: levels do not count it."""

LEAST_M = 3.0
"""What no row of `STANDING` names is an obstacle where it is tagged as this high or higher."""

BUILDING, FOREST, POWER_LINE, MAST = "building", "forest", "power_line", "mast"
STRUCTURE = "structure"

GUESSED_M: Mapping[str, float] = {
    **dict.fromkeys(("garage", "garages", "shed", "carport", "hut"), 4.0),
    "greenhouse": 5.0,
    **dict.fromkeys(("house", "detached", "semidetached_house", "residential"), 9.0),
    **dict.fromkeys(("terrace", "retail"), 10.0),
    **dict.fromkeys(("school", "public"), 13.0),
    "industrial": 14.0,
    "apartments": 20.0,
    **dict.fromkeys(("commercial", "office", "hotel", "hospital"), 30.0),
    **dict.fromkeys(("church", "mosque", "temple", "stadium"), 35.0),
    "cathedral": 100.0,
    "bell_tower": 60.0,
    "skyscraper": 300.0,
}
"""Height of a building without height and levels, by its kind: a guess on the high side."""

GUESSED_OTHER_M = 10.0

_HIGHEST_M = 1_000.0
_LEVELS = re.compile(r"\d{1,3}(?:[.,]\d+)?")
_HEIGHTS = ("height", "height_m", "building:height", "est_height", "height:hub")
_STANDING_STILL = ("disused:", "abandoned:", "ruins:", "construction:")
"""Prefixes of what is out of use, or not yet in it, but stands."""


class Tagged(NamedTuple):
    """What a tag stands for.

    Attributes:
        kind: Of the obstacle that it becomes.
        half_width_m: Of a line, or the radius of a point; areas have an outline of their own [m].
        guessed_m: Its height, where no tag says it: a guess on the high side; NaN: none [m].
        along: Whether it stands along its line even where that is closed.
    """

    kind: str
    half_width_m: float
    guessed_m: float
    along: bool = False


_WOOD = Tagged(FOREST, 0.0, 30.0)
_BUILDING_POINT_M = 10.0
STANDING: Mapping[tuple[str, str], Tagged] = {
    ("natural", "wood"): _WOOD,
    ("landuse", "forest"): _WOOD,
    ("natural", "tree"): Tagged(FOREST, 4.0, 20.0),
    ("natural", "tree_row"): Tagged(FOREST, 4.0, 20.0, along=True),
    ("power", "line"): Tagged(POWER_LINE, 10.0, 60.0, along=True),
    ("power", "tower"): Tagged(POWER_LINE, 10.0, 60.0),
    ("power", "portal"): Tagged(POWER_LINE, 10.0, 30.0),
    ("power", "minor_line"): Tagged(POWER_LINE, 3.0, 15.0, along=True),
    ("power", "pole"): Tagged(POWER_LINE, 3.0, 15.0),
    ("power", "catenary_mast"): Tagged(POWER_LINE, 3.0, 12.0),
    ("power", "substation"): Tagged(POWER_LINE, 10.0, 20.0),
    ("telecom", "line"): Tagged(POWER_LINE, 3.0, 15.0, along=True),
    ("communication", "line"): Tagged(POWER_LINE, 3.0, 15.0, along=True),
    ("aerialway", "cable_car"): Tagged(POWER_LINE, 10.0, 150.0, along=True),
    ("aerialway", "gondola"): Tagged(POWER_LINE, 10.0, 60.0, along=True),
    ("aerialway", "pylon"): Tagged(MAST, 5.0, 60.0),
    ("aerialway", "station"): Tagged(BUILDING, _BUILDING_POINT_M, 20.0),
    ("aerialway", "*"): Tagged(POWER_LINE, 8.0, 30.0, along=True),
    ("generator:source", "wind"): Tagged(MAST, 80.0, 250.0),
    ("generator:method", "wind_turbine"): Tagged(MAST, 80.0, 250.0),
    ("man_made", "wind_turbine"): Tagged(MAST, 80.0, 250.0),
    ("man_made", "mast"): Tagged(MAST, 3.0, 100.0),
    ("man_made", "antenna"): Tagged(MAST, 3.0, 60.0),
    ("man_made", "tower"): Tagged(MAST, 5.0, 100.0),
    ("man_made", "communications_tower"): Tagged(MAST, 10.0, 250.0),
    ("man_made", "cooling_tower"): Tagged(MAST, 50.0, 180.0),
    ("man_made", "chimney"): Tagged(MAST, 5.0, 100.0),
    ("man_made", "crane"): Tagged(MAST, 30.0, 80.0),
    ("man_made", "gantry"): Tagged(MAST, 5.0, 15.0, along=True),
    ("man_made", "flare"): Tagged(MAST, 5.0, 100.0),
    ("man_made", "gasometer"): Tagged(MAST, 30.0, 100.0),
    ("man_made", "storage_tank"): Tagged(MAST, 20.0, 30.0),
    ("man_made", "water_tower"): Tagged(MAST, 10.0, 50.0),
    ("man_made", "silo"): Tagged(MAST, 5.0, 30.0),
    ("man_made", "bunker_silo"): Tagged(MAST, 5.0, 10.0),
    ("man_made", "kiln"): Tagged(MAST, 10.0, 30.0),
    ("man_made", "mineshaft"): Tagged(MAST, 10.0, 80.0),
    ("man_made", "lighthouse"): Tagged(MAST, 5.0, 70.0),
    ("man_made", "beacon"): Tagged(MAST, 3.0, 30.0),
    ("man_made", "flagpole"): Tagged(MAST, 2.0, 30.0),
    ("man_made", "obelisk"): Tagged(MAST, 5.0, 50.0),
    ("man_made", "cross"): Tagged(MAST, 3.0, 20.0),
    ("man_made", "windmill"): Tagged(MAST, 15.0, 40.0),
    ("man_made", "windpump"): Tagged(MAST, 4.0, 20.0),
    ("man_made", "telescope"): Tagged(MAST, 30.0, 60.0),
    ("man_made", "observatory"): Tagged(MAST, 15.0, 30.0),
    ("man_made", "monitoring_station"): Tagged(MAST, 3.0, 15.0),
    ("man_made", "utility_pole"): Tagged(MAST, 2.0, 15.0),
    ("man_made", "offshore_platform"): Tagged(MAST, 60.0, 120.0),
    ("man_made", "petroleum_well"): Tagged(MAST, 10.0, 50.0),
    ("man_made", "pumping_rig"): Tagged(MAST, 10.0, 15.0),
    ("man_made", "goods_conveyor"): Tagged(STRUCTURE, 5.0, 40.0, along=True),
    ("man_made", "bridge"): Tagged(STRUCTURE, 10.0, 30.0),
    ("aeroway", "control_tower"): Tagged(MAST, 10.0, 100.0),
    ("advertising", "totem"): Tagged(MAST, 3.0, 30.0),
    ("advertising", "billboard"): Tagged(MAST, 5.0, 15.0),
    ("attraction", "big_wheel"): Tagged(MAST, 40.0, 100.0),
    ("attraction", "roller_coaster"): Tagged(MAST, 5.0, 80.0),
    ("barrier", "city_wall"): Tagged(STRUCTURE, 3.0, 15.0, along=True),
    ("historic", "tower"): Tagged(MAST, 8.0, 50.0),
    ("historic", "monument"): Tagged(MAST, 10.0, 50.0),
}
"""Key and value (`*`: any other) of a tag -> what stands there; buildings are told by any value."""

LOW: Mapping[str, tuple[str, ...]] = {
    "man_made": (
        *("adit", "breakwater", "cairn", "clearcut", "courtyard", "cutline", "dyke", "embankment"),
        *("geoglyph", "groyne", "manhole", "outfall", "pier", "pipeline", "planter", "quay"),
        *("reservoir_covered", "spoil_heap", "street_cabinet", "surveillance", "survey_point"),
        *("tunnel", "wastewater_plant", "water_tap", "water_well", "water_works"),
        *("wildlife_hide", "works"),
    ),
    "power": (
        *("cable", "compensator", "converter", "generator", "plant", "switch", "switchgear"),
        *("terminal", "transformer", "connection", "cable_distribution_cabinet", "heliostat"),
    ),
}
"""Values of keys whose values are mostly tall, that are not."""

MET_TALL: Mapping[tuple[str, str], str] = {
    ("highway", "street_lamp"): "12 m",
    ("electrified", "contact_line"): "wires 8 m over a railway",
}
"""Tall kinds that are not read unless a height is tagged, and about how high they are."""

STREETS_M: Mapping[str, float] = {
    **dict.fromkeys(("motorway", "trunk"), 7.0),
    **dict.fromkeys(("motorway_link", "primary", "secondary"), 4.5),
    **dict.fromkeys(("tertiary", "residential", "living_street", "unclassified"), 3.0),
    "service": 2.0,
}
"""Half the width of a street that is drawn, by the tag `highway` [m]."""

KEYS = tuple(
    dict.fromkeys(
        prefix + key
        for prefix in ("", *_STANDING_STILL)
        for key in (
            *("building", "building:part", "building:levels", *_HEIGHTS, "role"),
            *(key for key, _ in (*STANDING, *MET_TALL)),
        )
    )
)
"""Keys of which a thing on a map has at least one where it may stand."""

OTHER = Tagged(STRUCTURE, 5.0, math.nan)
"""What is told by its height alone."""


def plain_tags(tags: Mapping[str, Any]) -> dict[str, Any]:
    """Keys in small letters, and without the prefix of what is out of use but stands.

    Of two that differ by case alone the small one counts; names and roles count both.
    """
    found: dict[str, Any] = {}
    for key, value in tags.items():
        lower = str(key).strip().lower()
        if value in (None, ""):
            continue
        if lower in ("name", "role") and found.get(lower, value) != value:
            value = f"{found[lower]} / {value}"
        if key == lower or lower not in found or lower in ("name", "role"):
            found[lower] = value
    for key in list(found):
        for prefix in _STANDING_STILL:
            if key.startswith(prefix):
                found.setdefault(key.removeprefix(prefix), found[key])
    return found


def standing_of(tags: Mapping[str, Any]) -> Tagged | None:
    """What stands there, the highest where tags say several; None: nothing that is known to.

    Args:
        tags: With plain keys.
    """
    found = [*_kinds(tags)]
    for key in ("building", "building:part"):
        for value in _values(tags, key):
            if value != "no":
                also = STANDING.get(("man_made", value), OTHER).guessed_m
                guessed_m = GUESSED_M.get(value, GUESSED_OTHER_M if math.isnan(also) else also)
                found.append(Tagged(BUILDING, _BUILDING_POINT_M, guessed_m))
    if not found and height_m(tags, 0.0)[0] >= LEAST_M:
        return OTHER
    return max(found, key=lambda what: what.guessed_m, default=None)


def not_read(tags: Mapping[str, Any]) -> str | None:
    """The tag of what may be tall and is not known; None: there is none."""
    for key, low in LOW.items():
        for value in _values(tags, key):
            if value not in (*low, "no"):
                return f"{key}={value[:40]}"
    return next((f"{k}={v}" for k, v in MET_TALL if v in _values(tags, k)), None)


def _kinds(tags: Mapping[str, Any]) -> Iterator[Tagged]:
    for key in dict.fromkeys(key for key, _ in STANDING):
        for value in _values(tags, key):
            what = STANDING.get((key, value))
            what = what or (STANDING.get((key, "*")) if value != "no" else None)
            if what is not None:
                yield what


def _values(tags: Mapping[str, Any], key: str) -> list[str]:
    given = tags.get(key)
    if not isinstance(given, str):
        return ["yes"] if given else []
    return [value.strip().lower().replace(" ", "_") for value in given.split(";") if value.strip()]


def height_m(
    tags: Mapping[str, Any], guessed_m: float, unread: Counter[str] | None = None
) -> tuple[float, bool]:
    """Height of the top above the ground, and whether the tags say it.

    `height` counts before `building:levels`; texts are read as `length_m` does. To what a wind
    turbine's tags say of its height half its rotor is added.

    Args:
        tags: Of OpenStreetMap, with plain keys.
        guessed_m: The height where they do not say it [m].
        unread: Counts the tags that cannot be read.
    """
    for key in _HEIGHTS:
        if key in tags:
            value = length_m(tags[key])
            if 0.0 < value <= _HIGHEST_M:
                rotor_m = length_m(tags.get("rotor:diameter"))
                return value + (0.5 * rotor_m if 0.0 < rotor_m <= _HIGHEST_M else 0.0), True
            if unread is not None:
                unread[f"{key}={str(tags[key])[:40]}"] += 1
    levels = _levels("building:levels", tags, unread)
    if 0.0 < levels <= _HIGHEST_M / STOREY_M:
        roof = _levels("roof:levels", tags, unread)
        roof_m = ROOF_M if math.isnan(roof) else roof * STOREY_M
        return levels * STOREY_M + max(roof_m, _positive_m(tags.get("roof:height"))), True
    return guessed_m, False


def half_width_m(tags: Mapping[str, Any], what: Tagged) -> float:
    """Of a line, or the radius of a point: of the kind, or as tagged where that is more [m]."""
    diameters = (tags.get(key) for key in ("diameter", "width", "rotor:diameter"))
    radii = (_positive_m(tags.get(key)) for key in ("radius_m", "radius"))
    return max(what.half_width_m, *(0.5 * _positive_m(one) for one in diameters), *radii)


def _positive_m(given: Any) -> float:
    value = length_m(given)
    return value if 0.0 < value <= _HIGHEST_M else 0.0


def _levels(key: str, tags: Mapping[str, Any], unread: Counter[str] | None) -> float:
    if key not in tags:
        return math.nan
    text = str(tags[key]).strip()
    found = [] if text.startswith("-") else _LEVELS.findall(text)
    if not found and unread is not None:
        unread[f"{key}={text[:40]}"] += 1
    return max((float(one.replace(",", ".")) for one in found), default=math.nan)
