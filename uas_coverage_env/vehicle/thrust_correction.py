"""The thrust correction f_T: extra static thrust that would draw the same power (Sec. II).

Exact from momentum theory with profile drag; the coefficients of the piecewise-linear form used
by the LPV model and the planner are fitted to it.
"""

import math
from functools import lru_cache
from types import SimpleNamespace

import numpy as np

from uas_coverage_env.compiled.kernels import interpreted, kernel
from uas_coverage_env.vehicle.parts import Parts, ThrustCorrection

_NEWTON_STEPS = 8
_IDLE = 0.05  # of the weight: rotors never stop
_COSINE_MIN = 0.3  # beyond a tilt of 70 degrees the vertical thrust no longer grows

MOST_BEYOND_TRIM_RAD = 0.25
"""Tilts up to here beyond trim are what the tilt coefficient is fitted to."""


@kernel
def flow(phi, theta, psi, vx, vy, vz):
    """Speed across the rotor disc and climb along its axis [m/s], of an attitude and a velocity."""
    # the rotor axis, pointing down, in NED
    ax = math.cos(phi) * math.sin(theta) * math.cos(psi) + math.sin(phi) * math.sin(psi)
    ay = math.cos(phi) * math.sin(theta) * math.sin(psi) - math.sin(phi) * math.cos(psi)
    az = math.cos(phi) * math.cos(theta)
    climb = -(ax * vx + ay * vy + az * vz)
    across = math.sqrt(max(vx * vx + vy * vy + vz * vz - climb * climb, 0.0))
    return across, climb


@kernel
def static_thrust_in_flow(vehicle, thrust_N, across_mps, climb_mps):
    """Thrust of a hovering rotor set that needs the same power as this thrust in this flow [N].

    The induced velocity v_i solves v_i sqrt(v_t² + (v_c + v_i)²) = v_h² (Glauert), climb not
    negative. The left side is convex and rises, so Newton's method from v_h, where it is too large,
    comes down to the root without passing it; it has converged to the last digits after six steps.

    Args:
        vehicle: record of VEHICLE_DTYPE.
        thrust_N: [N] of all rotors.
        across_mps: [m/s] in the plane of the rotors.
        climb_mps: [m/s] along their axis.
    """
    thrust = max(thrust_N, _IDLE * vehicle.weight_N)
    n = vehicle.n_motors
    radius = vehicle.propeller_radius_m
    area = math.pi * radius * radius
    hover = math.sqrt(thrust / (2.0 * vehicle.air_density_kgpm3 * n * area))
    # shaft power of a static rotor set: c T^1.5
    k_T = vehicle.thrust_N_per_radps2
    c = vehicle.torque_Nm_per_radps2 / (k_T * math.sqrt(k_T * n))
    root = math.sqrt(thrust)
    kappa = vehicle.induced_power_factor
    profile = c * thrust * root - kappa * thrust * hover
    advance = across_mps / (root / math.sqrt(n * k_T) * radius)
    # momentum theory fails in the vortex ring state: a descent is credited with half its power
    axial = climb_mps if climb_mps >= 0.0 else 0.5 * climb_mps
    ascent = max(climb_mps, 0.0)
    induced = hover
    for _ in range(_NEWTON_STEPS):
        along = ascent + induced
        through = math.sqrt(across_mps * across_mps + along * along)
        slope = through + induced * along / through
        induced -= (induced * through - hover * hover) / slope
    power = kappa * thrust * induced + thrust * axial
    power += profile * (1.0 + vehicle.profile_power_advance_factor * advance * advance)
    return (max(power, 0.0) / c) ** (2.0 / 3.0)


@kernel
def static_thrust(vehicle, thrust_N, phi, theta, psi, vx, vy, vz):
    """Thrust of a hovering rotor set that needs the same power as this thrust in this flight [N].

    Args:
        vehicle: record of VEHICLE_DTYPE.
        thrust_N: [N] of all rotors.
        phi: [rad] roll.
        theta: [rad] pitch.
        psi: [rad] heading.
        vx: [m/s] north.
        vy: [m/s] east.
        vz: [m/s] down.
    """
    across, climb = flow(phi, theta, psi, vx, vy, vz)
    return static_thrust_in_flow(vehicle, thrust_N, across, climb)


