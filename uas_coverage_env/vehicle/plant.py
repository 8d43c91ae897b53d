"""The nonlinear plant: rigid body, rotors, power train and Thevenin battery, compiled.

It is flown by the same wrenches as the LPV model. A torque held open loop for a whole second would
drift, so a fast attitude loop tracks what the LPV model predicts for the step from its first
state, theta_lin(t). There, tilt is horizontal acceleration over g, which is the tangent of the
real one under a thrust whose vertical part is weight plus lift: the loop follows
theta = atan(theta_lin(t)), and the velocities of the step come out as predicted.

A UAS that looks where it flies has its tilts on axes that do not turn (`layout`). It is flown as
if it faced north: its heading goes beside, as the LPV model has it, and nothing depends on it.

In a planar mission the vertical axis is a constraint: height and vertical speed are put back after
every substep, and the thrust (m g + L) / (cos phi cos theta) carries the weight at the tilt flown.

Left out: motor lag (30 ms against steps of a second), the gyroscopic torque of the rotors, the
loss of motor speed with a falling battery voltage, what a turn to the course does to the tilts.
"""

import math

from uas_coverage_env.compiled.kernels import kernel, rarely, stack_array
from uas_coverage_env.vehicle import layout as S
from uas_coverage_env.vehicle.discharge import discharge, discharge_further, operating_point
from uas_coverage_env.vehicle.lpv import turn
from uas_coverage_env.vehicle.parts import MAX_FURTHER_PAIRS
from uas_coverage_env.vehicle.powertrain import electrical_power_W
from uas_coverage_env.vehicle.record import MAX_MOTORS, OF_PITCH, OF_ROLL, OF_THRUST, OF_YAW
from uas_coverage_env.vehicle.thrust_correction import static_thrust

_SUBSTEP_S = 0.02
# attitude loop: angle over rate, critically damped at 10 rad/s
_ANGLE_GAIN_PER_S = 5.0
_RATE_GAIN_PER_S = 20.0
# what the flight controller refuses to ask for, whatever the wrench says
_TILT_ASKED_RAD = 1.0
_RATE_ASKED_RADPS = 3.0
_YAW_SHARE = 0.5
# stops of the simulation, far from any flight of ours: Euler angles end at 90 degrees
_TILT_STOP_RAD = 1.3
_RATE_STOP_RADPS = 50.0
_UPRIGHT_MIN = 0.3
_RIGID = S.DOD
_ROLL, _PITCH, _YAW, _ROLL_RATE, _PITCH_RATE, _YAW_RATE = range(6)


@kernel
def mix(vehicle, thrust_N, torque, motor_thrust_N):
    """Thrust and torque (3,) as N_M motor thrusts, each within what a motor can give.

    Motor thrusts are the pseudo-inverse of the rotor map, clipped. Yaw takes no motor's thrust by
    more than half of its share, as of autopilots that tilt first: large rotors give little yaw
    torque. Returns the total thrust; `torque` becomes what the motors give.
    """
    n = vehicle.n_motors
    strongest = vehicle.thrust_N_per_radps2 * vehicle.motor_speed_max_radps**2
    total = 0.0
    roll = 0.0
    pitch = 0.0
    yaw = 0.0
    most_yaw = _YAW_SHARE * thrust_N / n
    for i in range(n):
        per_yaw = abs(vehicle.mixer[i, OF_YAW])
        if n > 3 and per_yaw * abs(torque[2]) > most_yaw:
            torque[2] = math.copysign(most_yaw / per_yaw, torque[2])
    for i in range(n):
        mixer = vehicle.mixer[i]
        share = mixer[OF_THRUST] * thrust_N + mixer[OF_ROLL] * torque[0]
        share += mixer[OF_PITCH] * torque[1]
        share = min(max(share + mixer[OF_YAW] * torque[2], 0.0), strongest)
        motor_thrust_N[i] = share
        rotor = vehicle.rotor_map[i]
        total += share
        roll += rotor[0] * share
        pitch += rotor[1] * share
        yaw += rotor[2] * share
    if n == 3:
        # a tricopter tilts one rotor, by 30 degrees at most
        most = 0.5 * vehicle.arm_m * total / n
        yaw = min(max(torque[2], -most), most)
    torque[0] = roll
    torque[1] = pitch
    torque[2] = yaw
    return total


@kernel
def _euler_rates(x, rates):
    """Psi' = W(phi, theta) omega, into rates (3,)."""
    sp = math.sin(x[S.PHI])
    cp = math.cos(x[S.PHI])
    around = (sp * x[S.WY] + cp * x[S.WZ]) / math.cos(x[S.THETA])
    rates[0] = x[S.WX] + around * math.sin(x[S.THETA])
    rates[1] = cp * x[S.WY] - sp * x[S.WZ]
    rates[2] = around


