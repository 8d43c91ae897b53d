"""One step of the LPV model, compiled: rigid body, thrust correction, battery."""

import math

from uas_coverage_env.compiled.kernels import inlined_kernel, kernel, rare_kernel, rarely
from uas_coverage_env.vehicle import layout as S
from uas_coverage_env.vehicle.discharge import discharge, linearised_point
from uas_coverage_env.vehicle.thrust_correction import static_thrust_in_flow


@inlined_kernel
def delta_thrust(vehicle, x, lift_N):
    """Thrust correction dT = f_T(L, Psi, v) in the piecewise-linear form of the plan [N].

    dT = L + climb or descent + k_v |v_xy| + k_q |tilt beyond trim|, the norms as H_P-sided
    polygons; never below the vehicle's lower bound.
    """
    k = vehicle.trim_rad_per_mps
    roll, pitch = x[S.PHI] - k * x[S.VY], x[S.THETA] + k * x[S.VX]
    speed, tilt = 0.0, 0.0
    for h in range(vehicle.faces.shape[0]):
        a, b = vehicle.faces[h, 0], vehicle.faces[h, 1]
        speed = max(speed, a * x[S.VX] + b * x[S.VY])
        tilt = max(tilt, a * roll + b * pitch)
    up = -x[S.VZ]
    vertical = max(vehicle.climb_N_per_mps * up, vehicle.descent_N_per_mps * up)
    total = lift_N + vertical + vehicle.speed_N_per_mps * speed + vehicle.tilt_N_per_rad * tilt
    if rarely(vehicle.rotor_power or k != vehicle.fitted_trim_rad_per_mps):
        total += _beyond_fit_N(vehicle, x)
    return max(total, vehicle.delta_thrust_min_N)


@rare_kernel
def _beyond_fit_N(vehicle, x):
    """What level flight takes beyond the fit, which is of the nominal vehicle [N].

    More drag needs more tilt at a speed, and more thrust to carry the weight at this tilt. The fit
    is linear in the speed and holds up to the vehicle's limit, which an airspeed may exceed: the
    rotor model knows what that takes.
    """
    weight_N, trim = vehicle.weight_N, vehicle.trim_rad_per_mps
    fitted = vehicle.fitted_trim_rad_per_mps
    square = x[S.VX] * x[S.VX] + x[S.VY] * x[S.VY]
    leaning = math.sqrt(1.0 + trim * trim * square)
    more_N = weight_N * (leaning - math.sqrt(1.0 + fitted * fitted * square))
    if vehicle.rotor_power:
        speed = math.sqrt(square)
        across = speed / leaning
        level_N = static_thrust_in_flow(vehicle, weight_N * leaning, across, across * trim * speed)
        more_N = max(more_N, level_N - weight_N - vehicle.speed_N_per_mps * speed)
    return more_N


@inlined_kernel
def lpv_step(vehicle, x, u, x_next):
    """x_next = A(DoD) x + B(DoD) u + E(DoD); writes u[DELTA_THRUST].

    Args:
        vehicle: record of VEHICLE_DTYPE.
        x: (14,) state.
        u: (5,) lift and torques held over the step; dT is computed.
        x_next: (14,) written; may be x itself.

    Returns:
        voltage_V and current_A at x, under u.
    """
    u[S.DELTA_THRUST] = delta_thrust(vehicle, x, u[S.LIFT])
    voltage, current = linearised_point(vehicle, x, u[S.DELTA_THRUST])
    for state in range(S.N_STATES):
        x_next[state] = x[state]
    fly_kinematics(vehicle, x_next, u)
    discharge(vehicle, x_next, current, vehicle.dt_s, vehicle.polarisation_decay)
    return voltage, current


@inlined_kernel
def fly_kinematics(vehicle, x, u):
    """The twelve states of the rigid body one step on, in place; the battery is left alone."""
    inertia = vehicle.inertia_kgm2
    _axis_step(vehicle, x, S.X, S.VX, S.THETA, S.WY, -1.0, u[S.TAU_Y] / inertia[1])
    _axis_step(vehicle, x, S.Y, S.VY, S.PHI, S.WX, 1.0, u[S.TAU_X] / inertia[0])
    A, B = vehicle.vertical_A, vehicle.vertical_B
    z, vz = x[S.Z], x[S.VZ]
    lift = vehicle.thrust_factor * u[S.LIFT] + vehicle.lift_surplus_N
    x[S.Z] = A[S.POSITION, S.POSITION] * z + A[S.POSITION, S.SPEED] * vz + B[S.POSITION] * lift
    x[S.VZ] = A[S.SPEED, S.SPEED] * vz + B[S.SPEED] * lift
    turn(vehicle, x, u)


@inlined_kernel
def turn(vehicle, x, u):
    """Heading and yaw rate one step on, in place; no other state depends on them."""
    alpha = u[S.TAU_Z] / vehicle.inertia_kgm2[2]
    x[S.PSI] += vehicle.dt_s * x[S.WZ] + vehicle.yaw_B[S.POSITION] * alpha
    x[S.WZ] += vehicle.yaw_B[S.SPEED] * alpha


@inlined_kernel
def _axis_step(vehicle, x, position, velocity, angle, rate, sign, angular_acceleration):
    """One horizontal axis; `sign` turns the Euler angle into a tilt forward along the axis."""
    A, B = vehicle.axis_A, vehicle.axis_B
    v, tilt, w = x[velocity], sign * x[angle], sign * x[rate]
    alpha = sign * angular_acceleration
    moved = A[S.POSITION, S.SPEED] * v + A[S.POSITION, S.TILT] * tilt + A[S.POSITION, S.RATE] * w
    x[position] += moved + B[S.POSITION] * alpha
    faster = A[S.SPEED, S.SPEED] * v + A[S.SPEED, S.TILT] * tilt + A[S.SPEED, S.RATE] * w
    x[velocity] = faster + B[S.SPEED] * alpha
    x[angle] = sign * (tilt + A[S.TILT, S.RATE] * w + B[S.TILT] * alpha)
    x[rate] = sign * (w + B[S.RATE] * alpha)


@kernel
def clip_wrench(vehicle, u):
    """Lift and torques within the vehicle's input limits, in place."""
    u[S.LIFT] = min(max(u[S.LIFT], vehicle.lift_min_N), vehicle.lift_max_N)
    for axis in range(3):
        largest = vehicle.torque_max_Nm[axis]
        u[S.TAU_X + axis] = min(max(u[S.TAU_X + axis], -largest), largest)
