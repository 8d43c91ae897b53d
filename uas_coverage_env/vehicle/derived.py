"""What follows from the parts of a vehicle: hover power, full throttle, figure of merit."""

import math
from types import SimpleNamespace

from uas_coverage_env.compiled.kernels import interpreted
from uas_coverage_env.vehicle.parts import Parts
from uas_coverage_env.vehicle.powertrain import electrical_power_W

_SMALL = 1e-4  # of the weight, for a difference quotient


def power_W(vehicle: Parts, thrust_N: float) -> float:
    """Battery power at a static thrust of all rotors, by the power train [W]."""
    parts = SimpleNamespace(**vehicle.kernel_scalars())
    return interpreted(electrical_power_W)(parts, thrust_N)


def hover_power(vehicle: Parts) -> dict[str, float]:
    """Power of the power train at the weight, and its slope there."""
    weight_N, step_N = vehicle.weight_N, _SMALL * vehicle.weight_N
    rise_W = power_W(vehicle, weight_N + step_N) - power_W(vehicle, weight_N - step_N)
    return {"hover_W": power_W(vehicle, weight_N), "slope_W_per_N": rise_W / (2.0 * step_N)}


def full_throttle_radps(vehicle: Parts, voltage_V: float) -> float:
    """Speed at which a motor under its propeller takes a voltage: K_e Ω + R k_Q Ω² / K_e + R i_0.

    0 where the voltage does not turn it.
    """
    motor = vehicle.motor
    load = motor.resistance_ohm * vehicle.rotor.torque_Nm_per_radps2 / motor.back_emf_Vs_per_rad
    left_V = max(voltage_V - motor.resistance_ohm * motor.no_load_current_A, 0.0)
    root = math.sqrt(motor.back_emf_Vs_per_rad**2 + 4.0 * load * left_V)
    return (root - motor.back_emf_Vs_per_rad) / (2.0 * load)


def figure_of_merit(vehicle: Parts) -> float:
    """Power of an ideal hover, by momentum theory, over the shaft power of the rotors."""
    rotor, n = vehicle.rotor, vehicle.airframe.n_motors
    area_m2 = n * math.pi * rotor.propeller_radius_m**2
    ideal = 1.0 / math.sqrt(2.0 * rotor.air_density_kgpm3 * area_m2)
    shaft = rotor.torque_Nm_per_radps2 / rotor.thrust_N_per_radps2**1.5 / math.sqrt(n)
    return ideal / shaft
