"""The power train: what thrust takes from the battery, exactly (Gasche et al., Fig. EC_0)."""

import math

from uas_coverage_env.compiled.kernels import kernel
from uas_coverage_env.vehicle.battery import battery_current_A
from uas_coverage_env.vehicle.lpv import open_circuit_V

_current = kernel(battery_current_A)


@kernel
def electrical_power_W(vehicle, thrust_N):
    """Battery power of all motors at a total static thrust shared equally, and of the avionics.

    Stationary brushless motor: i = k_Q Ω² / K_e + i_0, u = R i + K_e Ω; speed controller with a
    proportional and a constant loss.
    """
    n = vehicle.n_motors
    speed = math.sqrt(max(thrust_N, 0.0) / n / vehicle.thrust_N_per_radps2)
    current = vehicle.torque_Nm_per_radps2 * speed * speed / vehicle.back_emf_Vs_per_rad
    current += vehicle.no_load_current_A
    voltage = vehicle.motor_resistance_ohm * current + vehicle.back_emf_Vs_per_rad * speed
    per_motor = voltage * current / vehicle.esc_efficiency + vehicle.esc_loss_W
    return n * per_motor + vehicle.auxiliary_W


@kernel
def battery_operating_point(vehicle, dod, u_th_V, power_W):
    """Voltage and current at which the Thevenin battery delivers a power.

    u_b i = P with u_b = OCV - u_th - R_0 i; where the battery has less power than is asked for, the
    product of the two is what it has.
    """
    E = open_circuit_V(vehicle, dod) - u_th_V
    current = _current(E, vehicle.resistance_0_ohm, power_W)
    return E - vehicle.resistance_0_ohm * current, current
