"""How long a vehicle takes to stop: the velocity loop, flown ahead of time from all it may be in.

The axis of `governor`, with the reference moved as `inner_loop` moves it. What the bounds let it do
on one axis is the most that they let it do on two, since each is a norm over both.
"""

from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.vehicle import layout as S
from uas_coverage_env.vehicle.governor import (
    BOUND,
    ON_REFERENCE,
    VelocityLoop,
    design_velocity_loop,
    horizontal_axis,
)
from uas_coverage_env.vehicle.params import VehicleParams

FloatArray = NDArray[np.float64]

AT_REST_MPS = 0.1
"""Slower than this a UAS counts as stopped."""

_LONGEST_S = 300.0
_ARRIVED = 1e-3  # of a speed


class Stopping(NamedTuple):
    """Braking of a vehicle.

    Attributes:
        time_s: The longest that braking takes, level or vertical, whatever was flown before [s].
        way_m: What it covers from its highest level speed, flown straight on [m].
    """

    time_s: float
    way_m: float


@lru_cache(maxsize=64)
def stopping_of(vehicle: VehicleParams, dt_s: float) -> Stopping:
    """How long and how far a vehicle brakes at a sampling time.

    Begun at each moment of a flight at full speed and of the turn from there to the same speed
    backwards, at the end of which tilt and rate are the largest that there are.

    Args:
        vehicle: Parameters.
        dt_s: Length of a step [s].
    """
    loop = design_velocity_loop(vehicle, dt_s)
    axis = horizontal_axis(vehicle, dt_s)
    full_mps, trim = loop.reference_max_mps, vehicle.trim_tilt_rad_per_mps
    most = int(np.ceil(_LONGEST_S / dt_s))
    x, reference = np.array([[0.0, full_mps, trim * full_mps, 0.0]]), np.array([full_mps])
    states, references = [x], [reference]
    for _ in range(most):
        x, reference = _flown(vehicle, loop, axis, x, reference, -full_mps)
        states.append(x)
        references.append(reference)
        if abs(x[0, S.SPEED] + full_mps) < _ARRIVED * full_mps:
            break
    x, reference = np.concatenate(states), np.concatenate(references)
    x[:, S.POSITION] = 0.0
    moving = 0
    for step in range(1, most + 1):
        x, reference = _flown(vehicle, loop, axis, x, reference, 0.0)
        if (np.abs(x[:, S.SPEED]) > AT_REST_MPS).any():
            moving = step
        elif np.abs(x[:, S.SPEED :]).max() < _ARRIVED * AT_REST_MPS:
            break
    level_s = (moving + 1) * dt_s
    return Stopping(max(level_s, _vertical_s(vehicle, dt_s)), float(x[0, S.POSITION]))


def _flown(
    vehicle: VehicleParams,
    loop: VelocityLoop,
    axis: tuple[FloatArray, FloatArray],
    x: FloatArray,
    reference: FloatArray,
    wanted_mps: float,
) -> tuple[FloatArray, FloatArray]:
    """States (S, 4) and references (S,) after a step in which a velocity is asked for."""
    A, B = axis
    moved = wanted_mps - reference
    rows, per_reference = loop.rows[:, :ON_REFERENCE], loop.rows[:, ON_REFERENCE]
    held = x[:, S.SPEED :] @ rows.T + np.outer(reference, per_reference)
    change = np.outer(moved, per_reference)
    # each row allows the share at which it meets the bound on the side to which it moves
    room = np.where(change > 0.0, loop.rows[:, BOUND] - held, loop.rows[:, BOUND] + held)
    ends = np.abs(change) > 0.0
    share = np.divide(room, np.abs(change), out=np.full_like(room, np.inf), where=ends)
    reference = reference + np.clip(share.min(axis=1), 0.0, 1.0) * moved
    at_rest = np.array([1.0, vehicle.trim_tilt_rad_per_mps, 0.0])
    alpha = (np.outer(reference, at_rest) - x[:, S.SPEED :]) @ loop.gain
    return x @ A.T + np.outer(alpha, B), reference


def _vertical_s(vehicle: VehicleParams, dt_s: float) -> float:
    """Time to end the fastest climb or descent [s]."""
    limits, mass_kg = vehicle.limits, vehicle.airframe.mass_kg
    climbing_s = limits.v_up_max_mps * mass_kg / -limits.lift_min_N
    descending_s = limits.v_down_max_mps * mass_kg / limits.lift_max_N
    return dt_s * float(np.ceil(max(climbing_s, descending_s) / dt_s))
