"""What the way home takes: flight time and charge, estimated on the safe side."""

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
PACE = 1.1
"""Power on the way over power in hover."""


def dod_per_s(vehicle: VehicleParams) -> float:
    """Depth of discharge that a second of cruising takes [1/s]."""
    energy_J = 3600.0 * vehicle.battery.capacity_Ah * vehicle.battery.voltage_nominal_V
    return PACE * vehicle.power.hover_W / energy_J


def seconds_home(vehicle: VehicleParams, away_m: NDArray[np.float64]) -> float:
    """Flight time home at nearly full speed, with a detour and the landing [s].

    Args:
        vehicle: that flies.
        away_m: (3,) from its home to where it is, or back.
    """
    limits = vehicle.limits
    level = DETOUR * float(np.hypot(away_m[0], away_m[1])) / (SPEED_SHARE * limits.v_xy_max_mps)
    return level + abs(float(away_m[2])) / limits.v_down_max_mps + LANDING_S
