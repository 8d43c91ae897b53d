"""When a UAS has to turn home to arrive in time and with charge left.

Constants were chosen by hand; `benchmarks/return_mode.py` shows how many UAS are lost with them, in
still air and in wind (`--level`), and `benchmarks/returns.py` how much they keep.
"""

import math

from uas_coverage_env.autopilot.return_path import flight_by, latest_flight_home, route_home
from uas_coverage_env.compiled.kernels import kernel
from uas_coverage_env.entities.state import CONSUMPTION, FLYING, WIND
from uas_coverage_env.vehicle import layout as S
from uas_coverage_env.vehicle.range import SpeedLimits, TravelTimeModel, flight_seconds
from uas_coverage_env.world.coverage import can_cover

RETURN_MODE = TravelTimeModel(speed_share=2.0 / 3.0, in_turn=True, landing_s=12.0)
"""On the way home a UAS turns, climbs, and is held up by others. Chosen by hand;
`benchmarks/returns.py` shows what it costs. Recorded flights and trained policies depend on it."""

_STEPS_LATER = 3.0
"""What a step takes from what is left of the way home, in steps: the step itself, a step farther
away at full speed, and half a turn more."""

_FAR_FROM_EMPTY, _FAR_FROM_EMPTY_S = 2.0, 120.0
"""With so many times the way home left [-], and so many seconds, nothing more is looked at."""

_TOO_STRONG = 0.88
"""Of the highest airspeed: a UAS leaves a wind against which it soon could not hold its place [-].
"""

_STEADY, _UNSTEADY_S = 2.0, 20.0
"""Over home a UAS waits for a moment in which it is near and slow enough to land, or for others to
land first. Where its tube is wider than so many landing distances, charge for so many seconds is
kept for each of them that it is wider."""

_AMPLE, _AMPLE_S = 2.0, 60.0
"""With so many times the way home left [-], and so many seconds, what called a UAS home was a gust.
"""

_HELD_UP_S = 60.0
"""By how much longer than at full speed it is held up at most [s]: others are met as often on a way
of 20 km as on one of 1.4 km, on which a UAS of 12 m/s loses as much. Chosen by hand."""

UNHINDERED = RETURN_MODE._replace(speed_share=1.0)


@kernel
def seconds_home(arena, i, x):
    """Time [s] that UAS i is given to fly home and land, held up by others (`RETURN_MODE`)."""
    return _held_up_s(arena, i, x, route_home(arena, i, x[S.X], x[S.Y], x[S.Z])[2])


@kernel
def _held_up_s(arena, i, x, way_m):
    """`seconds_home` by a way of this length."""
    uas = arena.uas[i]
    altitude_m = max(-x[S.Z] + uas.home_m[2], 0.0)
    speeds = SpeedLimits(uas.speed_mps, uas.climb_mps, uas.descent_mps)
    quickly_s = flight_seconds(UNHINDERED, speeds, 0.0, way_m, 0.0, altitude_m)
    held_up_s = flight_seconds(RETURN_MODE, speeds, 0.0, way_m, 0.0, altitude_m)
    return min(held_up_s, quickly_s + _HELD_UP_S)


@kernel
def seconds_to_keep(arena, i, x, left_s, belief=None):
    """`seconds_to_keep_by` the route home from where UAS i is."""
    way = route_home(arena, i, x[S.X], x[S.Y], x[S.Z])
    return seconds_to_keep_by(way, arena, i, x, left_s, belief)


@kernel
def seconds_to_keep_by(way, arena, i, x, left_s, belief=None):
    """Time [s] that battery and clock must leave UAS i now, so that it still comes home.

    The larger of two: the calibrated flight with its margin (`flight_by`), which knows of
    braking, turning and climbing over roofs, some steps later; and the same from where it can come
    to rest after one more step (`latest_flight_home`), looked at only where little is left.

    Args:
        way: `route_home` from there.
        arena: The mission.
        i: Index of the UAS.
        x: (14,) its state.
        left_s: What battery and clock leave [s].
        belief: (N_BELIEF,) of its inner loop; None: in still air.
    """
    seconds, margin_s = flight_by(arena, i, x, way, belief)
    now_s = seconds + margin_s
    keep_s = now_s + _STEPS_LATER * arena.rules[0].dt_s
    if keep_s < left_s < _FAR_FROM_EMPTY * now_s + _FAR_FROM_EMPTY_S:
        keep_s = max(keep_s, latest_flight_home(arena, i, x, belief))
    return keep_s


@kernel
def _waiting_s(arena, i):
    """Time over home before a UAS can land, where disturbances lead it far off [s]."""
    widest_m = arena.tube_m[i, arena.tube_m.shape[1] - 1]
    return _UNSTEADY_S * max(widest_m / arena.rules[0].landing_distance_m - _STEADY, 0.0)


@kernel
def _calls_home(arena, state, i, share, more_s):
    """See `has_to_return`: for a way home that takes `share` times as long, and more_s [s]."""
    left = 0
    for w in range(state.uncovered.shape[0]):
        left += state.uncovered[w]
    if arena.rules[0].asks:
        left = 0
        for w in range(state.uncovered.shape[0]):
            left += state.uncovered[w] and can_cover(arena, i, w)
    if left == 0:
        return True
    x = state.x[i]
    rules = arena.rules[0]
    uas = arena.uas[i]
    way = route_home(arena, i, x[S.X], x[S.Y], x[S.Z])
    home_s = share * _held_up_s(arena, i, x, way[2]) + more_s
    time_left_s = (rules.max_steps - state.step[0]) * rules.dt_s
    if home_s + rules.clock_reserve_s - RETURN_MODE.landing_s > time_left_s:
        return True
    if x[S.DOD] + home_s * uas.dod_per_s >= uas.dod_max:
        return True
    belief = state.uas[i].belief[:]
    if rules.disturbed:
        wind_mps = math.hypot(belief[WIND], belief[WIND + 1])
        if wind_mps > _TOO_STRONG * arena.vehicles[i].reference_max_mps:
            return True
    # never less than the model says: what is saved now may be needed on the way
    per_s = uas.dod_per_s * (1.0 + max(belief[CONSUMPTION], 0.0))
    left_s = min(time_left_s, (uas.dod_max - x[S.DOD]) / per_s - _waiting_s(arena, i))
    keep_s = seconds_to_keep_by(way, arena, i, x, left_s, belief)
    return share * keep_s + more_s >= left_s


@kernel
def has_to_return(arena, state, i):
    """Whether UAS i has to fly home now: nothing is left to do, or battery, clock or wind say so.

    What other UAS alone can cover is nothing left to do.
    """
    return _calls_home(arena, state, i, 1.0, 0.0)


@kernel
def call_home_of(arena, state, i):
    """`call_home` for one UAS."""
    if state.uas[i].status != FLYING:
        return
    if not state.uas[i].returning:
        state.uas[i].returning = has_to_return(arena, state, i)
    elif arena.rules[0].disturbed:
        state.uas[i].returning = _calls_home(arena, state, i, _AMPLE, _AMPLE_S)


@kernel
def call_home(arena, state, nonlinear, outcome):
    """Call those home that have to return; in still air they fly home from then on.

    In wind, home may be out of reach for as long as a gust blows, or as long as a UAS is high up.
    It goes back to work when that is over, if charge and time are ample.
    """
    for i in range(state.uas.shape[0]):
        call_home_of(arena, state, i)
