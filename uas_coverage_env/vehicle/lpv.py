"""One step of the LPV model, compiled: rigid body, thrust correction, battery."""

import math

from uas_coverage_env.compiled.kernels import inlined_kernel, kernel, rare_kernel, rarely
from uas_coverage_env.vehicle.layout import (
    DELTA_THRUST,
    DOD,
    LIFT,
    N_STATES,
    PHI,
    POSITION,
    PSI,
    RATE,
    SPEED,
    TAU_X,
    TAU_Y,
    TAU_Z,
    THETA,
    TILT,
    U_TH,
    VX,
    VY,
    VZ,
    WX,
    WY,
    WZ,
    X,
    Y,
    Z,
)
from uas_coverage_env.vehicle.thrust_correction import static_thrust_in_flow


@inlined_kernel
def delta_thrust(vehicle, x, lift_N):
    """Thrust correction dT = f_T(L, Psi, v) in the piecewise-linear form of the plan [N].

    dT = L + climb or descent + k_v |v_xy| + k_q |tilt beyond trim|, the norms as H_P-sided
    polygons; never below the vehicle's lower bound.
    """
    k = vehicle.trim_rad_per_mps
    roll, pitch = x[PHI] - k * x[VY], x[THETA] + k * x[VX]
    speed, tilt = 0.0, 0.0
    for h in range(vehicle.faces.shape[0]):
        a, b = vehicle.faces[h, 0], vehicle.faces[h, 1]
        speed = max(speed, a * x[VX] + b * x[VY])
        tilt = max(tilt, a * roll + b * pitch)
    up = -x[VZ]
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
    square = x[VX] * x[VX] + x[VY] * x[VY]
    leaning = math.sqrt(1.0 + trim * trim * square)
    more_N = weight_N * (leaning - math.sqrt(1.0 + fitted * fitted * square))
    if vehicle.rotor_power:
        speed = math.sqrt(square)
        across = speed / leaning
        level_N = static_thrust_in_flow(vehicle, weight_N * leaning, across, across * trim * speed)
        more_N = max(more_N, level_N - weight_N - vehicle.speed_N_per_mps * speed)
    return more_N


@inlined_kernel
def segment_of(vehicle, dod):
    """Index of the piece of the discharge curve that holds at a depth of discharge."""
    for j in range(vehicle.n_segments - 1):
        if dod < vehicle.dod_end[j]:
            return j
    return vehicle.n_segments - 1


@kernel
def open_circuit_V(vehicle, dod):
    """Open-circuit voltage at a depth of discharge [V]; the curve stays flat beyond its ends."""
    dod = min(max(dod, 0.0), 1.0)
    j = segment_of(vehicle, dod)
    return vehicle.ocv_V[j] - vehicle.ocv_slope_V[j] * dod


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
    u[DELTA_THRUST] = delta_thrust(vehicle, x, u[LIFT])
    j = segment_of(vehicle, x[DOD])
    drop = vehicle.ocv_slope_V[j] * x[DOD] + x[U_TH] - vehicle.drop_V[j]
    current = vehicle.current_A[j] + vehicle.current_A_per_V[j] * drop
    current += vehicle.current_A_per_N[j] * u[DELTA_THRUST]
    # nothing flows back, however little thrust a vehicle's limits allow
    current = max(current, 0.0)
    open_circuit = vehicle.ocv_V[j] - vehicle.ocv_slope_V[j] * x[DOD]
    voltage = open_circuit - x[U_TH] - vehicle.resistance_0_ohm * current
    decay = vehicle.polarisation_decay
    dod = x[DOD] + current * vehicle.dt_s / vehicle.capacity_As
    u_th = decay * x[U_TH] + (1.0 - decay) * vehicle.resistance_th_ohm * current
    for state in range(N_STATES):
        x_next[state] = x[state]
    fly_kinematics(vehicle, x_next, u)
    x_next[DOD] = dod
    x_next[U_TH] = u_th
    return voltage, current


@inlined_kernel
def fly_kinematics(vehicle, x, u):
    """The twelve states of the rigid body one step on, in place; the battery is left alone."""
    inertia = vehicle.inertia_kgm2
    _axis_step(vehicle, x, X, VX, THETA, WY, -1.0, u[TAU_Y] / inertia[1])
    _axis_step(vehicle, x, Y, VY, PHI, WX, 1.0, u[TAU_X] / inertia[0])
    A, B = vehicle.vertical_A, vehicle.vertical_B
    z, vz = x[Z], x[VZ]
    lift = vehicle.thrust_factor * u[LIFT] + vehicle.lift_surplus_N
    x[Z] = A[POSITION, POSITION] * z + A[POSITION, SPEED] * vz + B[POSITION] * lift
    x[VZ] = A[SPEED, SPEED] * vz + B[SPEED] * lift
    alpha = u[TAU_Z] / inertia[2]
    x[PSI] += vehicle.dt_s * x[WZ] + vehicle.yaw_B[POSITION] * alpha
    x[WZ] += vehicle.yaw_B[SPEED] * alpha


@inlined_kernel
def _axis_step(vehicle, x, position, velocity, angle, rate, sign, angular_acceleration):
    """One horizontal axis; `sign` turns the Euler angle into a tilt forward along the axis."""
    A, B = vehicle.axis_A, vehicle.axis_B
    v, tilt, w = x[velocity], sign * x[angle], sign * x[rate]
    alpha = sign * angular_acceleration
    moved = A[POSITION, SPEED] * v + A[POSITION, TILT] * tilt + A[POSITION, RATE] * w
    x[position] += moved + B[POSITION] * alpha
    faster = A[SPEED, SPEED] * v + A[SPEED, TILT] * tilt + A[SPEED, RATE] * w
    x[velocity] = faster + B[SPEED] * alpha
    x[angle] = sign * (tilt + A[TILT, RATE] * w + B[TILT] * alpha)
    x[rate] = sign * (w + B[RATE] * alpha)


@kernel
def clip_wrench(vehicle, u):
    """Lift and torques within the vehicle's input limits, in place."""
    u[LIFT] = min(max(u[LIFT], vehicle.lift_min_N), vehicle.lift_max_N)
    for axis in range(3):
        largest = vehicle.torque_max_Nm[axis]
        u[TAU_X + axis] = min(max(u[TAU_X + axis], -largest), largest)
