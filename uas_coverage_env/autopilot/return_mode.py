"""When a UAS has to turn home to arrive in time and with charge left."""

from uas_coverage_env.autopilot.guidance import path_length_home_m
from uas_coverage_env.compiled.kernels import kernel
from uas_coverage_env.vehicle import DOD, Z
from uas_coverage_env.vehicle.range import RETURN_MODE, Speeds, flight_seconds
from uas_coverage_env.world.state import FLYING

_CLOCK_RESERVE_S = 30.0


@kernel
def seconds_home(arena, i, x):
    """Time [s] that UAS i needs to fly home and land, estimated with reserve (`RETURN_MODE`)."""
    uas = arena.uas[i]
    altitude_m = max(-x[Z] + uas.home_m[2], 0.0)
    speeds = Speeds(uas.speed_mps, uas.climb_mps, uas.descent_mps)
    way_m = path_length_home_m(arena, i, x)
    return flight_seconds(RETURN_MODE, speeds, 0.0, way_m, 0.0, altitude_m)


@kernel
def has_to_return(arena, state, i):
    """Whether UAS i has to fly home now: nothing is left to do, or battery or clock demand it."""
    left = 0
    for w in range(state.uncovered.shape[0]):
        left += state.uncovered[w]
    if left == 0:
        return True
    x = state.x[i]
    rules = arena.rules[0]
    home_s = seconds_home(arena, i, x)
    time_left_s = (rules.max_steps - state.step[0]) * rules.dt_s
    if home_s + _CLOCK_RESERVE_S - RETURN_MODE.landing_s > time_left_s:
        return True
    return x[DOD] + home_s * arena.uas[i].dod_per_s >= arena.uas[i].dod_max


@kernel
def call_home(arena, state, nonlinear, outcome):
    """Call those home who have to return; they fly home from then on.

    Args:
        arena: The arena.
        state: The state; returning is written.
        nonlinear: Not asked for: all assistants are called with the same arguments.
        outcome: Likewise.
    """
    for i in range(state.status.shape[0]):
        if state.status[i] == FLYING and not state.returning[i]:
            state.returning[i] = has_to_return(arena, state, i)