@kernel
def _rigid_body(vehicle, x, thrust_N, torque, dx):
    """The twelve derivatives of the rigid body with thrust and torque held."""
    sp = math.sin(x[S.PHI])
    cp = math.cos(x[S.PHI])
    st = math.sin(x[S.THETA])
    ct = math.cos(x[S.THETA])
    ss = math.sin(x[S.PSI])
    cs = math.cos(x[S.PSI])
    mass = vehicle.mass_kg
    push = thrust_N / mass
    drag = vehicle.drag_kgps / mass
    for axis in range(3):
        dx[S.X + axis] = x[S.VX + axis]
    dx[S.VX] = -push * (cp * st * cs + sp * ss) - drag * x[S.VX]
    dx[S.VY] = -push * (cp * st * ss - sp * cs) - drag * x[S.VY]
    dx[S.VZ] = vehicle.gravity_mps2 - push * cp * ct
    dx[S.VZ] -= vehicle.drag_vertical_kgps / mass * x[S.VZ]
    _euler_rates(x, dx[S.PHI : S.WX])
    p = x[S.WX]
    q = x[S.WY]
    inertia = vehicle.inertia_kgm2
    dx[S.WX] = (torque[0] - (inertia[2] - inertia[1]) * q * x[S.WZ]) / inertia[0]
    dx[S.WY] = (torque[1] - (inertia[0] - inertia[2]) * x[S.WZ] * p) / inertia[1]
    dx[S.WZ] = (torque[2] - (inertia[1] - inertia[0]) * p * q) / inertia[2]


@kernel
def _asked(tangent, tangent_rate, tangent_acceleration, angle):
    """Angle, rate and acceleration of atan(tangent), within what is asked for; into angle (3,)."""
    largest = math.tan(_TILT_ASKED_RAD)
    if abs(tangent) >= largest:
        angle[0] = math.copysign(_TILT_ASKED_RAD, tangent)
        angle[1] = 0.0
        angle[2] = 0.0
        return
    slope = 1.0 / (1.0 + tangent * tangent)
    angle[0] = math.atan(tangent)
    angle[1] = min(max(slope * tangent_rate, -_RATE_ASKED_RADPS), _RATE_ASKED_RADPS)
    angle[2] = slope * tangent_acceleration - 2.0 * tangent * angle[1] * angle[1]


@kernel
def _attitude_loop(vehicle, x, first, u, time_s, roll, pitch, torque):
    """Torque (3,) that tracks the attitude of the LPV model under the step's torques.

    Args:
        vehicle: record of VEHICLE_DTYPE.
        x: (14,) state now.
        first: (6,) Euler angles and their rates in the LPV model at the start of the step.
        u: (5,) wrench of the step.
        time_s: [s] since the start of the step.
        roll: (3,) room for angle, rate, acceleration.
        pitch: (3,) room for the same.
        torque: (3,) [N m] written.
    """
    inertia = vehicle.inertia_kgm2
    alpha_roll = u[S.TAU_X] / inertia[0]
    alpha_pitch = u[S.TAU_Y] / inertia[1]
    alpha_yaw = u[S.TAU_Z] / inertia[2]
    half = 0.5 * time_s
    rate = first[_PITCH_RATE] + alpha_pitch * time_s
    _asked(first[_PITCH] + (first[_PITCH_RATE] + rate) * half, rate, alpha_pitch, pitch)
    # east, the acceleration over g is tan(phi) / cos(theta)
    rate = first[_ROLL_RATE] + alpha_roll * time_s
    linear = first[_ROLL] + (first[_ROLL_RATE] + rate) * half
    ct = math.cos(pitch[0])
    turn = math.sin(pitch[0]) * pitch[1]
    _asked(linear * ct, rate * ct - linear * turn, alpha_roll * ct - 2.0 * rate * turn, roll)
    yaw_rate = first[_YAW_RATE] + alpha_yaw * time_s
    yaw = first[_YAW] + (first[_YAW_RATE] + yaw_rate) * half
    # Euler rates wanted, then body rates by the inverse of W
    phi_rate = roll[1] + _ANGLE_GAIN_PER_S * (roll[0] - x[S.PHI])
    theta_rate = pitch[1] + _ANGLE_GAIN_PER_S * (pitch[0] - x[S.THETA])
    psi_rate = yaw_rate + _ANGLE_GAIN_PER_S * (yaw - x[S.PSI])
    psi_rate = min(max(psi_rate, -vehicle.yaw_rate_max_radps), vehicle.yaw_rate_max_radps)
    sp = math.sin(x[S.PHI])
    cp = math.cos(x[S.PHI])
    st = math.sin(x[S.THETA])
    ct = math.cos(x[S.THETA])
    p = phi_rate - st * psi_rate
    q = cp * theta_rate + sp * ct * psi_rate
    r = cp * ct * psi_rate - sp * theta_rate
    ahead_p = roll[2] - st * alpha_yaw
    ahead_q = cp * pitch[2] + sp * ct * alpha_yaw
    ahead_r = cp * ct * alpha_yaw - sp * pitch[2]
    torque[0] = inertia[0] * (ahead_p + _RATE_GAIN_PER_S * (p - x[S.WX]))
    torque[1] = inertia[1] * (ahead_q + _RATE_GAIN_PER_S * (q - x[S.WY]))
    torque[2] = inertia[2] * (ahead_r + _RATE_GAIN_PER_S * (r - x[S.WZ]))


