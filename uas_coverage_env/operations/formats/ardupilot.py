"""ArduPilot: waypoint files (QGC WPL 110) and the parameters that no mission file holds."""

import math

from uas_coverage_env.operations.exported import Exported
from uas_coverage_env.operations.formats.items import ALTITUDE, LATITUDE, LONGITUDE, items_of
from uas_coverage_env.operations.tracks import Tolerances
from uas_coverage_env.scenario import Scenario

_CEILING_AND_POLYGONS = 5
_SMART_RTL_OR_LAND, _RTL_OR_LAND = 5, 1
_SMART_RTL = 3
_YAW_AS_TOLD, _YAW_ALONG_COURSE = 0, 3


def waypoints_text(one: Exported, tolerances: Tolerances) -> str:
    """The text of a .waypoints file; its first line is home.

    Args:
        one: The UAS.
        tolerances: How far from a corner it may pass.
    """
    latitude, longitude, _ = one.geodetic(one.track.home_m).tolist()
    place = f"{latitude:.8f}\t{longitude:.8f}\t{one.frame.place.height_m:.3f}"
    lines = ["QGC WPL 110", f"0\t1\t0\t16\t0\t0\t0\t0\t{place}\t1"]
    for n, item in enumerate(items_of(one, tolerances.corner_m), 1):
        numbers = [0.0 if math.isnan(value) else value for value in item.params]
        first = "\t".join(f"{value:.3f}" for value in numbers[:LATITUDE])
        place = f"{numbers[LATITUDE]:.8f}\t{numbers[LONGITUDE]:.8f}\t{numbers[ALTITUDE]:.3f}"
        lines.append(f"{n}\t0\t{item.frame}\t{item.command}\t{first}\t{place}\t1")
    return "\n".join(lines) + "\n"


def parameters_text(scenario: Scenario, one: Exported, tolerances: Tolerances) -> str:
    """The text of a .param file: speeds, fence, and what to do at low charge.

    Args:
        scenario: The mission.
        one: The UAS.
        tolerances: How far from a corner it may pass.
    """
    limits = one.vehicle.limits
    values = {
        "WPNAV_SPEED": 100.0 * limits.v_xy_max_mps,
        "WPNAV_SPEED_UP": 100.0 * limits.v_up_max_mps,
        "WPNAV_SPEED_DN": 100.0 * limits.v_down_max_mps,
        "WPNAV_RADIUS": 100.0 * tolerances.corner_m,
        "WP_YAW_BEHAVIOR": _YAW_ALONG_COURSE if one.looks_ahead else _YAW_AS_TOLD,
        "FENCE_ENABLE": 1,
        "FENCE_TYPE": _CEILING_AND_POLYGONS,  # the default adds a circle of 300 m around home
        "FENCE_ALT_MAX": -float(scenario.fence.vertices_m[:, 2].min()),
        "BATT_FS_LOW_ACT": _SMART_RTL,  # back the way it came, where it remembers that
    }
    if one.track.lands_elsewhere:
        values["RALLY_INCL_HOME"] = 0  # it is closed
    if one.waits.start_s:
        values["DISARM_DELAY"] = 0  # it would disarm while it waits on the ground
    if one.return_m is None:
        values["FENCE_ACTION"] = _SMART_RTL_OR_LAND  # flying straight home is not clear
    else:
        values |= {
            "RTL_ALT": 100.0 * one.return_m,
            "RTL_CONE_SLOPE": 0,  # the cone would let it fly home lower
            "FENCE_ACTION": _RTL_OR_LAND,
        }
    return "".join(f"{name},{value:g}\n" for name, value in values.items())
