"""The nonlinear plant: rigid body, rotors, power train and Thevenin battery, compiled.

It is flown by the same wrenches as the LPV model. Within a step a fast attitude loop tracks the
attitude that the step's torques give in the LPV model (a torque held open loop for a whole second
would drift), and the thrust is turned so that its vertical part stays weight plus lift.
"""

import math

import numpy as np
from numba import njit

from uas_coverage_env.vehicle.layout import (
    DELTA_THRUST,
    DOD,
    LIFT,
    N_STATES,
    PHI,
    PSI,
    TAU_X,
    THETA,
    U_TH,
    VX,
    VY,
    VZ,
    WX,
    WZ,
    X,
)
from uas_coverage_env.vehicle.lpv import open_circuit_V
from uas_coverage_env.vehicle.powertrain import battery_current_A, electrical_power_W
from uas_coverage_env.vehicle.thrust_correction import exact_delta_thrust

_SUBSTEP_S = 0.02
_STIFFNESS_PER_S2 = 100.0  # attitude loop: 10 rad/s, critically damped
_DAMPING_PER_S = 20.0
_TILT_MAX_RAD = 1.2  # beyond this the Euler angles are held: no flight of ours goes there


@njit(cache=True, error_model="numpy")
def mix(vehicle, thrust_N, torque, motor_thrust_N):
    """Thrust and torque (3,) as N_M motor thrusts, each within what a motor can give.

    The pseudo-inverse of the rotor map in closed form: rotors equally spaced, neighbours turning
    against each other. Returns the total thrust; `torque` becomes what the motors give.
    """
    n, arm = vehicle.n_motors, vehicle.arm_m
    ratio = vehicle.torque_Nm_per_radps2 / vehicle.thrust_N_per_radps2
    strongest = vehicle.thrust_N_per_radps2 * vehicle.motor_speed_max_radps**2
    total, roll, pitch, yaw = 0.0, 0.0, 0.0, 0.0
    for i in range(n):
        angle = vehicle.first_arm_angle_rad + 2.0 * math.pi * i / n
        spin = 1.0 if i % 2 == 0 else -1.0
        share = thrust_N / n + spin * torque[2] / (n * ratio)
        share += 2.0 / (n * arm) * (math.cos(angle) * torque[1] - math.sin(angle) * torque[0])
        share = min(max(share, 0.0), strongest)
        motor_thrust_N[i] = share
        total += share
        roll -= arm * math.sin(angle) * share
        pitch += arm * math.cos(angle) * share
        yaw += spin * ratio * share
    torque[0], torque[1], torque[2] = roll, pitch, yaw
    return total


@njit(cache=True, error_model="numpy")
def _derivative(vehicle, x, thrust_N, torque, power_W, dx):
    """Dx = f(x) with thrust, torque and battery power held."""
    phi = min(max(x[PHI], -_TILT_MAX_RAD), _TILT_MAX_RAD)
    theta = min(max(x[THETA], -_TILT_MAX_RAD), _TILT_MAX_RAD)
    sp, cp, st, ct = math.sin(phi), math.cos(phi), math.sin(theta), math.cos(theta)
    ss, cs = math.sin(x[PSI]), math.cos(x[PSI])
    inertia, mass = vehicle.inertia_kgm2, vehicle.mass_kg
    push = thrust_N / mass
    for axis in range(3):
        dx[X + axis] = x[VX + axis]
    dx[VX] = -push * (cp * st * cs + sp * ss) - vehicle.drag_kgps / mass * x[VX]
    dx[VY] = -push * (cp * st * ss - sp * cs) - vehicle.drag_kgps / mass * x[VY]
    dx[VZ] = vehicle.gravity_mps2 - push * cp * ct - vehicle.drag_vertical_kgps / mass * x[VZ]
    p, q, r = x[WX], x[WX + 1], x[WZ]
    dx[PHI] = p + (sp * q + cp * r) * st / ct
    dx[THETA] = cp * q - sp * r
    dx[PSI] = (sp * q + cp * r) / ct
    dx[WX] = (torque[0] - (inertia[2] - inertia[1]) * q * r) / inertia[0]
    dx[WX + 1] = (torque[1] - (inertia[0] - inertia[2]) * r * p) / inertia[1]
    dx[WZ] = (torque[2] - (inertia[1] - inertia[0]) * p * q) / inertia[2]
    current = battery_current_A(vehicle, x[DOD], x[U_TH], power_W)
    dx[DOD] = current / vehicle.capacity_As
    dx[U_TH] = (vehicle.resistance_th_ohm * current - x[U_TH]) / vehicle.time_constant_th_s


