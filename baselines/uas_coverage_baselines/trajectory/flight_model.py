"""The vehicle as the convex program sees it: a linear map, and the sets of inputs and states.

Of the 14 states of the LPV model the program takes 10: of each horizontal axis position, velocity,
tilt and rate, positive along the axis; then down and its rate. The heading is held by the inner
loop, and the battery follows from the flight (`fly_inputs`).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.autopilot.belief import GUSTS, VERTICAL_GUSTS
from uas_coverage_env.compiled.kernels import allocating_kernel
from uas_coverage_env.vehicle import layout as S
from uas_coverage_env.vehicle import lpv_step
from uas_coverage_env.vehicle.inner_loop import velocity_climb_wrench
from uas_coverage_env.vehicle.limits import N_LIMITS, write_limited

FloatArray = NDArray[np.float64]

NORTH, V_NORTH, TILT_NORTH, RATE_NORTH, EAST, V_EAST, TILT_EAST, RATE_EAST, DOWN, V_DOWN = range(10)
N_X, N_U = V_DOWN + 1, 3
POSITION = np.array([NORTH, EAST, DOWN])
VELOCITY = np.array([V_NORTH, V_EAST, V_DOWN])
NORMS = np.array([[V_NORTH, V_EAST], [TILT_NORTH, TILT_EAST], [RATE_NORTH, RATE_EAST]])
"""Pairs of states whose norms are limited: velocity, tilt, rate."""

_KEPT_BACK = 2e-4  # share of each limit that is left to the tolerance of the solver
_ACCELERATION_WEIGHT, _LIFT_WEIGHT = 2e-3, 2e-5  # on squared inputs: break ties, cost no time

_UNUSED_N = 1.0  # either side of a lift that acts on nothing: the search needs room between them


class FlightModel(NamedTuple):
    """x(n+1) = A x(n) + B u(n) + drift, and what is allowed of x and u.

    Inputs are the angular accelerations that push north and east [rad/s²], and the lift [N].
    """

    dt_s: float
    A: FloatArray
    """(10, 10), upper triangular in blocks of 4, 4 and 2."""
    B: FloatArray
    """(10, 3), each column in its block."""
    norms: FloatArray
    """(3,) largest horizontal velocity [m/s], tilt [rad] and tilt rate [rad/s]."""
    vertical: FloatArray
    """(2,) largest climb and descent [m/s]."""
    input_low: FloatArray
    """(3,)"""
    input_high: FloatArray
    """(3,)"""
    input_weight: FloatArray
    """(3,) cost of squared inputs."""
    drift: FloatArray
    """(10,) what the wind adds to x(n+1); zero in still air."""


def flight_model(
    vehicle: np.record, kept_back: float = _KEPT_BACK, speed_share: float = 1.0
) -> FlightModel:
    """The model of a compiled vehicle.

    Args:
        vehicle: Record of VEHICLE_DTYPE.
        kept_back: Share of each limit that is not used.
        speed_share: Of the largest horizontal speed, that is flown at most.
    """
    A, B = np.zeros((N_X, N_X)), np.zeros((N_X, N_U))
    for axis, rows in enumerate((slice(NORTH, EAST), slice(EAST, DOWN))):
        A[rows, rows], B[rows, axis] = vehicle.axis_A, vehicle.axis_B
    A[DOWN:, DOWN:], B[DOWN:, N_U - 1] = vehicle.vertical_A, vehicle.vertical_B
    lift = vehicle.lift_min_N, vehicle.lift_max_N
    if vehicle.holds_height:
        # down stays as it is, its rate is zero, and lift acts on nothing: its cost makes it zero
        A[DOWN:, DOWN:], B[DOWN:, N_U - 1] = np.diag([1.0, 0.0]), 0.0
        lift = -_UNUSED_N, _UNUSED_N
    share = 1.0 - kept_back
    alpha = [
        min(vehicle.torque_max_Nm[a] / vehicle.inertia_kgm2[a], vehicle.alpha_xy_max_radps2)
        for a in (1, 0)  # pitch pushes north, roll pushes east
    ]
    return FlightModel(
        dt_s=float(vehicle.dt_s),
        A=A,
        B=B,
        norms=share
        * np.array(
            [speed_share * vehicle.v_xy_max_mps, vehicle.tilt_max_rad, vehicle.rate_max_radps]
        ),
        vertical=share * np.array([vehicle.v_up_max_mps, vehicle.v_down_max_mps]),
        input_low=share * np.array([-alpha[0], -alpha[1], lift[0]]),
        input_high=share * np.array([alpha[0], alpha[1], lift[1]]),
        input_weight=np.array([_ACCELERATION_WEIGHT, _ACCELERATION_WEIGHT, _LIFT_WEIGHT]),
        drift=np.zeros(N_X),
    )


def excess(model: FlightModel, start: FloatArray) -> float:
    """The share by which a state (10,) is beyond the limits of a model; 0 within them."""
    norms = np.linalg.norm(start[NORMS], axis=1) / model.norms
    vertical = np.array([-start[V_DOWN], start[V_DOWN]]) / model.vertical
    return max(float(norms.max()), float(vertical.max()), 1.0) - 1.0


def in_wind(model: FlightModel, wind_mps: FloatArray) -> FlightModel:
    """The same vehicle in a steady wind, with its velocity over ground.

    In air that moves, a UAS flies as in still air, seen from the air. As the inner loop does, the
    limits of speed leave room for gusts.

    Args:
        model: In still air.
        wind_mps: (2,) north and east.
    """
    air = np.zeros(N_X)
    air[[V_NORTH, V_EAST]] = wind_mps
    drift = air - model.A @ air
    drift[[NORTH, EAST]] += model.dt_s * wind_mps
    speed_mps = float(np.hypot(wind_mps[0], wind_mps[1]))
    norms = model.norms - np.array([GUSTS * speed_mps, 0.0, 0.0])
    return model._replace(
        drift=drift, norms=norms, vertical=model.vertical - VERTICAL_GUSTS * speed_mps
    )


def reduced_state(x: FloatArray) -> FloatArray:
    """(10,) of the program, of a state (14,)."""
    return np.array(
        [
            x[S.X],
            x[S.VX],
            -x[S.THETA],
            -x[S.WY],
            x[S.Y],
            x[S.VY],
            x[S.PHI],
            x[S.WX],
            x[S.Z],
            x[S.VZ],
        ],
        np.float64,
    )


@allocating_kernel
def fly_inputs(vehicle, start, inputs):
    """Fly inputs of the program in the LPV model, as the world does.

    Args:
        vehicle: Record of VEHICLE_DTYPE.
        start: (14,) state.
        inputs: (N, 3).

    Returns:
        States (N+1, 14), inputs of the world (N, 5), and (N_LIMITS,) the share of each limit that
        is used at most; of the last, a lower limit, the share that the limit has of what is left.
    """
    n_steps = len(inputs)
    x, u = np.empty((n_steps + 1, start.shape[0])), np.zeros((n_steps, 5))
    reference, values = np.empty(2), np.empty(N_LIMITS)
    used = np.zeros(N_LIMITS)
    x[0] = start
    for n in range(n_steps):
        reference[0], reference[1] = x[n, S.VX], x[n, S.VY]
        # the heading is held by the inner loop; lift and the other torques are the program's
        velocity_climb_wrench(vehicle, x[n], reference, x[n, S.VX], x[n, S.VY], 0.0, u[n])
        u[n, S.LIFT] = inputs[n, 2]
        u[n, S.TAU_X] = inputs[n, 1] * vehicle.inertia_kgm2[0]
        u[n, S.TAU_Y] = -inputs[n, 0] * vehicle.inertia_kgm2[1]
        voltage, current = lpv_step(vehicle, x[n], u[n], x[n + 1])
        write_limited(x[n + 1], voltage, current, False, values)
        for k in range(N_LIMITS - 1):
            used[k] = max(used[k], values[k] / vehicle.bounds[k])
        used[N_LIMITS - 1] = max(used[N_LIMITS - 1], vehicle.bounds[N_LIMITS - 1] / voltage)
    return x, u, used
