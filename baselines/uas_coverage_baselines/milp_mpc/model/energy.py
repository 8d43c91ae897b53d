"""What the way home takes, linear in the place: flight time, estimated on the safe side.

How far on the safe side: docs/range.md. What a second takes from the battery is `dod_per_s` of the
vehicle, at the depth of discharge at which the flight has to end.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.vehicle import VehicleParams

DETOUR = 1.1
"""The way around what stands between, over the straight one."""
SPEED_SHARE = 0.9
"""Of the speed limit, kept up on average."""
LANDING_S = 6.0
"""Coming to rest above the landing site."""


def seconds_home(vehicle: VehicleParams, away_m: NDArray[np.float64]) -> float:
    """Flight time home at nearly full speed, with a detour and the landing [s].

    Args:
        vehicle: that flies.
        away_m: (3,) from its home to where it is, or back.
    """
    limits = vehicle.limits
    level = DETOUR * float(np.hypot(away_m[0], away_m[1])) / (SPEED_SHARE * limits.v_xy_max_mps)
    return level + abs(float(away_m[2])) / limits.v_down_max_mps + LANDING_S