@njit(cache=True, error_model="numpy")
def _attitude_loop(vehicle, x, x0, u, time_s, torque):
    """Torque that tracks the attitude of the LPV model under the step's torques."""
    for axis in range(3):
        alpha = u[TAU_X + axis] / vehicle.inertia_kgm2[axis]
        rate = x0[WX + axis] + alpha * time_s
        angle = x0[PHI + axis] + x0[WX + axis] * time_s + 0.5 * alpha * time_s * time_s
        wanted = alpha + _STIFFNESS_PER_S2 * (angle - x[PHI + axis])
        wanted += _DAMPING_PER_S * (rate - x[WX + axis])
        torque[axis] = vehicle.inertia_kgm2[axis] * wanted


@njit(cache=True, error_model="numpy")
def plant_step(vehicle, x, u, x_next):
    """One step of the nonlinear plant under a held wrench; writes u[DELTA_THRUST] (its mean).

    Args:
        vehicle: record of VEHICLE_DTYPE.
        x: (14,) state.
        u: (5,) lift and torques held over the step.
        x_next: (14,) written; may be x itself.

    Returns:
        voltage_V and current_A: mean current, and the voltage with which voltage · current · dt
        is the step's energy.
    """
    steps = max(math.ceil(vehicle.dt_s / _SUBSTEP_S - 1e-9), 1)
    h = vehicle.dt_s / steps
    x0, now = x.copy(), x.copy()
    torque = np.zeros(3)
    motors = np.zeros(vehicle.n_motors)
    k1, k2 = np.empty(N_STATES), np.empty(N_STATES)
    k3, k4 = np.empty(N_STATES), np.empty(N_STATES)
    middle = np.empty(N_STATES)
    correction, energy = 0.0, 0.0
    for step in range(steps):
        upright = max(math.cos(now[PHI]) * math.cos(now[THETA]), 0.3)
        _attitude_loop(vehicle, now, x0, u, step * h, torque)
        thrust = mix(vehicle, (vehicle.weight_N + u[LIFT]) / upright, torque, motors)
        extra = exact_delta_thrust(
            vehicle, u[LIFT], now[PHI], now[THETA], now[PSI], now[VX], now[VY], now[VZ]
        )
        extra = max(extra, -vehicle.weight_N)
        power = electrical_power_W(vehicle, vehicle.weight_N + extra)
        u_th, dod = now[U_TH], now[DOD]
        _derivative(vehicle, now, thrust, torque, power, k1)
        middle[:] = now + 0.5 * h * k1
        _derivative(vehicle, middle, thrust, torque, power, k2)
        middle[:] = now + 0.5 * h * k2
        _derivative(vehicle, middle, thrust, torque, power, k3)
        middle[:] = now + h * k3
        _derivative(vehicle, middle, thrust, torque, power, k4)
        now += h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)
        for axis in range(2):
            now[PHI + axis] = min(max(now[PHI + axis], -_TILT_MAX_RAD), _TILT_MAX_RAD)
        current = battery_current_A(vehicle, dod, u_th, power)
        delivered = min(power, current * _terminal_V(vehicle, dod, u_th, current))
        energy += delivered * h
        correction += extra / steps
    u[DELTA_THRUST] = correction
    charge = (now[DOD] - x0[DOD]) * vehicle.capacity_As
    x_next[:] = now
    mean = charge / vehicle.dt_s
    return energy / max(charge, 1e-12), mean


@njit(cache=True, error_model="numpy")
def _terminal_V(vehicle, dod, u_th_V, current_A):
    """Voltage under a current [V]."""
    return open_circuit_V(vehicle, dod) - u_th_V - vehicle.resistance_0_ohm * current_A
