"""Design of the velocity loop: feedback gain, and the rows by which the governor keeps bounds.

Everything here happens once, when a vehicle is compiled. A horizontal axis is velocity, tilt and
rate with the angular acceleration as input; both axes are the same, so a linear combination of
quantities that each keep a Euclidean bound over both axes keeps the combined bound, too. That is
why the tests below, which look at one axis, certify norms over two.
"""

import math
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_discrete_are
from scipy.optimize import linprog
from scipy.spatial import ConvexHull

from uas_coverage_env.vehicle import layout as S
from uas_coverage_env.vehicle.linear import rigid_body, taylor
from uas_coverage_env.vehicle.params import VehicleParams

FloatArray = NDArray[np.float64]

ORDER = 4
"""N_dis of the compiled vehicle."""

ON_SPEED, ON_TILT, ON_RATE, ON_REFERENCE, BOUND = range(5)
"""Columns of a governor row, see `VelocityLoop`; the first three are also those of the gain."""

N_ROW_COLUMNS = BOUND + 1

_TORQUE_COST = 30.0  # settles 12 m/s in about 7 s, near the time optimum
_QUICK_S = 4.4  # the shipped vehicles lean over and stop from full speed in hardly more at best
_STEPS_S = 0.5  # of a scale for each second of a step
_REFERENCE_SHARE = 0.999  # of the speed limit: a bound that is only approached is certified
_SETTLED_S = 10.0
_LONGEST_S = 60.0
_IMPLIED = 1.0 - 1e-6  # the linear programs are exact to 1e-7
_FINE_S = 0.1
"""Shorter steps make rows that hardly differ from their neighbours: of these, a few are kept, with
bounds that are narrower by `_NARROWER`, which imply the others as they are. What these allow alone
may still be used a little, so `_SPARE` of each limit is left [s]."""

_NARROWER, _SPARE = 2e-3, 1e-2


class VelocityLoop(NamedTuple):
    """Angular acceleration = -gain · (v - r, tilt - trim r, rate) for a governed reference r.

    A row (a_v, a_tilt, a_rate, b, bound), in the order of `ON_SPEED` and the names beside it, says
    that a · (v, tilt, rate) + b r, a quantity of one of the coming steps while r is held, stays
    within its bound.
    """

    gain: FloatArray
    """(3,)"""
    rows: FloatArray
    """(R, 5)"""
    reference_max_mps: float


def horizontal_axis(vehicle: VehicleParams, dt_s: float) -> tuple[FloatArray, FloatArray]:
    """One-step map A (4, 4), B (4,) of position, velocity, tilt and rate along one axis.

    The input is the angular acceleration [rad/s²]; tilt and rate are positive where they push
    along the axis: pitch and its rate negated for north, roll and its rate for east.
    """
    A, B = taylor(*rigid_body(vehicle), dt_s, ORDER)
    chain = [S.X, S.VX, S.THETA, S.WY]
    forward = np.array([1.0, 1.0, -1.0, -1.0])
    axis_A = A[np.ix_(chain, chain)] * np.outer(forward, forward)
    return axis_A, -B[chain, S.TAU_Y] * forward * vehicle.airframe.inertia_kgm2[1]


def time_scale(vehicle: VehicleParams, dt_s: float) -> float:
    """By what the times of the velocity loop, where it is below 1, and of guidance are multiplied.

    1 for vehicles that take as long to stop as the shipped ones, or longer: the loop is as quick
    for a small step, and the governor holds it back. One that could stop in a fourth of the time
    has half of it, since tilt follows its own loop. And no less than half a step: a velocity is
    held that long, and what is steered more quickly swings.

    Args:
        vehicle: Parameters.
        dt_s: Length of a step [s].
    """
    limits = vehicle.limits
    most_mps2 = vehicle.airframe.gravity_mps2 * math.tan(limits.tilt_max_rad)
    leaning_s = 2.0 * math.sqrt(limits.tilt_max_rad / limits.angular_acceleration_xy_max_radps2)
    quickness = math.sqrt((limits.v_xy_max_mps / most_mps2 + leaning_s) / _QUICK_S)
    return max(min(quickness, 1.0), _STEPS_S * dt_s)


