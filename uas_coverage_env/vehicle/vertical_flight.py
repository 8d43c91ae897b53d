"""Straight up or down at a steady speed: what take-off and landing take from the battery."""

import math
from typing import NamedTuple

from uas_coverage_env.vehicle import derived
from uas_coverage_env.vehicle.battery import BatteryState, battery_current_A, open_circuit_voltage
from uas_coverage_env.vehicle.params import VehicleParams
from uas_coverage_env.vehicle.thrust_correction import vertical_flight_N

_STEP_S = 0.1


class VerticalFlight(NamedTuple):
    """How long it lasts, what it draws, and the battery after it."""

    time_s: float
    energy_Wh: float
    battery: BatteryState


def vertical_flight(
    vehicle: VehicleParams, height_m: float, down_mps: float, battery: BatteryState
) -> VerticalFlight:
    """Climb or descend a height with the power of the exact thrust correction.

    Setting off and stopping are left out: they take a second or two.

    Args:
        vehicle: parameters.
        height_m: [m] not negative.
        down_mps: [m/s] negative: a climb; not 0.
        battery: at its start.
    """
    time_s, part = height_m / abs(down_mps), vehicle.battery
    power_W = derived.power_W(vehicle, vehicle.weight_N + vertical_flight_N(vehicle, down_mps))
    steps = math.ceil(time_s / _STEP_S)
    for _ in range(steps):
        voltage_V = float(open_circuit_voltage(vehicle, battery.dod)) - sum(battery.pairs_V)
        current_A = battery_current_A(voltage_V, part.resistance_0_ohm, power_W)
        battery = battery.after(part, current_A, time_s / steps)
    return VerticalFlight(time_s, power_W * time_s / 3600.0, battery)
