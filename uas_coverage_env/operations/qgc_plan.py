"""QGroundControl plans as drawings: survey areas, fences and the planned home."""

import math
from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import pyproj

from uas_coverage_env.files.errors import InputError
from uas_coverage_env.operations.drawing import Drawn, polygon, take_off
from uas_coverage_env.operations.geojson import read_json

_CIRCLE_CORNERS = 32
_SURVEYS = ("survey", "CorridorScan", "StructureScan")


def read_plan(path: Path) -> Iterator[Drawn]:
    """Survey areas to search, fences, exclusions, and the planned home to take off.

    A plan without a survey is searched within its fences.

    Raises:
        InputError: The file cannot be used.
    """
    plan = read_json(path)
    if plan.get("fileType") != "Plan":
        raise InputError(f"{path}: is no QGroundControl plan; save it from QGroundControl")
    try:
        yield from _drawn(str(path), plan)
    except (KeyError, TypeError, AttributeError, IndexError):
        raise InputError(f"{path}: is a broken QGroundControl plan; save it again") from None


def _drawn(source: str, plan: Mapping[str, Any]) -> Iterator[Drawn]:
    mission = plan.get("mission") or {}
    items = [item for item in mission.get("items") or () if "polygon" in item]
    surveys = [item for item in items if item.get("complexItemType") in _SURVEYS]
    for number, item in enumerate(surveys):
        rings = [_turned(item["polygon"])]
        yield polygon(source, rings, {"role": "search"}, f"survey_{number + 1}")
    fence = plan.get("geoFence") or {}
    inside = "fence" if surveys else "search"
    for number, entry in enumerate(fence.get("polygons") or ()):
        role = inside if entry.get("inclusion") else "no_fly"
        rings = [_turned(entry["polygon"])]
        yield polygon(source, rings, {"role": role}, f"fence_{number + 1}")
    for number, entry in enumerate(fence.get("circles") or ()):
        role = inside if entry.get("inclusion") else "no_fly"
        rings = [_circle(source, entry["circle"], around=role == "no_fly")]
        yield polygon(source, rings, {"role": role}, f"circle_{number + 1}")
    home = mission.get("plannedHomePosition")
    if home:
        place = take_off(source, _turned([home])[0], {"name": "planned home"})
        height_m = home[2] if len(home) > 2 else None
        if isinstance(height_m, int | float) and not isinstance(height_m, bool):
            place = replace(place, height_m=float(height_m))
        yield place


def _turned(places: Any) -> list[tuple[Any, Any]]:
    """QGroundControl writes latitude first."""
    return [(longitude, latitude) for latitude, longitude, *_ in places]


def _circle(source: str, circle: Mapping[str, Any], *, around: bool) -> list[tuple[float, float]]:
    """Corners of a polygon in a circle, or around it."""
    centre = take_off(source, _turned([circle["center"]])[0], {"name": "circle"})
    radius_m = circle["radius"]
    if not isinstance(radius_m, int | float) or not 0.0 < radius_m <= 100_000.0:
        raise InputError(f"{source}: circle of radius {str(radius_m)[:40]}; draw it again")
    if around:
        radius_m /= math.cos(math.pi / _CIRCLE_CORNERS)
    geodesics = pyproj.Geod(ellps="WGS84")
    corners = []
    for k in range(_CIRCLE_CORNERS):
        longitude, latitude, _ = geodesics.fwd(
            centre.longitude_deg, centre.latitude_deg, k * 360.0 / _CIRCLE_CORNERS, radius_m
        )
        corners.append((longitude, latitude))
    return corners
