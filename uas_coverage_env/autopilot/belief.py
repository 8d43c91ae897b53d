"""What the inner loop believes of disturbances, and how it flies with that.

In air that moves steadily a UAS flies as it does in still air, seen from the air. So the loop takes
state, reference and command relative to the wind that it believes in: the governor's bounds on
tilt, rates, angular acceleration and speed then hold for the flight through the air as they do in
still air, and what is wrong in the belief is all that is left to disturb it.

The belief is the mean of what the last steps were off by: of each sample the loop expects what its
model and its belief say. A steady horizontal force is taken for the wind that would cause it, by
drag. Where no disturbance is declared, nothing here is flown.

Constants without a source were chosen by hand on missions in wind; what they cost is shown by
`benchmarks/returns.py --level moderate` and `benchmarks/return_mode.py --level strong`.
"""

import math

from uas_coverage_env.autopilot.control import steered_wrench
from uas_coverage_env.compiled.kernels import inlined_kernel, kernel, stack_array
from uas_coverage_env.entities.commands import CLIMB, VELOCITY, WRENCH
from uas_coverage_env.entities.state import CONSUMPTION, EXPECTED, EXPECTED_DOD, SINK, WIND
from uas_coverage_env.vehicle import layout as S
from uas_coverage_env.vehicle import lpv_step, plant_step
from uas_coverage_env.vehicle.layout import N_INPUTS, N_STATES
from uas_coverage_env.vehicle.lpv import fly_kinematics
from uas_coverage_env.vehicle.tube import FORGETS_S

SEES_CONSUMPTION_S = 30.0
"""In what time most of a belief in the consumption is of what came since: longer than `FORGETS_S`
of the wind, as it takes longer to tell from noise [s]."""

MOST_WIND = 0.95
"""Of the highest speed: a UAS believes in no wind in which it could not hover [-]."""

LEAST_GROUND_MPS = 0.2
"""Estimates of flight times take no ground speed to be lower, however hard the wind blows."""

_UNKNOWN_MPS, _UNKNOWN_SHARE = 0.5, 0.05
"""The wind on the way may be stronger than believed by this, and this share of it [-]."""

GUSTS = 0.1
"""What is kept of the speed limit for gusts, of the wind believed in [-]."""

_SHEAR_S = 0.7
"""What is kept of it while climbing, for wind that grows with height: so long a climb at the wind
believed in over the height. By the logarithmic law wind grows over a metre by a fifth of that, and
the belief and the vehicle together take 3.5 s to follow [s]."""

_MOST_SHEAR = 0.5
"""Of the wind believed in, the most that is kept for that [-]."""

_GROWTH = 0.2
"""Of a wind, what it grows by while the height grows by a factor of e: by the logarithmic law, at
some metres above open country [-]."""

VERTICAL_GUSTS = 0.04
"""What is kept of the limits of climb and descent for gusts, of the wind believed in [-]."""

MOST_SINK_MPS2 = 3.0
"""No stronger vertical acceleration is believed in."""

CONSUMPTION_BOUNDS = (-0.3, 1.0)
"""Nor a consumption that is lower or higher than the model's by more than these shares of it [-].
"""

_LEAST_DOD = 1e-7
"""Below so little expected in a step, nothing is learnt of the consumption [-]."""


@kernel
def speed_along(most_mps, wind_north_mps, wind_east_mps, north, east):
    """The highest ground speed along a direction at an airspeed, held against a crosswind [m/s].

    The wind is slower than that; the direction is of length 1.
    """
    along = wind_north_mps * north + wind_east_mps * east
    across2 = wind_north_mps**2 + wind_east_mps**2 - along * along
    return along + math.sqrt(max(most_mps * most_mps - across2, 0.0))


@inlined_kernel
def estimated_speed(most_mps, limit_mps, wind_north_mps, wind_east_mps, north, east):
    """The ground speed along a direction that estimates of flight times count on [m/s].

    That at full airspeed against a wind that blows a little more than is believed, within limit_mps
    however much it blows from behind; other arguments as above.
    """
    speed_mps = speed_along(most_mps, wind_north_mps, wind_east_mps, north, east)
    speed_mps -= _UNKNOWN_MPS + _UNKNOWN_SHARE * math.hypot(wind_north_mps, wind_east_mps)
    return min(max(speed_mps, LEAST_GROUND_MPS), limit_mps)


@kernel
def wind_growth(height_m, from_m):
    """The wind at a height over that at another; below a metre it is that of a metre."""
    return 1.0 + _GROWTH * math.log(max(height_m, 1.0) / max(from_m, 1.0))


@inlined_kernel
def ground_speed(most_mps, kept, wind_north_mps, wind_east_mps, north, east):
    """The highest ground speed that is flown along a direction [m/s]; arguments as above.

    Over ground a gust must not lead far beyond the limit either: `kept` of the wind is kept of it.
    """
    within_mps = most_mps - kept * math.sqrt(wind_north_mps**2 + wind_east_mps**2)
    along_mps = speed_along(most_mps, wind_north_mps, wind_east_mps, north, east)
    return min(within_mps, max(along_mps, 0.0))


@inlined_kernel
def vertical_margin_mps(belief):
    """By how much slower than its limits a UAS climbs and descends in the wind believed in."""
    return VERTICAL_GUSTS * math.sqrt(belief[WIND] ** 2 + belief[WIND + 1] ** 2)


