"""QGroundControl plans (.plan): mission, geofence and rally point."""

import json
import math
from typing import Any

import numpy as np
import shapely

from uas_coverage_env.operations.convex import hull_of
from uas_coverage_env.operations.exported import Exported
from uas_coverage_env.operations.formats.items import (
    ALTITUDE,
    LATITUDE,
    LONGITUDE,
    RELATIVE_FRAME,
    Item,
    items_of,
)
from uas_coverage_env.operations.tracks import Tolerances
from uas_coverage_env.scenario import Scenario

FIRMWARE = {"ardupilot": 3, "px4": 12}
"""MAV_AUTOPILOT."""

_VEHICLE_TYPES = {4: 2, 6: 13, 8: 14}
"""MAV_TYPE by number of motors: quadrotor, hexarotor, octorotor."""

_RELATIVE_ALTITUDE = 1
ZONES = ("no_fly", "outside_fence")
"""Kinds of obstacles at which nothing stands: where no UAS may fly."""


def plan_text(scenario: Scenario, one: Exported, tolerances: Tolerances, autopilot: str) -> str:
    """The text of a plan.

    Args:
        scenario: The mission, with its fence and no-fly zones.
        one: The UAS.
        tolerances: How far from a corner it may pass.
        autopilot: Key of `FIRMWARE`.
    """
    home, landing = (
        [round(degrees, 8) for degrees in one.geodetic(place_m)[:2].tolist()]
        for place_m in (one.track.home_m, one.track.landing_m)
    )
    return_m = one.return_m if one.return_m is not None else -float(one.track.take_off_m[2])
    plan = {
        "fileType": "Plan",
        "version": 1,
        "groundStation": "QGroundControl",
        "mission": {
            "version": 2,
            "firmwareType": FIRMWARE[autopilot],
            "vehicleType": _VEHICLE_TYPES.get(one.vehicle.airframe.n_motors, 2),
            "cruiseSpeed": 15,
            "hoverSpeed": round(one.speeds_mps[0], 2),
            "globalPlanAltitudeMode": _RELATIVE_ALTITUDE,
            "plannedHomePosition": [*home, round(one.frame.place.height_m, 3)],
            "items": [
                _simple(item, n + 1) for n, item in enumerate(items_of(one, tolerances.corner_m))
            ],
        },
        "geoFence": {"version": 2, "circles": [], "polygons": _polygons(scenario, one)},
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


def _polygons(scenario: Scenario, one: Exported) -> list[dict[str, Any]]:
    """The fence to stay in and the no-fly zones to stay out of."""
    bodies = [(scenario.fence.vertices_m, True)]
    bodies += [
        (hull.vertices_m, False)
        for obstacle, hull in zip(scenario.obstacles, scenario.hulls, strict=True)
        if obstacle.kind in ZONES
    ]
    found = []
    for vertices_m, inclusion in bodies:
        ring = hull_of(shapely.MultiPoint(vertices_m[:, :2])).exterior.coords[:-1]
        places = one.geodetic([(*corner, 0.0) for corner in ring])
        corners = np.round(places[:, :2], 8).tolist()
        found.append({"version": 1, "inclusion": inclusion, "polygon": corners})
    return found
