"""Straight up or down at a steady speed: what take-off and landing take from the battery."""

import math
from typing import NamedTuple

from uas_coverage_env.vehicle import derived
from uas_coverage_env.vehicle.battery import battery_current_A, open_circuit_voltage
from uas_coverage_env.vehicle.params import VehicleParams
from uas_coverage_env.vehicle.thrust_correction import vertical_flight_N

_STEP_S = 0.1


class VerticalFlight(NamedTuple):
    """How long it lasts, what it draws, and the battery after it."""

    time_s: float
    energy_Wh: float
    dod: float
    u_th_V: float


def vertical_flight(
    vehicle: VehicleParams, height_m: float, down_mps: float, dod: float, u_th_V: float
) -> VerticalFlight:
    """Climb or descend a height with the power of the exact thrust correction.

    Setting off and stopping are left out: they take a second or two.

    Args:
        vehicle: parameters.
        height_m: [m] not negative.
        down_mps: [m/s] negative: a climb; not 0.
        dod: depth of discharge at its start.
        u_th_V: [V] polarisation at its start.
    """
    battery, time_s = vehicle.battery, height_m / abs(down_mps)
    power_W = derived.power_W(vehicle, vehicle.weight_N + vertical_flight_N(vehicle, down_mps))
    steps = math.ceil(time_s / _STEP_S)
    for _ in range(steps):
        step_s = time_s / steps
        voltage_V = float(open_circuit_voltage(vehicle, dod)) - u_th_V
        current_A = battery_current_A(voltage_V, battery.resistance_0_ohm, power_W)
        dod += current_A * step_s / (3600.0 * battery.capacity_Ah)
        left = math.exp(-step_s / battery.time_constant_th_s)
        u_th_V = left * u_th_V + (1.0 - left) * battery.resistance_th_ohm * current_A
    return VerticalFlight(time_s, power_W * time_s / 3600.0, dod, u_th_V)
