"""What QGroundControl asks of a plan when it loads one, in our own words, for the tests.

After MissionController, MissionItem, SimpleMissionItem, GeoFenceController and RallyPointController
of QGroundControl (2026); and what no program refuses although the vehicle would fly elsewhere.
"""

import json
from typing import Any

WITH_PLACE = {16, 17, 18, 19, 21, 22, 82}
FRAMES = {0, 3, 10}


def problems(text: str) -> list[str]:
    """Why a plan is not loaded as it is meant; empty where all is well."""
    plan = json.loads(text, parse_constant=lambda name: 1 / 0)
    found = []
    if (plan.get("fileType"), plan.get("version")) != ("Plan", 1):
        found.append("no plan of version 1")
    if not isinstance(plan.get("groundStation"), str):
        found.append("groundStation")
    mission, fence, rally = plan["mission"], plan["geoFence"], plan["rallyPoints"]
    if (mission.get("version"), fence.get("version"), rally.get("version")) != (2, 2, 2):
        found.append("versions of mission, fence and rally points")
    if not _is_place(mission.get("plannedHomePosition"), 3):
        found.append("plannedHomePosition")
    if not isinstance(mission.get("firmwareType"), int):
        found.append("firmwareType")
    for n, item in enumerate(mission["items"]):
        found += [f"items[{n}]: {problem}" for problem in _of_item(n, item)]
    for n, polygon in enumerate(fence["polygons"]):
        good = polygon.get("version") == 1 and isinstance(polygon.get("inclusion"), bool)
        corners = polygon.get("polygon") or []
        if not good or len(corners) < 3 or not all(_is_place(c, 2) for c in corners):
            found.append(f"polygons[{n}]")
    if fence.get("circles") is None:
        found.append("circles")
    found += [f"points[{n}]" for n, p in enumerate(rally["points"]) if not _is_place(p, 3)]
    return found


def _of_item(n: int, item: dict[str, Any]) -> list[str]:
    params = item.get("params")
    if item.get("type") != "SimpleItem" or not isinstance(params, list) or len(params) != 7:
        return ["no simple item with seven params"]
    found = []
    if not isinstance(item.get("autoContinue"), bool) or item.get("doJumpId") != n + 1:
        found.append("autoContinue or doJumpId")
    if not all(p is None or _is_number(p) for p in params):
        found.append("a param is neither number nor null")
    if item.get("command") in WITH_PLACE:
        if not _is_place(params[4:], 3) or item.get("frame") not in FRAMES:
            found.append("no place")
        if not {"Altitude", "AltitudeMode", "AMSLAltAboveTerrain"} <= set(item):
            found.append("altitude keys")
        elif item["Altitude"] != params[6]:
            found.append("QGroundControl would fly another altitude than others")
    return found


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


def _is_place(value: Any, size: int) -> bool:
    return (
        isinstance(value, list)
        and len(value) == size
        and all(map(_is_number, value))
        and abs(value[0]) <= 90.0
        and abs(value[1]) <= 180.0
    )
