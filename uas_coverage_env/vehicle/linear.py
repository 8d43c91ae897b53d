"""The discrete-time linear parameter-varying model (Vehicle_Model) (Gasche et al., Sec. II)."""

from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.vehicle import layout as S
from uas_coverage_env.vehicle.battery import (
    BatterySegment,
    check_step,
    check_vehicle,
    further_settled_V,
    is_number,
    polarisation_decay,
    segment_at,
)
from uas_coverage_env.vehicle.params import VehicleParams

_MOST_ORDER = 50
"""Of the Taylor series; many before it, further terms are below the last digit."""

FloatArray = NDArray[np.float64]


class LinearModel(NamedTuple):
    """x(k+1) = A x(k) + B u(k) + E and (soc, voltage_V, current_A) = C x(k) + D u(k) + F.

    States, inputs and outputs in the order of `layout`.
    """

    A: FloatArray
    """(14, 14)"""
    B: FloatArray
    """(14, 5)"""
    E: FloatArray
    """(14,) what hovering takes from the battery."""
    C: FloatArray
    """(3, 14)"""
    D: FloatArray
    """(3, 5)"""
    F: FloatArray
    """(3,)"""


def rigid_body(vehicle: VehicleParams) -> tuple[FloatArray, FloatArray]:
    """A (14, 14) and B (14, 5) of the continuous rigid body, linearised at hover and heading 0."""
    body = vehicle.airframe
    A, B = np.zeros((S.N_STATES, S.N_STATES)), np.zeros((S.N_STATES, S.N_INPUTS))
    A[S.X : S.Z + 1, S.VX : S.VZ + 1] = np.eye(3)
    A[S.PHI : S.PSI + 1, S.WX : S.WZ + 1] = np.eye(3)
    A[S.VX, S.THETA], A[S.VY, S.PHI] = -body.gravity_mps2, body.gravity_mps2
    A[S.VX, S.VX] = A[S.VY, S.VY] = -body.drag_kgps / body.mass_kg
    A[S.VZ, S.VZ] = -body.drag_vertical_kgps / body.mass_kg
    B[S.VZ, S.LIFT] = -1.0 / body.mass_kg
    for axis in range(3):
        B[S.WX + axis, S.TAU_X + axis] = 1.0 / body.inertia_kgm2[axis]
    return A, B


def taylor(A: FloatArray, B: FloatArray, dt_s: float, order: int) -> tuple[FloatArray, FloatArray]:
    """Discretise x' = A x + B u with u held: the series of exp(A dt) and its integral, cut off.

    A_d = sum over k = 0..order of (A dt)^k / k!,
    B_d = sum over k = 1..order of A^(k-1) dt^k / k! · B.
    """
    Ad, integral = np.eye(len(A)), np.zeros_like(A)
    term = np.eye(len(A))
    for k in range(1, order + 1):
        integral += term * dt_s / k
        term = term @ A * dt_s / k
        Ad += term
    return Ad, integral @ B


def linear_model(
    vehicle: VehicleParams, dod: float, dt_s: float = 1.0, order: int = 4
) -> LinearModel:
    """The model that holds around a depth of discharge (eq. (Vehicle_Model)).

    The battery current is evaluated at the state of the step and held over it, which reproduces
    the published series to their rounding. A landed UAS draws no current: for it neither u nor E
    acts on the battery.

    Args:
        vehicle: parameters.
        dod: depth of discharge in [0, 1] that selects the segment of the discharge curve.
        dt_s: [s] sampling time in (0, 10].
        order: N_dis, from 2 to 50; 4 is the lowest in which a torque moves the position at once.

    Returns:
        The matrices; they are shared and cannot be written to.

    Raises:
        ValueError: no vehicle, dod, dt_s or order out of range, or a step too long for the
            vehicle's drag.
    """
    check_vehicle(vehicle)
    check_step(dt_s)
    if not is_number(dod) or not 0.0 <= dod <= 1.0:
        raise ValueError(f"dod is {dod!r}; give a depth of discharge in [0, 1]")
    if not isinstance(order, (int, np.integer)) or not 2 <= order <= _MOST_ORDER:
        raise ValueError(f"order is {order!r}; give a whole number from 2 to {_MOST_ORDER}")
    return _on_segment(vehicle, segment_at(vehicle, dod), float(dt_s), int(order))


@lru_cache(maxsize=256)
def _on_segment(
    vehicle: VehicleParams, segment: BatterySegment, dt_s: float, order: int
) -> LinearModel:
    """The model on one straight piece of the discharge curve."""
    battery = vehicle.battery
    A, B = taylor(*rigid_body(vehicle), dt_s, order)
    if max(abs(A[S.VX, S.VX]), abs(A[S.VZ, S.VZ])) > 1.0:
        raise ValueError(
            f"dt_s is {dt_s}; the series of order {order} of the drag diverges, give a shorter step"
        )
    current_x, current_u = np.zeros(S.N_STATES), np.zeros(S.N_INPUTS)
    current_x[S.DOD] = segment.current_A_per_V * segment.ocv_slope_V
    current_x[S.U_TH] = segment.current_A_per_V
    current_u[S.DELTA_THRUST] = segment.current_A_per_N
    # a linear model has the paper's RC pair; further ones have settled in a hover
    further_V = sum(further_settled_V(vehicle))
    current_0 = segment.current_A - segment.current_A_per_V * (segment.drop_V - further_V)
    decay = polarisation_decay(vehicle, dt_s, order)
    E = np.zeros(S.N_STATES)
    A[S.U_TH, S.U_TH] = decay
    for row, per_ampere in (
        (S.DOD, dt_s / (3600.0 * battery.capacity_Ah)),
        (S.U_TH, (1.0 - decay) * battery.resistance_th_ohm),
    ):
        A[row] += per_ampere * current_x
        B[row] += per_ampere * current_u
        E[row] = per_ampere * current_0
    R0 = battery.resistance_0_ohm
    soc_x, voltage_x = np.zeros(S.N_STATES), -R0 * current_x
    soc_x[S.DOD] = -1.0
    voltage_x[S.DOD] -= segment.ocv_slope_V
    voltage_x[S.U_TH] -= 1.0
    model = LinearModel(
        A,
        B,
        E,
        np.stack([soc_x, voltage_x, current_x]),
        np.stack([np.zeros(S.N_INPUTS), -R0 * current_u, current_u]),
        np.array([1.0, segment.ocv_V - further_V - R0 * current_0, current_0]),
    )
    for matrix in model:
        matrix.setflags(write=False)
    return model
