"""The power train: what thrust takes from the battery, exactly (Gasche et al., Fig. EC_0)."""

import math

from uas_coverage_env.compiled.kernels import kernel


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
