"""QGroundControl plans: what they survey, structures, fences and the planned home."""

from collections.abc import Iterator, Mapping
from itertools import count
from pathlib import Path
from typing import Any, NamedTuple

from uas_coverage_env.files.errors import InputError
from uas_coverage_env.operations.area_import.geo_features import GeoFeature
from uas_coverage_env.operations.area_import.readers.geojson import read_json

PX4 = 12
"""`firmwareType` of PX4, whose vehicles stay in any of several fences; others stay in all."""


class Item(NamedTuple):
    """A complex item of a mission.

    Attributes:
        becomes: What is made of it.
        geometry: The key of its outline, and of what this is in GeoJSON.
        role: As in the table of roles.
        attributes: Attribute -> key of the item that holds it.
    """

    becomes: str
    geometry: tuple[str, str]
    role: str
    attributes: Mapping[str, str]


ITEMS: Mapping[str, Item] = {
    "survey": Item("an area to search", ("polygon", "Polygon"), "search", {}),
    "CorridorScan": Item(
        "the strip along its polyline is an area to search",
        ("polyline", "LineString"),
        "search",
        {"width": "CorridorWidth"},
    ),
    "StructureScan": Item(
        "an obstacle as high as its `StructureHeight`; to look at it, draw an area around it",
        ("polygon", "Polygon"),
        "obstacle",
        {"height": "StructureHeight"},
    ),
}
"""`complexItemType` -> what becomes of it; others are left out and named."""


def read_plan(path: Path) -> Iterator[GeoFeature]:
    """What is surveyed, structures, fences, exclusions, and the planned home.

    A plan without a survey is searched within its fences.

    Raises:
        InputError: The file cannot be used.
    """
    plan = read_json(path)
    if plan.get("fileType") != "Plan":
        raise InputError(f"{path}: is no QGroundControl plan; save it from QGroundControl")
    try:
        yield from _features(str(path), plan)
    except (KeyError, TypeError, AttributeError, IndexError, ValueError):
        raise InputError(f"{path}: is a broken QGroundControl plan; save it again") from None


def _features(file: str, plan: Mapping[str, Any]) -> Iterator[GeoFeature]:
    mission = plan.get("mission") or {}
    complex_items = False
    counts: dict[str, Iterator[int]] = {}
    for item in mission.get("items") or ():
        kind = item.get("complexItemType") if item.get("type") != "SimpleItem" else None
        if kind is None:
            kind = "polygon" if "polygon" in item else None  # a survey of an old plan
        what = ITEMS.get("survey" if kind in ("polygon", "Survey") else str(kind))
        if what is None:
            yield GeoFeature(file, "a mission item", None, {}, what=str(kind or "mission item"))
            continue
        complex_items = True
        word = kind if kind in ITEMS else "survey"
        name = f"{word}_{next(counts.setdefault(word, count(1)))}"
        key, shape = what.geometry
        places = _turned(item.get(key) or ())
        said = {own: item[theirs] for own, theirs in what.attributes.items() if theirs in item}
        yield GeoFeature(
            file,
            name,
            {"type": shape, "coordinates": [places] if shape == "Polygon" else places},
            {"role": what.role, **said},
            fallback=name,
            along=shape == "LineString",
        )
    yield from _fences(file, plan, alone=not complex_items)
    home = mission.get("plannedHomePosition")
    if home:
        height_m = home[2] if len(home) > 2 else None
        known = isinstance(height_m, int | float) and not isinstance(height_m, bool)
        yield GeoFeature(
            file,
            "planned home",
            {"type": "Point", "coordinates": _turned([home])[0]},
            {"name": "planned home", "role": "home"},
            ground_m=float(height_m) if known else None,
        )
    for _ in (plan.get("rallyPoints") or {}).get("points") or ():
        yield GeoFeature(file, "a rally point", None, {}, what="rally point")


def _fences(file: str, plan: Mapping[str, Any], *, alone: bool) -> Iterator[GeoFeature]:
    """Inclusions and exclusions; alone: what they include is searched, too."""
    fence = plan.get("geoFence") or {}
    px4 = (plan.get("mission") or {}).get("firmwareType") == PX4
    found = [("fence", one, one["polygon"], None) for one in fence.get("polygons") or ()]
    if fence.get("polygon"):  # of plans before 2018
        found.append(("fence", {"inclusion": True}, fence["polygon"], None))
    for one in fence.get("circles") or ():
        circle = one["circle"]
        found.append(("circle", one, [circle["center"]], circle["radius"]))
    numbers = {"fence": count(1), "circle": count(1)}
    for word, one, corners, radius_m in found:
        name = f"{word}_{next(numbers[word])}"
        places = _turned(corners)
        geometry: dict[str, Any] = {"type": "Polygon", "coordinates": [places]}
        said: dict[str, Any] = {}
        if word == "circle":
            geometry = {"type": "Point", "coordinates": places[0]}
            said = {"radius_m": radius_m}
        inside = ("fence", "search") if alone else ("fence",)
        for role in inside if one.get("inclusion") else ("no_fly",):
            yield GeoFeature(
                file,
                name,
                geometry,
                {"role": role, **said},
                fallback=name,
                together=f"{file}, any of them" if px4 else "",
            )


def _turned(places: Any) -> list[list[Any]]:
    """QGroundControl writes latitude first."""
    return [[longitude, latitude] for latitude, longitude, *_ in places]
