"""How long a flight takes, and what it takes from the battery: one model for every estimate.

What estimates differ in is a `TravelTimeModel`. The calibrated one is `CALIBRATED`; others stand
with what uses them, those of planners in `planning.reserves` (why they differ:
docs/range.md).
"""

import math
from typing import Any, NamedTuple

import numpy as np

from uas_coverage_env.compiled.kernels import inlined_kernel, kernel
from uas_coverage_env.vehicle.battery import (
    battery_current_A,
    open_circuit_voltage,
    steady_current_A,
)
from uas_coverage_env.vehicle.params import VehicleParams


class SpeedLimits(NamedTuple):
    """The speeds of a vehicle that a `TravelTimeModel` refers to."""

    level_mps: float
    climb_mps: float
    descent_mps: float


class TravelTimeModel(NamedTuple):
    """What an estimate of flight time assumes."""

    speed_share: float = 1.0
    """Of the level speed, kept up on average."""
    detour: float = 1.0
    """The way flown over the length that is given."""
    level_s: float = 0.0
    """To slow down at the end of level flight."""
    vertical_s: float = 0.0
    """To slow down at the end of a climb or descent; negative: it ends before it is complete."""
    in_turn: bool = False
    """Level flight first, then climb or descent; else both at once, and the slower one decides."""
    landing_s: float = 0.0
    """Added in the end."""


CALIBRATED = TravelTimeModel(level_s=7.0, vertical_s=1.0)
"""What `mission.Range` answers. Fitted to flown returns in generated towns of seeds below 1200;
`benchmarks/returns.py` flies others."""

ROUTED = TravelTimeModel()
"""Of `mission.Ways` and `routing.Legs`, which compare routes: the limits of the vehicle, nothing
fitted."""


def level_seconds(model: TravelTimeModel, speeds: SpeedLimits, way_m: Any) -> Any:
    """Time of level flight, numbers or arrays [s]; also compiled, see `flight_seconds`.

    Args:
        model: What is assumed.
        speeds: Of the vehicle.
        way_m: Horizontal length [m].
    """
    return model.detour * way_m / (model.speed_share * speeds.level_mps)


def vertical_seconds(speeds: SpeedLimits, up_m: Any, down_m: Any) -> Any:
    """Time of a climb and a descent, numbers or arrays [s]; also compiled, see `flight_seconds`."""
    return up_m / speeds.climb_mps + down_m / speeds.descent_mps


_level_seconds = inlined_kernel(level_seconds)
_vertical_seconds = inlined_kernel(vertical_seconds)


@inlined_kernel
def flight_seconds(model, speeds, turn_s, way_m, up_m, down_m):
    """Time of a flight with level and vertical part [s].

    Args:
        model: `TravelTimeModel`, what is assumed.
        speeds: `SpeedLimits` of the vehicle.
        turn_s: To turn towards the way first [s].
        way_m: Horizontal length [m].
        up_m: To climb, not negative [m].
        down_m: To descend, not negative [m].
    """
    level_s = _level_seconds(model, speeds, way_m) + turn_s + model.level_s
    vertical_s = _vertical_seconds(speeds, up_m, down_m)
    if up_m + down_m > 0.0:
        vertical_s += model.vertical_s
    both_s = level_s + vertical_s if model.in_turn else max(level_s, vertical_s)
    return both_s + model.landing_s


def speeds_of(vehicle: VehicleParams) -> SpeedLimits:
    """The largest speeds of a vehicle."""
    limits = vehicle.limits
    return SpeedLimits(limits.v_xy_max_mps, limits.v_up_max_mps, limits.v_down_max_mps)


_TURNS = 1.5
"""Of the time that the largest acceleration takes to turn a velocity into one towards home."""

_QUICK_S = 4.5
"""The shipped vehicles lean over, stop from full speed and level out in less: with more, a flight
home takes longer by the difference, as often as a turn by the time for that."""

_MARGIN_S, _MARGIN_SHARE = 4.0, 0.1
_OBSTRUCTED_S = 5.0
"""Beyond the expected time: seconds and a share of it, and seconds where something is in the way,
which is climbed over, or passed more slowly. Fewer than 1 in 200 flights home took longer."""