@lru_cache(maxsize=64)
def design_velocity_loop(vehicle: VehicleParams, dt_s: float) -> VelocityLoop:
    """Feedback gain and governor rows of a vehicle.

    The predicted quantities of the first ten seconds are taken, more where that is not enough for
    the quantities of the step after to be implied. Then the set of states and references that keep
    all rows is invariant while the reference is held, and the bounds hold for ever. Rows implied
    by the others are dropped.

    Raises:
        ValueError: no such horizon: the limits contradict each other.
    """
    axis_A, axis_B = horizontal_axis(vehicle, dt_s)
    A, B = axis_A[1:, 1:], axis_B[1:, None]
    # three integrators in a row: times go with the sixth root
    quickness = min(time_scale(vehicle, dt_s), 1.0)
    cost = _TORQUE_COST * quickness**6
    P = solve_discrete_are(A, B, np.diag([1.0, 0.0, 0.0]), np.array([[cost]]))
    gain = np.linalg.solve(cost + B.T @ P @ B, B.T @ P @ A)[0]
    fine = dt_s < _FINE_S
    usable = 1.0 - _SPARE if fine else 1.0
    reference_max_mps = _REFERENCE_SHARE * usable * vehicle.limits.v_xy_max_mps
    held = np.array([0.0, 0.0, 0.0, 1.0, reference_max_mps])
    steps = int(np.ceil(quickness * _SETTLED_S / dt_s))
    while True:
        rows, following = _predicted(vehicle, A - B @ gain[None], gain, steps)
        rows[:, BOUND] *= usable
        following[:, BOUND] *= usable
        known = np.vstack([rows, held])
        if all(_is_implied(row, known) for row in following):
            break
        steps += max(steps // 4, 1)
        if steps * dt_s > _LONGEST_S:
            raise ValueError(
                f"limits of {vehicle.name!r} cannot be kept at dt_s {dt_s}; "
                "raise limits.tilt_max_rad or lower limits.v_xy_max_mps"
            )
    if fine:
        rows = _outermost(rows)
        return VelocityLoop(gain, _without_implied(rows, held, _NARROWER), reference_max_mps)
    return VelocityLoop(gain, _without_implied(rows, held), reference_max_mps)


def _predicted(
    vehicle: VehicleParams, closed: FloatArray, gain: FloatArray, steps: int
) -> tuple[FloatArray, FloatArray]:
    """Rows of the coming steps, and the rows of the step after them."""
    trim, limits = vehicle.trim_tilt_rad_per_mps, vehicle.limits
    at_rest = np.array([1.0, trim, 0.0])
    rate, tilt, velocity = np.eye(3)[::-1]
    # the torques act in the present step, everything else can be changed in the next at the soonest
    quantities = (
        (-gain, 0.0, limits.angular_acceleration_xy_max_radps2, 0),
        (rate, 0.0, limits.rate_max_radps, 1),
        (tilt, trim, limits.tilt_max_rad, 1),
        (velocity, 1.0, limits.v_xy_max_mps, 1),
    )
    rows: list[list[float]] = []
    last: list[list[float]] = []
    power = np.eye(3)
    for step in range(steps + 1):
        for pick, settled, bound, first in quantities:
            if step >= first:
                row = pick @ power
                entry = [*row, float(settled - row @ at_rest), bound]
                (rows if step < steps else last).append(entry)
        power = closed @ power
    return np.array(rows), np.array(last)


def _is_implied(row: FloatArray, known: FloatArray) -> bool:
    """Whether the known rows alone keep |a · s + b r| within its bound, by a linear program."""
    scaled = known[:, :BOUND] / known[:, BOUND:]
    result: Any = linprog(
        -row[:BOUND] / row[BOUND],
        A_ub=np.vstack([scaled, -scaled]),
        b_ub=np.ones(2 * len(scaled)),
        bounds=(None, None),
        method="highs",
    )
    return result.status == 0 and -result.fun <= _IMPLIED


def _outermost(rows: FloatArray) -> FloatArray:
    """The rows that no others imply, by the corners of what they span: quicker for thousands."""
    scaled = rows[:, :BOUND] / rows[:, BOUND:]
    corners = ConvexHull(np.vstack([scaled, -scaled])).vertices
    return rows[np.unique(corners % len(rows))]


def _without_implied(rows: FloatArray, held: FloatArray, narrower: float = 0.0) -> FloatArray:
    """The rows less those that the others imply, with narrower bounds; late steps go first."""
    kept, full = list(range(len(rows))), rows
    rows = rows.copy()
    rows[:, BOUND] *= 1.0 - narrower
    for index in reversed(range(len(rows))):
        others = [k for k in kept if k != index]
        if _is_implied(full[index], np.vstack([rows[others], held])):
            kept = others
    return rows[kept]
