"""What the numbers of an observation are divided by, and how many neighbours are in it."""

import math

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.compiled.memory import record_dtype
from uas_coverage_env.scenario import Scenario

K_WAYPOINTS = 12
"""Open waypoints in an observation, nearest first; the waypoint action chooses among them."""

AT_ONCE = 16
"""So many of them the processor takes at once; those beyond K_WAYPOINTS are left out."""

K_UAS = 3
"""Other UAS in an observation, nearest first."""

K_MOVING = 2
"""Moving obstacles in an observation, nearest first."""

N_RAYS = 10
"""Eight horizontal rays from north over east, then up and down."""

NEARBY_M = 30.0
"""Distances d appear as 1/(1 + d/NEARBY_M): fine near by, coarse far away [m]."""

RAY_M = 80.0
"""How far a ray looks [m]."""

HEIGHT_M = 20.0
"""Scale of heights relative to the UAS, and of clearances [m]."""

FAR_M = 250.0
"""Scale of the way to the centre of what is left [m]."""

DENSITY_M = 100.0
"""Open waypoints within this distance of a waypoint count for how dense they are there [m]."""

DENSEST = 8
"""As many of them count at most."""

MARGIN = 0.3
"""Scale of energy margins, as depth of discharge."""

SCALES = {
    "nearby_m": NEARBY_M,
    "ray_m": RAY_M,
    "height_m": HEIGHT_M,
    "far_m": FAR_M,
    "density_m": DENSITY_M,
    "density": float(DENSEST),
    "margin": MARGIN,
}
"""All of the scales above by name: a policy that was trained with others sees another world."""

SCALES_DTYPE = record_dtype(
    [
        # one over the limits of the vehicle
        ("per_v_xy", "f8"),
        ("per_v_z", "f8"),
        ("per_tilt", "f8"),
        ("per_yaw", "f8"),
        ("per_rate", "f8"),
        ("per_yaw_rate", "f8"),
        ("rank", "f8"),
        # the box around the fence: its centre and one over half its sides
        ("centre_m", "f8", (3,)),
        ("per_half_side", "f8", (3,)),
        # one over the heaviest weight
        ("per_heaviest", "f8"),
        # depth of discharge that it starts with
        ("start_dod", "f8"),
    ]
)
"""What one UAS's numbers are divided by."""


def scales_of(scenario: Scenario) -> NDArray[np.void]:
    """The scales of all UAS.

    Returns:
        (U,) of SCALES_DTYPE.
    """
    corners_m = scenario.fence.vertices_m
    low_m, high_m = corners_m.min(axis=0), corners_m.max(axis=0)
    weights = [waypoint.weight for waypoint in scenario.waypoints]
    scales = np.zeros(len(scenario.uas), dtype=SCALES_DTYPE)
    fleet = zip(scales, scenario.uas, scenario.vehicles, strict=True)
    for i, (scale, uas, vehicle) in enumerate(fleet):
        limits = vehicle.limits
        scale["per_v_xy"] = 1 / limits.v_xy_max_mps
        scale["per_v_z"] = 1 / max(limits.v_up_max_mps, limits.v_down_max_mps)
        scale["per_tilt"] = 1 / limits.tilt_max_rad
        scale["per_yaw"] = 1 / (math.pi if uas.heading == "course" else limits.yaw_max_rad)
        scale["per_rate"] = 1 / limits.rate_max_radps
        scale["per_yaw_rate"] = 1 / limits.yaw_rate_max_radps
        scale["rank"] = i / max(1, len(scales) - 1)
        scale["centre_m"] = (low_m + high_m) / 2
        scale["per_half_side"] = 2 / (high_m - low_m)
        scale["per_heaviest"] = 1 / max(weights)
        scale["start_dod"] = 1 - uas.soc_0
    return scales
