"""How long a flight home takes, and what it takes from the battery; calibrated (docs/range.md)."""

import math

from uas_coverage_env.compiled.kernels import kernel
from uas_coverage_env.vehicle.derived import steady_current_A
from uas_coverage_env.vehicle.params import VehicleParams

LANDING_S = 7.0
"""To slow down from full speed and come to rest at home, beyond the way at full speed."""

DESCENT_S = 1.0
"""To come to rest at the end of a descent that takes longer than the way."""

_TURNS = 1.5
"""Of the time that the largest acceleration takes to turn a velocity into one towards home."""

_MARGIN_S, _MARGIN_SHARE = 4.0, 0.1
_OBSTRUCTED_S = 5.0
"""Beyond the expected time: seconds and a share of it, and seconds where something is in the way,
which is climbed over, or passed more slowly. Fewer than 1 in 200 flights home took longer."""


@kernel
def seconds_to_land(vehicle, way_m, towards_mps, height_m):
    """Expected time to fly home and land, nothing that moves in the way [s].

    Along the way at full speed, after a turn towards it, or down (up) to the altitude of home,
    whichever takes longer: guidance does both at once.

    Args:
        vehicle: Record of VEHICLE_DTYPE.
        way_m: Horizontal length of the way home past fixed obstacles [m].
        towards_mps: Velocity now in the direction of home [m/s].
        height_m: Above home; negative below it [m].
    """
    turn_mps = vehicle.v_xy_max_mps - towards_mps
    turn_s = _TURNS * turn_mps / (vehicle.gravity_mps2 * math.tan(vehicle.tilt_max_rad))
    level_s = way_m / vehicle.v_xy_max_mps + turn_s + LANDING_S
    rate_mps = vehicle.v_down_max_mps if height_m >= 0.0 else vehicle.v_up_max_mps
    return max(level_s, abs(height_m) / rate_mps + DESCENT_S)


@kernel
def margin_to_land(seconds, obstructed):
    """What to add to `seconds_to_land` for it to suffice [s].

    Args:
        seconds: The expected time [s].
        obstructed: Whether fixed obstacles are in the straight way home.
    """
    return _MARGIN_S + _MARGIN_SHARE * seconds + (_OBSTRUCTED_S if obstructed else 0.0)


def dod_per_s(vehicle: VehicleParams, dod: float) -> float:
    """Depth of discharge that a second of level flight at full speed takes [1/s].

    Args:
        vehicle: Parameters.
        dod: Depth of discharge at which it flies; deeper, the same power takes more current.
    """
    drag_N = vehicle.thrust_correction.speed_N_per_mps * vehicle.limits.v_xy_max_mps
    power_W = vehicle.power.hover_W + vehicle.power.slope_W_per_N * drag_N
    current_A = steady_current_A(vehicle.battery, dod, power_W)
    return current_A / (3600.0 * vehicle.battery.capacity_Ah)