@kernel
def exact_delta_thrust(vehicle, lift_N, phi, theta, psi, vx, vy, vz):
    """Delta T = f_T(L, Psi, v): the static thrust of a flight with lift L, less the weight [N].

    The vertical part of the thrust is weight plus lift. Arguments as for `static_thrust`.
    """
    upright = max(math.cos(phi) * math.cos(theta), _COSINE_MIN)
    thrust = (vehicle.weight_N + lift_N) / upright
    return static_thrust(vehicle, thrust, phi, theta, psi, vx, vy, vz) - vehicle.weight_N


def fit_thrust_correction(vehicle: Parts, samples: int = 24) -> ThrustCorrection:
    """The coefficients of the piecewise-linear form, from the exact one.

    Speed, climb and descent match the exact form at the vehicle's limits, and credit no flight
    with less than hover power; the tilt coefficient is a least-squares fit over accelerating and
    turning flight (braking is over-estimated: the published power rises when braking, too).

    Args:
        vehicle: parameters; thrust correction, power and battery are not read.
        samples: speeds, tilts and directions of the least-squares fit; 12 come to 1 % of 24.
    """
    scalars, limits = vehicle.kernel_scalars(), vehicle.limits.model_dump()
    return _fitted(tuple(scalars.items()), tuple(limits.items()), samples)


# a fleet asks for the same vehicle several times
@lru_cache(maxsize=64)
def _fitted(
    scalars: tuple[tuple[str, float], ...], bounds: tuple[tuple[str, float], ...], samples: int
) -> ThrustCorrection:
    rotors, limits = SimpleNamespace(**dict(scalars)), SimpleNamespace(**dict(bounds))
    trim = rotors.drag_kgps / rotors.weight_N
    fastest, up, down = limits.v_xy_max_mps, limits.v_up_max_mps, limits.v_down_max_mps
    tilts, costs = [], []
    middles = (np.arange(samples) + 0.5) / samples
    for speed in (fastest * middles).tolist():
        level = _level_N(rotors, speed)
        for beyond in (min(MOST_BEYOND_TRIM_RAD, limits.tilt_max_rad) * middles).tolist():
            for direction in (np.pi * (middles - 0.5)).tolist():
                theta = -math.atan(trim * speed) - beyond * math.cos(direction)
                phi = beyond * math.sin(direction)
                if math.hypot(theta, phi) <= limits.tilt_max_rad:
                    tilts.append(beyond)
                    costs.append(_extra_N(rotors, phi, theta, speed, 0.0) - level)
    excess, extra = np.array(tilts), np.array(costs)
    return ThrustCorrection(
        speed_N_per_mps=max(_level_N(rotors, fastest) / fastest, 0.0),
        climb_N_per_mps=max(_extra_N(rotors, 0.0, 0.0, 0.0, -up) / up, 0.0),
        descent_N_per_mps=max(-_extra_N(rotors, 0.0, 0.0, 0.0, down) / down, 0.0),
        tilt_N_per_rad=max(float(excess @ extra / (excess @ excess)), 0.0),
    )


def level_flight_N(vehicle: Parts, speed_mps: float) -> float:
    """The exact thrust correction of level flight, in trim [N].

    Args:
        vehicle: parameters; thrust correction, power and battery are not read.
        speed_mps: [m/s] horizontal.
    """
    return _level_N(SimpleNamespace(**vehicle.kernel_scalars()), speed_mps)


def vertical_flight_N(vehicle: Parts, down_mps: float) -> float:
    """The exact thrust correction of level attitude, straight up or down [N].

    Args:
        vehicle: parameters; thrust correction, power and battery are not read.
        down_mps: [m/s] positive down.
    """
    return _extra_N(SimpleNamespace(**vehicle.kernel_scalars()), 0.0, 0.0, 0.0, down_mps)


def _level_N(rotors: SimpleNamespace, speed_mps: float) -> float:
    tilt_rad = math.atan(rotors.drag_kgps / rotors.weight_N * speed_mps)
    return _extra_N(rotors, 0.0, -tilt_rad, speed_mps, 0.0)


def _extra_N(rotors: SimpleNamespace, phi: float, theta: float, vx: float, vz: float) -> float:
    """`exact_delta_thrust` without lift, not compiled: reading a vehicle waits for nothing."""
    thrust_N = rotors.weight_N / (math.cos(phi) * math.cos(theta))
    through = interpreted(flow)(phi, theta, 0.0, vx, 0.0, vz)
    return interpreted(static_thrust_in_flow)(rotors, thrust_N, *through) - rotors.weight_N
