"""How the vehicle that flies deviates from the one that is believed: p = (1 + deviation) · p_0.

A vehicle file is what planners, autopilot and records believe. The models here are flown where a
disturbance says that the true vehicle is another. The inputs are asked of the believed vehicle: it
turns its motors at the speeds that would give weight plus lift, and the true one makes of these
speeds another thrust, out of another power.
"""

import math
from typing import NamedTuple

from uas_coverage_env.compiled.kernels import inlined_kernel, kernel, stack_array
from uas_coverage_env.vehicle.battery import battery_current_A
from uas_coverage_env.vehicle.layout import (
    DELTA_THRUST,
    DOD,
    LIFT,
    N_STATES,
    PHI,
    POSITION,
    PSI,
    SPEED,
    TAU_X,
    TAU_Y,
    TAU_Z,
    THETA,
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
from uas_coverage_env.vehicle.lpv import segment_of, static_thrust_deviation
from uas_coverage_env.vehicle.thrust_correction import static_thrust_in_flow

_current = kernel(battery_current_A)


class Deviation(NamedTuple):
    """A parameter in which the true vehicle may deviate from the believed one.

    Attributes:
        name: In messages and tables.
        meaning: What is another.
    """

    name: str
    meaning: str


DEVIATIONS = (
    Deviation("mass", "mass and weight"),
    Deviation("thrust", "thrust of the motors at the same speed"),
    Deviation("drag", "drag, horizontal and vertical"),
    Deviation("power", "electrical power at the same speed of the motors, avionics included"),
    Deviation("capacity", "capacity of the battery"),
    Deviation("resistance", "both internal resistances of the battery"),
)
"""The place of a parameter is its index in `outcome[i].deviation`."""

N_DEVIATIONS = len(DEVIATIONS)
MASS, THRUST, DRAG, POWER, CAPACITY, RESISTANCE = range(N_DEVIATIONS)

_ORDER = 4  # of the series in dt, as `governor.ORDER`
_TERMS = _ORDER + 1


@inlined_kernel
def deviates(deviation):
    """Whether any parameter is another; deviation (N_DEVIATIONS,)."""
    found = False
    for k in range(N_DEVIATIONS):
        found = found or deviation[k] != 0.0
    return found


@inlined_kernel
def deviating_lpv_step(vehicle, deviation, rotor_power, x, u, x_next):
    """`lpv_step` of the true vehicle: the LPV model that its own file would give, but for hover.

    It is linearised where the true vehicle hovers: a tilt accelerates it as it does any other.
    What the motors ask of the battery is counted from the hover of the believed vehicle.

    Args:
        vehicle: record of VEHICLE_DTYPE, the believed one.
        deviation: (N_DEVIATIONS,).
        rotor_power: Whether the power of level flight is at least that of the rotor model.
        x: (14,) state.
        u: (5,) lift and torques that were asked for; dT is computed.
        x_next: (14,) written; may be x itself.

    Returns:
        voltage_V and current_A at x, under u.
    """
    u[DELTA_THRUST] = _static_thrust(vehicle, deviation, rotor_power, x, u[LIFT])
    more_resistance = 1.0 + deviation[RESISTANCE]
    more_power = 1.0 + deviation[POWER]
    resistance_0 = more_resistance * vehicle.resistance_0_ohm
    j = segment_of(vehicle, x[DOD])
    # the linearised current, of this resistance and this power
    behind = vehicle.ocv_V[j] - vehicle.drop_V[j]
    hover = _current(behind, resistance_0, more_power * vehicle.hover_W)
    stiffness = behind - 2.0 * resistance_0 * hover
    believed = behind - 2.0 * vehicle.resistance_0_ohm * vehicle.current_A[j]
    slope_W_per_N = more_power * believed * vehicle.current_A_per_N[j]
    drop = vehicle.ocv_slope_V[j] * x[DOD] + x[U_TH] - vehicle.drop_V[j]
    current = hover + (hover * drop + slope_W_per_N * u[DELTA_THRUST]) / stiffness
    current = max(current, 0.0)
    open_circuit = vehicle.ocv_V[j] - vehicle.ocv_slope_V[j] * x[DOD]
    voltage = open_circuit - x[U_TH] - resistance_0 * current
    capacity_As = (1.0 + deviation[CAPACITY]) * vehicle.capacity_As
    dod = x[DOD] + current * vehicle.dt_s / capacity_As
    decay = vehicle.polarisation_decay
    u_th = more_resistance * vehicle.resistance_th_ohm * current
    u_th = decay * x[U_TH] + (1.0 - decay) * u_th
    for state in range(N_STATES):
        x_next[state] = x[state]
    _fly_kinematics(vehicle, deviation, x_next, u)
    x_next[DOD] = dod
    x_next[U_TH] = u_th
    return voltage, current


@inlined_kernel
def _static_thrust(vehicle, deviation, rotor_power, x, lift_N):
    """The thrust correction, with the trim and the thrust that the true drag needs [N].

    More drag needs more tilt at a speed, and more thrust to carry the weight at this tilt. The fit
    is linear in the speed and holds up to the vehicle's limit, which an airspeed may exceed: the
    rotor model knows what that takes.
    """
    trim = vehicle.trim_rad_per_mps
    true_trim = trim * (1.0 + deviation[DRAG]) / (1.0 + deviation[MASS])
    square = x[VX] * x[VX] + x[VY] * x[VY]
    leaning = math.sqrt(1.0 + true_trim * true_trim * square)
    more = vehicle.weight_N * (leaning - math.sqrt(1.0 + trim * trim * square))
    if rotor_power:
        speed = math.sqrt(square)
        across = speed / leaning
        level = static_thrust_in_flow(
            vehicle, vehicle.weight_N * leaning, across, across * true_trim * speed
        )
        more = max(more, level - vehicle.weight_N - vehicle.speed_N_per_mps * speed)
    total = static_thrust_deviation(vehicle, x, lift_N, true_trim) + more
    return max(total, vehicle.delta_thrust_min_N)


@inlined_kernel
def _fly_kinematics(vehicle, deviation, x, u):
    """`fly_kinematics`; an attitude loop beneath the model gives the torques as asked for."""
    inertia = vehicle.inertia_kgm2
    mass = vehicle.mass_kg * (1.0 + deviation[MASS])
    more_thrust = 1.0 + deviation[THRUST]
    series = stack_array(_TERMS)
    write_series(vehicle.dt_s, vehicle.drag_kgps * (1.0 + deviation[DRAG]) / mass, series)
    _axis_step(vehicle, series, x, X, VX, THETA, WY, -1.0, u[TAU_Y] / inertia[1])
    _axis_step(vehicle, series, x, Y, VY, PHI, WX, 1.0, u[TAU_X] / inertia[0])
    write_series(vehicle.dt_s, vehicle.drag_vertical_kgps * (1.0 + deviation[DRAG]) / mass, series)
    up = more_thrust * (vehicle.weight_N + u[LIFT]) - vehicle.weight_N * (1.0 + deviation[MASS])
    z, vz = x[Z], x[VZ]
    x[Z] = z + series[1] * vz - series[2] * up / mass
    x[VZ] = series[0] * vz - series[1] * up / mass
    alpha = u[TAU_Z] / inertia[2]
    x[PSI] += vehicle.dt_s * x[WZ] + vehicle.yaw_B[POSITION] * alpha
    x[WZ] += vehicle.yaw_B[SPEED] * alpha


@inlined_kernel
def _axis_step(vehicle, series, x, position, velocity, angle, rate, sign, angular_acceleration):
    """One horizontal axis; `sign` turns the Euler angle into a tilt forward along the axis."""
    dt = vehicle.dt_s
    g = vehicle.gravity_mps2
    v, tilt, w = x[velocity], sign * x[angle], sign * x[rate]
    alpha = sign * angular_acceleration
    pushed = series[2] * tilt + series[3] * w + series[4] * alpha
    faster = series[1] * tilt + series[2] * w + series[3] * alpha
    x[position] += series[1] * v + g * pushed
    x[velocity] = series[0] * v + g * faster
    x[angle] = sign * (tilt + dt * w + 0.5 * dt * dt * alpha)
    x[rate] = sign * (w + dt * alpha)


@inlined_kernel
def write_series(dt_s, rate_per_s, series):
    """Write what a chain of integrators makes of linear drag: sum of (-r)^(k-j) dt^k / k! at j.

    The sums of k from j to 4: j = 0 is what is left of a velocity after the step, 1 what a constant
    acceleration adds to it and a velocity to the position, and so on.

    Args:
        dt_s: [s].
        rate_per_s: Drag over mass.
        series: (5,) written.
    """
    for j in range(_TERMS):
        term = 1.0
        for k in range(1, j + 1):
            term *= dt_s / k
        series[j] = term
        for k in range(j + 1, _ORDER + 1):
            term *= -rate_per_s * dt_s / k
            series[j] += term


@inlined_kernel
def add_force(vehicle, deviation, x, force_N):
    """Add to position and velocity what a force on the true vehicle, held over a step, has done.

    Args:
        vehicle: record of VEHICLE_DTYPE, the believed one.
        deviation: (N_DEVIATIONS,).
        x: (14,) state at the end of the step; written.
        force_N: (3,) NED [N].
    """
    mass = vehicle.mass_kg * (1.0 + deviation[MASS])
    more_drag = 1.0 + deviation[DRAG]
    series = stack_array(_TERMS)
    for axis in range(3):
        drag = vehicle.drag_vertical_kgps if axis == 2 else vehicle.drag_kgps
        write_series(vehicle.dt_s, more_drag * drag / mass, series)
        x[X + axis] += series[2] * force_N[axis] / mass
        x[VX + axis] += series[1] * force_N[axis] / mass
