"""QGroundControl plans (.plan): mission, geofence and rally point."""

import json
import math
from typing import Any

from uas_coverage_env.operations.mission_export.formats.geofence import polygons_of
from uas_coverage_env.operations.mission_export.formats.mission_items import (
    ALTITUDE,
    LATITUDE,
    LONGITUDE,
    RELATIVE_FRAME,
    Item,
    items_of,
)
from uas_coverage_env.operations.mission_export.mission_file import MissionFile
from uas_coverage_env.operations.mission_export.tracks import Tolerances
from uas_coverage_env.scenario import Scenario

_ARDUPILOT, _PX4 = 3, 12
"""MAV_AUTOPILOT."""

_VEHICLE_TYPES = {4: 2, 6: 13, 8: 14}
"""MAV_TYPE by number of motors: quadrotor, hexarotor, octorotor."""

_RELATIVE_ALTITUDE = 1


def plan_text(scenario: Scenario, one: MissionFile, tolerances: Tolerances, *, px4: bool) -> str:
    """The text of a plan.

    Args:
        scenario: The mission, with its fence and no-fly zones.
        one: The UAS.
        tolerances: How far from a corner it may pass.
        px4: Whether PX4 flies it; else, ArduPilot.
    """
    home, landing = (
        [round(degrees, 8) for degrees in one.geodetic(place_m)[:2].tolist()]
        for place_m in (one.track.home_m, one.track.landing_m)
    )
    height_m = one.home.height_m
    return_m = -float(one.track.take_off_m[2]) if height_m is None else height_m
    items = items_of(one, tolerances.corner_m, px4=px4)
    polygons = [
        {"version": 1, "inclusion": inside, "polygon": corners}
        for corners, inside in polygons_of(scenario, one)
    ]
    plan = {
        "fileType": "Plan",
        "version": 1,
        "groundStation": "QGroundControl",
        "mission": {
            "version": 2,
            "firmwareType": _PX4 if px4 else _ARDUPILOT,
            "vehicleType": _VEHICLE_TYPES.get(one.vehicle.airframe.n_motors, 2),
            "cruiseSpeed": 15,
            "hoverSpeed": round(one.speeds_mps[0], 2),
            "globalPlanAltitudeMode": _RELATIVE_ALTITUDE,
            "plannedHomePosition": [*home, round(one.frame.place.height_m, 3)],
            "items": [_simple(item, n + 1) for n, item in enumerate(items)],
        },
        "geoFence": {"version": 2, "circles": [], "polygons": polygons},
        "rallyPoints": {"version": 2, "points": [[*landing, round(return_m, 3)]]},
    }
    return json.dumps(plan, indent=1, allow_nan=False) + "\n"


def _simple(item: Item, number: int) -> dict[str, Any]:
    params = [
        None if math.isnan(value) else round(value, 8 if k in (LATITUDE, LONGITUDE) else 3)
        for k, value in enumerate(item.params)
    ]
    entry = {
        "type": "SimpleItem",
        "autoContinue": True,
        "command": item.command,
        "doJumpId": number,
        "frame": item.frame,
        "params": params,
    }
    if item.frame == RELATIVE_FRAME:
        # QGroundControl shows and flies Altitude, others the last of params: both are the same
        entry |= {
            "Altitude": params[ALTITUDE],
            "AltitudeMode": _RELATIVE_ALTITUDE,
            "AMSLAltAboveTerrain": None,
        }
    return entry
