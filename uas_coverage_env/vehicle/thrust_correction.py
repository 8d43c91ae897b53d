"""The thrust correction f_T: extra static thrust that would draw the same power (Sec. II).

Exact from momentum theory with profile drag; the coefficients of the piecewise-linear form used
by the LPV model and the planner are fitted to it.
"""

import math

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.kernels import kernel
from uas_coverage_env.vehicle.compiled import compile_vehicle
from uas_coverage_env.vehicle.params import ThrustCorrection, VehicleParams

_NEWTON_STEPS = 8
_IDLE = 0.05  # of the weight: rotors never stop
_COSINE_MIN = 0.3  # beyond a tilt of 70 degrees the vertical thrust no longer grows


@kernel
def _induced_mps(hover_mps, across_mps, climb_mps):
    """Induced velocity v_i of v_i sqrt(v_t² + (v_c + v_i)²) = v_h² (Glauert), climb not negative.

    The left side is convex and rises, so Newton's method from v_h, where it is too large, comes
    down to the root without passing it; it has converged to the last digits after six steps.
    """
    induced = hover_mps
    for _ in range(_NEWTON_STEPS):
        axial = climb_mps + induced
        through = math.sqrt(across_mps * across_mps + axial * axial)
        slope = through + induced * axial / through
        induced -= (induced * through - hover_mps * hover_mps) / slope
    return induced


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
    thrust = max(thrust_N, _IDLE * vehicle.weight_N)
    # the rotor axis, pointing down, in NED
    ax = math.cos(phi) * math.sin(theta) * math.cos(psi) + math.sin(phi) * math.sin(psi)
    ay = math.cos(phi) * math.sin(theta) * math.sin(psi) - math.sin(phi) * math.cos(psi)
    az = math.cos(phi) * math.cos(theta)
    climb = -(ax * vx + ay * vy + az * vz)
    across = math.sqrt(max(vx * vx + vy * vy + vz * vz - climb * climb, 0.0))
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
    advance = across / (root / math.sqrt(n * k_T) * radius)
    # momentum theory fails in the vortex ring state: a descent is credited with half its power
    axial = climb if climb >= 0.0 else 0.5 * climb
    induced = _induced_mps(hover, across, max(climb, 0.0))
    power = kappa * thrust * induced + thrust * axial
    power += profile * (1.0 + vehicle.profile_power_advance_factor * advance * advance)
    return (max(power, 0.0) / c) ** (2.0 / 3.0)


@kernel
def exact_delta_thrust(vehicle, lift_N, phi, theta, psi, vx, vy, vz):
    """Delta T = f_T(L, Psi, v): the static thrust of a flight with lift L, less the weight [N].

    The vertical part of the thrust is weight plus lift. Arguments as for `static_thrust`.
    """
    upright = max(math.cos(phi) * math.cos(theta), _COSINE_MIN)
    thrust = (vehicle.weight_N + lift_N) / upright
    return static_thrust(vehicle, thrust, phi, theta, psi, vx, vy, vz) - vehicle.weight_N


def fit_thrust_correction(vehicle: VehicleParams) -> ThrustCorrection:
    """The coefficients of the piecewise-linear form, from the exact one.

    Speed, climb and descent match the exact form at the vehicle's limits; the tilt coefficient is
    a least-squares fit over accelerating and turning flight (braking is over-estimated: the
    published power rises when braking, too).
    """
    record = compile_vehicle(vehicle, 1.0)[()]
    limits, trim = vehicle.limits, vehicle.trim_tilt_rad_per_mps

    def level(speed: float) -> float:
        return exact_delta_thrust(record, 0.0, 0.0, -math.atan(trim * speed), 0.0, speed, 0.0, 0.0)

    hover = level(0.0)
    up, down = limits.v_up_max_mps, limits.v_down_max_mps
    climb = exact_delta_thrust(record, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, -up) - hover
    descent = exact_delta_thrust(record, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, down) - hover
    excess, extra = _tilted_flights(vehicle, record, level)
    return ThrustCorrection(
        speed_N_per_mps=level(limits.v_xy_max_mps) / limits.v_xy_max_mps,
        climb_N_per_mps=climb / up,
        descent_N_per_mps=-descent / down,
        tilt_N_per_rad=float(excess @ extra / (excess @ excess)),
    )


def _tilted_flights(vehicle, record, level) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Tilt beyond trim and the thrust it costs, over a grid of accelerating and turning flight."""
    limits, trim = vehicle.limits, vehicle.trim_tilt_rad_per_mps
    tilts, costs = [], []
    middles = (np.arange(24) + 0.5) / 24
    for speed in limits.v_xy_max_mps * middles:
        for beyond in 0.25 * middles:
            for direction in np.pi * (middles - 0.5):
                theta = -math.atan(trim * speed) - beyond * math.cos(direction)
                phi = beyond * math.sin(direction)
                if math.hypot(theta, phi) <= limits.tilt_max_rad:
                    cost = exact_delta_thrust(record, 0.0, phi, theta, 0.0, speed, 0.0, 0.0)
                    tilts.append(beyond)
                    costs.append(cost - level(float(speed)))
    return np.array(tilts), np.array(costs)
