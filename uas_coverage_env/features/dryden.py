"""Dryden turbulence at low altitude (MIL-F-8785C, Sec. 3.7.3), sampled exactly at any time step.

Intensities and scale lengths, with the height h in feet from 10 to 1000 and W_20 the mean wind at
20 ft:

    sigma_w = 0.1 W_20,    sigma_u = sigma_v = sigma_w / (0.177 + 0.000823 h)^0.4,
    L_w = h,               L_u = L_v = h / (0.177 + 0.000823 h)^1.2.

Along the mean wind the spectrum is of first order, across it and vertically of second order,
(1 + √3 T s) / (1 + T s)², with T = L / V. The filters' states are kept with unit variance, so that
height and airspeed may change from step to step and the turbulence stays stationary.
"""

import math
from typing import Any

from uas_coverage_env.compiled.kernels import inlined_kernel, kernel
from uas_coverage_env.compiled.random import normal
from uas_coverage_env.features.feature import Disturbance
from uas_coverage_env.features.steady_wind import mean_wind_mps, wind_velocity_mps
from uas_coverage_env.vehicle.layout import VX, Z

FOOT_M = 0.3048
LOWEST_FT, HIGHEST_FT = 10.0, 1000.0
BOUND_SIGMAS = 3.0
"""Each component is cut off at so many intensities: there is a largest gust."""

SLOWEST_MPS = 1.0
"""The least airspeed at which turbulence is flown through: eddies decay, too [m/s]."""

_ROOT_3 = math.sqrt(3.0)
_SIGMA_W, _NORTH, _EAST = range(3)  # parameters
_ALONG, _ACROSS, _VERTICAL, _BEGUN = 0, 1, 3, 5  # places in the memory


@inlined_kernel
def scales(height_m, sigma_w_mps):
    """Horizontal intensity [m/s], horizontal and vertical scale length [m] at a height."""
    feet = min(max(height_m / FOOT_M, LOWEST_FT), HIGHEST_FT)
    shape = 0.177 + 0.000823 * feet
    return sigma_w_mps / shape**0.4, feet * FOOT_M / shape**1.2, feet * FOOT_M


@inlined_kernel
def advance_first_order(memory, at, ratio, random):
    """One step of a filter 1 / (1 + T s) with an output of unit variance; ratio is dt / T."""
    left = math.exp(-ratio)
    memory[at] = left * memory[at] + math.sqrt(1.0 - left * left) * normal(random)


@inlined_kernel
def advance_second_order(memory, at, ratio, random):
    """One step of a filter 1 / (1 + T s)², whose two states have unit covariance."""
    left = math.exp(-ratio)
    a = left * (1.0 + ratio)
    b = left * ratio
    c = left * (1.0 - ratio)
    # the covariance of the noise is what the step takes from the unit covariance
    q_aa = max(1.0 - a * a - b * b, 0.0)
    q_ab = a * b - b * c
    q_bb = 1.0 - b * b - c * c
    first = math.sqrt(q_aa)
    mixed = q_ab / first if first > 0.0 else 0.0
    own = math.sqrt(max(q_bb - mixed * mixed, 0.0))
    noise = normal(random)
    x = memory[at]
    y = memory[at + 1]
    memory[at] = a * x + b * y + first * noise
    memory[at + 1] = -b * x + c * y + mixed * noise + own * normal(random)


@inlined_kernel
def second_order_output(memory, at):
    """(1 + √3 T s) of the filter: unit variance."""
    return 0.5 * (memory[at] + _ROOT_3 * memory[at + 1])


@inlined_kernel
def _cut(value):
    return min(max(value, -BOUND_SIGMAS), BOUND_SIGMAS)


@kernel
def swirl(arena, state, outcome, i, parameters, memory, random):
    """Add the turbulence at UAS i, which flies through the air that moves with the mean wind.

    Parameters: sigma_w [m/s], and the direction in which the mean wind blows, a unit vector (2,).
    """
    event = outcome[i]
    sigma_w = parameters[_SIGMA_W]
    north = parameters[_NORTH]
    east = parameters[_EAST]
    sigma_u, length_u, length_w = scales(-state.x[i, Z], sigma_w)
    square = 0.0
    for axis in range(3):
        through = state.x[i, VX + axis] - event.wind_mps[axis]
        square += through * through
    way_m = arena.rules[0].dt_s * max(math.sqrt(square), SLOWEST_MPS)
    if memory[_BEGUN] == 0.0:
        for k in range(_BEGUN):
            memory[k] = normal(random)
        memory[_BEGUN] = 1.0
    else:
        advance_first_order(memory, _ALONG, way_m / length_u, random)
        advance_second_order(memory, _ACROSS, way_m / length_u, random)
        advance_second_order(memory, _VERTICAL, way_m / length_w, random)
    along = sigma_u * _cut(memory[_ALONG])
    across = sigma_u * _cut(second_order_output(memory, _ACROSS))
    event.wind_mps[0] += north * along - east * across
    event.wind_mps[1] += east * along + north * across
    event.wind_mps[2] += sigma_w * _cut(second_order_output(memory, _VERTICAL))


def turbulence(wind: Any) -> Disturbance:
    """The turbulence of the wind of a scenario, of its own for each UAS."""
    at_20_ft_mps = mean_wind_mps(wind, 20.0 * FOOT_M)
    north, east, _ = wind_velocity_mps(1.0, wind.from_deg)
    return Disturbance("turbulence", swirl, (0.1 * at_20_ft_mps * wind.turbulence, north, east))