@kernel
def _integrate(vehicle, x, h, thrust_N, torque, k, total, middle):
    """One Runge-Kutta step of the rigid body in place; k, total, middle (12,) are room."""
    for s in range(_RIGID):
        total[s] = 0.0
        middle[s] = x[s]
    for stage in range(4):
        _rigid_body(vehicle, middle, thrust_N, torque, k)
        weight = 2.0 if stage == 1 or stage == 2 else 1.0
        ahead = h if stage == 2 else 0.5 * h
        for s in range(_RIGID):
            total[s] += weight * k[s]
            middle[s] = x[s] + ahead * k[s]
    for s in range(_RIGID):
        x[s] += h / 6.0 * total[s]
    for axis in range(3):
        x[S.WX + axis] = min(max(x[S.WX + axis], -_RATE_STOP_RADPS), _RATE_STOP_RADPS)
    for axis in range(2):
        x[S.PHI + axis] = min(max(x[S.PHI + axis], -_TILT_STOP_RAD), _TILT_STOP_RAD)


@kernel
def plant_step(vehicle, x, u, x_next):
    """One step of the nonlinear plant under a held wrench.

    Args:
        vehicle: record of VEHICLE_DTYPE.
        x: (14,) state.
        u: (5,) lift and torques held over the step; u[DELTA_THRUST] is written, its mean.
        x_next: (14,) written; may be x itself.

    Returns:
        voltage_V and current_A: the mean current, which gives the step's charge, and the voltage
        with which voltage · current · dt is the step's energy (power averaged over the step).
    """
    steps = max(math.ceil(vehicle.dt_s / _SUBSTEP_S - 1e-9), 1)
    h = vehicle.dt_s / steps
    left = math.exp(-h / vehicle.time_constant_th_s)
    first = stack_array(6)
    torque = stack_array(3)
    roll = stack_array(3)
    pitch = stack_array(3)
    slope = stack_array(_RIGID)
    total = stack_array(_RIGID)
    middle = stack_array(_RIGID)
    motors = stack_array(MAX_MOTORS)
    further_V = stack_array(MAX_FURTHER_PAIRS)
    for p in range(vehicle.n_further):
        further_V[p] = vehicle.further_V[p]
    for s in range(x.shape[0]):
        x_next[s] = x[s]
    down_m, psi, yaw_rate, yaw_torque = x[S.Z], x[S.PSI], x[S.WZ], u[S.TAU_Z]
    if rarely(vehicle.follows_course):
        x_next[S.PSI] = u[S.TAU_Z] = 0.0
        # the body's own rate, at which its tilts do not turn it
        x_next[S.WZ] = -math.tan(x_next[S.PHI]) * x_next[S.WY]
    for s in range(6):
        first[s] = x_next[S.PHI + s]
    # the LPV model reads body rates as rates of the angles; of a body that spins, the part of the
    # spin in them changes no tilt and would be taken for more and more of it
    _euler_rates(x_next, roll)
    first[_ROLL_RATE] += math.sin(x_next[S.THETA]) * roll[2]
    first[_PITCH_RATE] -= math.sin(x_next[S.PHI]) * math.cos(x_next[S.THETA]) * roll[2]
    correction = 0.0
    charge = 0.0
    energy = 0.0
    for step in range(steps):
        _attitude_loop(vehicle, x_next, first, u, step * h, roll, pitch, torque)
        # upright in the middle of the substep
        _euler_rates(x_next, roll)
        upright = math.cos(x_next[S.PHI] + 0.5 * h * roll[0])
        upright *= math.cos(x_next[S.THETA] + 0.5 * h * roll[1])
        thrust = (vehicle.weight_N + u[S.LIFT]) / max(upright, _UPRIGHT_MIN)
        thrust = mix(vehicle, thrust, torque, motors)
        static = static_thrust(
            vehicle,
            thrust,
            x_next[S.PHI],
            x_next[S.THETA],
            x_next[S.PSI],
            x_next[S.VX],
            x_next[S.VY],
            x_next[S.VZ],
        )
        power = vehicle.power_factor * electrical_power_W(vehicle, static)
        voltage, current = operating_point(vehicle, further_V, x_next, power)
        discharge(vehicle, x_next, current, h, left)
        if rarely(vehicle.n_further > 0):
            discharge_further(vehicle, further_V, current, h)
        correction += static - vehicle.weight_N
        charge += current * h
        energy += voltage * current * h
        for axis in range(3):
            torque[axis] *= vehicle.thrust_factor
        thrust *= vehicle.thrust_factor
        _integrate(vehicle, x_next, h, thrust, torque, slope, total, middle)
        if rarely(vehicle.holds_height):
            x_next[S.Z], x_next[S.VZ] = down_m, 0.0
    if rarely(vehicle.follows_course):
        u[S.TAU_Z] = yaw_torque
        x_next[S.PSI], x_next[S.WZ] = psi, yaw_rate
        turn(vehicle, x_next, u)
    u[S.DELTA_THRUST] = correction / steps
    return energy / charge, charge / vehicle.dt_s