@inlined_kernel
def believed_wrench(vehicle, belief, x, reference, command, u):
    """`command_wrench` in the wind believed in; arguments as there, and belief (N_BELIEF,).

    A velocity that this wind does not allow is flown as fast as it does, in its direction.
    """
    north_mps, east_mps = x[S.VX], x[S.VY]
    wind_north_mps, wind_east_mps = belief[WIND], belief[WIND + 1]
    first, second = command.values[0], command.values[1]
    if command.kind == VELOCITY or command.kind == CLIMB:
        speed_mps = math.sqrt(first * first + second * second)
        share = 0.0
        if speed_mps > 0.0:
            growth = _SHEAR_S * max(-x[S.VZ], 0.0) / max(-x[S.Z], 1.0)
            most_mps = ground_speed(
                vehicle.reference_max_mps, GUSTS + min(growth, _MOST_SHEAR),
                wind_north_mps, wind_east_mps, first / speed_mps, second / speed_mps,
            )  # fmt: skip
            share = min(speed_mps, most_mps) / speed_mps
        first = share * first - wind_north_mps
        second = share * second - wind_east_mps
    x[S.VX] = north_mps - wind_north_mps
    x[S.VY] = east_mps - wind_east_mps
    reference[0] -= wind_north_mps
    reference[1] -= wind_east_mps
    steered_wrench(vehicle, x, reference, command, first, second, u)
    reference[0] += wind_north_mps
    reference[1] += wind_east_mps
    x[S.VX], x[S.VY] = north_mps, east_mps
    if command.kind != WRENCH:
        lift_N = u[S.LIFT] - belief[SINK] / vehicle.vertical_B[S.SPEED]
        # lift takes from the speed downwards: the lift of the fastest descent is the least
        # neither limit relies on a sink that may have ended: a motor gives less than it is asked
        # for at its limit only, air sinks here and not there
        held_mps = vehicle.vertical_A[S.SPEED, S.SPEED] * x[S.VZ]
        margin_mps = vertical_margin_mps(belief)
        down_mps = vehicle.v_down_max_mps - margin_mps
        up_mps = vehicle.v_up_max_mps - margin_mps
        descending_mps = held_mps + max(belief[SINK], 0.0)
        climbing_mps = held_mps + min(belief[SINK], 0.0)
        lift_N = max(lift_N, (down_mps - descending_mps) / vehicle.vertical_B[S.SPEED])
        lift_N = min(lift_N, (-up_mps - climbing_mps) / vehicle.vertical_B[S.SPEED])
        u[S.LIFT] = min(max(lift_N, vehicle.lift_min_N), vehicle.lift_max_N)


@inlined_kernel
def believed_kinematics(vehicle, belief, nonlinear, x, u):
    """Fly one step in place as the belief says; of the battery, the linear model says nothing."""
    wind_north_mps, wind_east_mps = belief[WIND], belief[WIND + 1]
    x[S.VX] -= wind_north_mps
    x[S.VY] -= wind_east_mps
    if nonlinear:
        plant_step(vehicle, x, u, x)
    else:
        fly_kinematics(vehicle, x, u)
    _leave_belief(vehicle, belief, x)


@inlined_kernel
def _leave_belief(vehicle, belief, x):
    dt_s = vehicle.dt_s
    x[S.VX] += belief[WIND]
    x[S.VY] += belief[WIND + 1]
    x[S.X] += dt_s * belief[WIND]
    x[S.Y] += dt_s * belief[WIND + 1]
    x[S.VZ] += belief[SINK]
    x[S.Z] += 0.5 * dt_s * belief[SINK]


@inlined_kernel
def expect(vehicle, belief, nonlinear, x, u):
    """Note in the belief what it expects of the next sample.

    `u` is what the motors are asked for.
    """
    after = stack_array(N_STATES)
    asked = stack_array(N_INPUTS)
    for k in range(N_STATES):
        after[k] = x[k]
    for k in range(N_INPUTS):
        asked[k] = u[k]
    after[S.VX] -= belief[WIND]
    after[S.VY] -= belief[WIND + 1]
    if nonlinear:
        plant_step(vehicle, after, asked, after)
    else:
        lpv_step(vehicle, after, asked, after)
    _leave_belief(vehicle, belief, after)
    for axis in range(3):
        belief[EXPECTED + axis] = after[S.VX + axis]
    belief[EXPECTED_DOD] = after[S.DOD] - x[S.DOD]


@inlined_kernel
def learn(vehicle, belief, step, dod_before, x):
    """Correct the belief by what came instead of what was expected.

    `step` and `dod_before` are of the sample before, `x` is the state that was reached. The first
    steps all count alike.
    """
    dt_s = vehicle.dt_s
    gain = max(1.0 - math.exp(-dt_s / FORGETS_S), 1.0 / (1.0 + step))
    # a wind moves the velocity by what drag takes of it in a step
    per_wind = 1.0 - vehicle.axis_A[S.SPEED, S.SPEED]
    for axis in range(2):
        off_mps = x[S.VX + axis] - belief[EXPECTED + axis]
        belief[WIND + axis] += gain * off_mps / per_wind
    wind_mps = math.sqrt(belief[WIND] ** 2 + belief[WIND + 1] ** 2)
    most_mps = MOST_WIND * vehicle.reference_max_mps
    if wind_mps > most_mps:
        belief[WIND] *= most_mps / wind_mps
        belief[WIND + 1] *= most_mps / wind_mps
    sink = belief[SINK] + gain * (x[S.VZ] - belief[EXPECTED + 2])
    belief[SINK] = min(max(sink, -MOST_SINK_MPS2 * dt_s), MOST_SINK_MPS2 * dt_s)
    if belief[EXPECTED_DOD] > _LEAST_DOD:
        off = (x[S.DOD] - dod_before) / belief[EXPECTED_DOD] - 1.0 - belief[CONSUMPTION]
        seen = belief[CONSUMPTION] + (1.0 - math.exp(-dt_s / SEES_CONSUMPTION_S)) * off
        belief[CONSUMPTION] = min(max(seen, CONSUMPTION_BOUNDS[0]), CONSUMPTION_BOUNDS[1])