@kernel
def seconds_to_land(vehicle, way_m, towards_mps, height_m, roof_m, before_m, after_m):
    """Expected time to fly home and land, nothing that moves in the way [s].

    Along the way at full speed, after a turn towards it, or down (up) to the altitude of home,
    whichever takes longer: guidance does both at once. Where roofs have to be passed over, the
    climb is over before the first of them, and the descent begins after the last.

    Args:
        vehicle: Record of VEHICLE_DTYPE.
        way_m: Horizontal length of the way home past fixed obstacles [m].
        towards_mps: Velocity now in the direction of home [m/s].
        height_m: Above home; negative below it [m].
        roof_m: Height above home at which the highest roof is passed; -inf without roofs [m].
        before_m: Horizontal way before the first roof [m].
        after_m: Horizontal way after the last roof [m].
    """
    turn_mps = vehicle.v_xy_max_mps - towards_mps
    most_mps2 = vehicle.gravity_mps2 * math.tan(vehicle.tilt_max_rad)
    turn_s = _TURNS * turn_mps / most_mps2
    leaning_s = 2.0 * math.sqrt(vehicle.tilt_max_rad / vehicle.alpha_xy_max_radps2)
    turn_s += _TURNS * max(vehicle.v_xy_max_mps / most_mps2 + leaning_s - _QUICK_S, 0.0)
    speeds = SpeedLimits(vehicle.v_xy_max_mps, vehicle.v_up_max_mps, vehicle.v_down_max_mps)
    up_m, down_m = max(-height_m, 0.0), max(height_m, 0.0)
    seconds = flight_seconds(CALIBRATED, speeds, turn_s, way_m, up_m, down_m)
    if roof_m == -math.inf:
        return seconds
    top_m = max(height_m, roof_m)
    rising_s = max(before_m / speeds.level_mps, (top_m - height_m) / speeds.climb_mps)
    over_s = max(way_m - before_m - after_m, 0.0) / speeds.level_mps
    falling_s = flight_seconds(CALIBRATED, speeds, 0.0, after_m, 0.0, max(top_m, 0.0))
    return max(seconds, turn_s + rising_s + over_s + falling_s)


@kernel
def margin_to_land(seconds, obstructed):
    """What to add to `seconds_to_land` for it to suffice [s].

    Args:
        seconds: The expected time [s].
        obstructed: Whether fixed obstacles are in the straight way home.
    """
    return _MARGIN_S + _MARGIN_SHARE * seconds + (_OBSTRUCTED_S if obstructed else 0.0)


def level_power_W(vehicle: VehicleParams) -> float:
    """Power of level flight at full speed [W]."""
    drag_N = vehicle.thrust_correction.speed_N_per_mps * vehicle.limits.v_xy_max_mps
    return vehicle.power.hover_W + vehicle.power.slope_W_per_N * drag_N


def dod_per_s(vehicle: VehicleParams, dod: float) -> float:
    """Depth of discharge that a second of level flight at full speed takes [1/s].

    Args:
        vehicle: Parameters.
        dod: Depth of discharge at which it flies; deeper, the same power takes more current.
    """
    current_A = steady_current_A(vehicle.battery, dod, level_power_W(vehicle))
    return current_A / (3600.0 * vehicle.battery.capacity_Ah)


def seconds_until(vehicle: VehicleParams, dod: float, dod_end: float, power_W: float) -> float:
    """Time for which a battery gives a power, at its mean voltage between two depths [s].

    Args:
        vehicle: Parameters.
        dod: Depth of discharge at the start.
        dod_end: Depth of discharge at the end.
        power_W: Drawn throughout [W].
    """
    battery = vehicle.battery
    depths = np.linspace(dod, dod_end, 33)
    voltage_V = float(open_circuit_voltage(vehicle, depths).mean())
    current_A = battery_current_A(voltage_V, battery.resistance_ohm, power_W)
    return (dod_end - dod) * battery.capacity_Ah * 3600.0 / current_A
