"""Discrete gusts, which rise and fall once: V (1 - cos(2π t / T)) / 2, the shape of CS-25.341.

Over a step the air has the mean of the gust over it, so that no gust is missed between samples.
"""

import math
from typing import Any

from uas_coverage_env.compiled.kernels import inlined_kernel, kernel
from uas_coverage_env.compiled.random import uniform
from uas_coverage_env.features.feature import Disturbance
from uas_coverage_env.features.steady_wind import wind_velocity_mps

_FULL_TURN = 2.0 * math.pi
_AT_S, _LASTS_S, _PEAK, _PER_GUST = 0, 1, 2, 5  # parameters of each gust; its peak is NED
_PER_S, _EACH_LASTS_S, _LARGEST = 0, 1, 2  # parameters of gusts at random times; likewise
_BLOWS, _BEGAN_S, _SIZE = range(3)  # places in the memory


@inlined_kernel
def _passed_s(time_s, lasts_s):
    """Integral of the gust of peak 1 from its beginning to a time since then."""
    until = min(max(time_s, 0.0), lasts_s)
    return 0.5 * (until - lasts_s / _FULL_TURN * math.sin(_FULL_TURN * until / lasts_s))


@kernel
def gust_share(since_s, dt_s, lasts_s):
    """Mean over a step of a gust of peak 1 that began since_s before the step."""
    return (_passed_s(since_s + dt_s, lasts_s) - _passed_s(since_s, lasts_s)) / dt_s


@kernel
def gust(arena, state, outcome, i, parameters, memory, random):
    """Add the gusts; parameters: of each, when it begins and how long it lasts, and its peak."""
    dt_s = arena.rules[0].dt_s
    now_s = state.step[0] * dt_s
    for first in range(0, parameters.shape[0], _PER_GUST):
        share = gust_share(now_s - parameters[first + _AT_S], dt_s, parameters[first + _LASTS_S])
        for axis in range(3):
            outcome[i].wind_mps[axis] += share * parameters[first + _PEAK + axis]


@kernel
def gust_at_random(arena, state, outcome, i, parameters, memory, random):
    """Add gusts at random times.

    Parameters: how many begin per second, how long each lasts, and the largest peak, NED.
    """
    dt_s = arena.rules[0].dt_s
    now_s = state.step[0] * dt_s
    # as many numbers in each step: UAS that draw the same numbers stay together
    chance = uniform(random)
    size = uniform(random)
    if memory[_BLOWS] == 0.0 and chance < 1.0 - math.exp(-parameters[_PER_S] * dt_s):
        memory[_BLOWS] = 1.0
        memory[_BEGAN_S] = now_s
        memory[_SIZE] = size
    if memory[_BLOWS] != 0.0:
        since_s = now_s - memory[_BEGAN_S]
        share = memory[_SIZE] * gust_share(since_s, dt_s, parameters[_EACH_LASTS_S])
        for axis in range(3):
            outcome[i].wind_mps[axis] += share * parameters[_LARGEST + axis]
        if since_s + dt_s >= parameters[_EACH_LASTS_S]:
            memory[_BLOWS] = 0.0


def discrete_gusts(wind: Any) -> Disturbance:
    """The gusts of a scenario's wind that have a time."""
    parameters: list[float] = []
    for each in wind.gusts:
        peak_mps = wind_velocity_mps(each.peak_mps, each.from_deg, each.up_mps)
        parameters += [each.at_s, each.lasts_s, *peak_mps]
    return Disturbance("discrete_gusts", gust, tuple(parameters))


def random_gusts(wind: Any) -> Disturbance:
    """The gusts of a scenario's wind at random times, the same for all UAS."""
    gusts = wind.random_gusts
    assert gusts is not None
    peak_mps = wind_velocity_mps(gusts.peak_mps, wind.from_deg)
    parameters = (gusts.per_min / 60.0, gusts.lasts_s, *peak_mps)
    return Disturbance("random_gusts", gust_at_random, parameters, common=True)
