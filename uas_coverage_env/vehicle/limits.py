"""Which of a vehicle's limits a sample exceeds: the set X of Gasche et al., Sec. II.

Inputs need no such question: they are kept within U where they act (`clip_wrench`). A state can
leave X all the same, since torques within their limits add up to any rate, tilt and speed.

The thrust correction is judged by the current that it draws. The bound of the heading is not a
capability: it keeps the linearisation of the plan valid, and does not hold for a UAS that looks
where it flies (`heading = "course"`), whose tilts are on axes that do not turn.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.compiled.kernels import inlined_kernel, kernel, stack_array
from uas_coverage_env.vehicle import layout as S
from uas_coverage_env.vehicle.params import VehicleParams


class Limit(NamedTuple):
    """A quantity that a vehicle limits.

    Attributes:
        name: As in the record of a flight.
        unit: Of its values.
        meaning: What is measured.
    """

    name: str
    unit: str
    meaning: str


LIMITS = (
    Limit("speed", "m/s", "norm of the horizontal velocity"),
    Limit("climb", "m/s", "upward velocity"),
    Limit("descent", "m/s", "downward velocity"),
    Limit("tilt", "rad", "norm of roll and pitch"),
    Limit("tilt_rate", "rad/s", "norm of the roll and the pitch rate of the body"),
    Limit("yaw_rate", "rad/s", "absolute rate of the heading"),
    Limit("current", "A", "battery current"),
    Limit("voltage", "V", "battery voltage (a lower limit)"),
)
"""The place of a limit is its bit in masks."""

LIMIT_NAMES = tuple(limit.name for limit in LIMITS)
"""Names of the limits, by their bit."""

N_LIMITS = len(LIMITS)
_SPEED, _CLIMB, _DESCENT, _TILT, _TILT_RATE, _YAW_RATE, _CURRENT, _VOLTAGE = (
    LIMIT_NAMES.index(name)
    for name in ["speed", "climb", "descent", "tilt", "tilt_rate", "yaw_rate", "current", "voltage"]
)

LPV_TOLERANCE = 0.01
"""Share of a limit by which it may be exceeded in the LPV model. Plan and world are the same there,
and the inner loop keeps every limit to the last digits."""

NONLINEAR_TOLERANCE = 0.15
"""The same in the nonlinear plant, where a step does not end where the linear model says: the inner
loop overshoots the speed by up to 9 % at steps of 1 s and by up to 12 % at 2 s."""

DISTURBED_TOLERANCE = 0.15
"""The same in both models where disturbances act, of which the inner loop knows nothing."""

LOST_BEYOND = 1.5
"""A learner's wrench that takes a UAS beyond so many times its limit of speed or of tilt loses it:
the models are not made for such states, which no inner loop leads back from."""


def limit_bounds(vehicle: VehicleParams) -> NDArray[np.float64]:
    """(N_LIMITS,) the bound of each limit, in its unit."""
    limits, battery = vehicle.limits, vehicle.battery
    return np.array(
        [
            limits.v_xy_max_mps,
            limits.v_up_max_mps,
            limits.v_down_max_mps,
            limits.tilt_max_rad,
            limits.rate_max_radps,
            limits.yaw_rate_max_radps,
            battery.current_max_A,
            battery.voltage_min_V,
        ]
    )


@inlined_kernel
def write_limited(x, voltage_V, current_A, body_rates, values):
    """Write what is limited, in the order of LIMITS.

    Args:
        x: (14,) state.
        voltage_V: Battery voltage over the step that led to it.
        current_A: Battery current over that step.
        body_rates: The state is of the nonlinear plant, whose heading turns at another rate than
            the body about its own axis; not so where its tilts are on axes that do not turn.
        values: (N_LIMITS,) written.
    """
    values[_SPEED] = math.sqrt(x[S.VX] * x[S.VX] + x[S.VY] * x[S.VY])
    values[_CLIMB] = -x[S.VZ]
    values[_DESCENT] = x[S.VZ]
    values[_TILT] = math.sqrt(x[S.PHI] * x[S.PHI] + x[S.THETA] * x[S.THETA])
    values[_TILT_RATE] = math.sqrt(x[S.WX] * x[S.WX] + x[S.WY] * x[S.WY])
    yaw_rate = x[S.WZ]
    if body_rates:
        yaw_rate = math.sin(x[S.PHI]) * x[S.WY] + math.cos(x[S.PHI]) * x[S.WZ]
        yaw_rate /= math.cos(x[S.THETA])
    values[_YAW_RATE] = abs(yaw_rate)
    values[_CURRENT] = current_A
    values[_VOLTAGE] = voltage_V


@kernel
def limits_exceeded(vehicle, x, voltage_V, current_A, nonlinear, disturbed):
    """The limits exceeded by more than the tolerance, as a mask: bit k for LIMITS[k].

    Args:
        vehicle: record of VEHICLE_DTYPE.
        x: See `write_limited`, also the next two.
        voltage_V: [V].
        current_A: [A].
        nonlinear: The state is of the nonlinear plant, which has a tolerance of its own.
        disturbed: Whether disturbances act; likewise.
    """
    values = stack_array(N_LIMITS)
    body_rates = nonlinear and not vehicle.follows_course
    write_limited(x, voltage_V, current_A, body_rates, values)
    tolerance = LPV_TOLERANCE
    if nonlinear:
        tolerance = NONLINEAR_TOLERANCE
    if disturbed:
        tolerance = max(tolerance, DISTURBED_TOLERANCE)
    more = 1.0 + tolerance
    mask = 0
    for k in range(_VOLTAGE):
        if values[k] > more * vehicle.bounds[k]:
            mask |= 1 << k
    if values[_VOLTAGE] < (1.0 - tolerance) * vehicle.bounds[_VOLTAGE]:
        mask |= 1 << _VOLTAGE
    return mask


@kernel
def is_out_of_control(vehicle, x):
    """Whether a state is beyond `LOST_BEYOND` times the limit of speed or of tilt.

    Args:
        vehicle: record of VEHICLE_DTYPE.
        x: (14,) state.
    """
    values = stack_array(N_LIMITS)
    write_limited(x, 0.0, 0.0, False, values)
    slow = values[_SPEED] <= LOST_BEYOND * vehicle.bounds[_SPEED]
    level = values[_TILT] <= LOST_BEYOND * vehicle.bounds[_TILT]
    return not (slow and level)


def limit_names(mask: int) -> tuple[str, ...]:
    """The names of the limits in a mask."""
    return tuple(name for bit, name in enumerate(LIMIT_NAMES) if int(mask) >> bit & 1)
