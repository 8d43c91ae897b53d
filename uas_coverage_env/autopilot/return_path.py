"""How far home is: time that the flight takes past the fixed obstacles, as guidance flies it."""

import math

from uas_coverage_env.autopilot.belief import estimated_speed, vertical_margin_mps
from uas_coverage_env.autopilot.guidance import (
    HEADROOM_M,
    is_tight,
    passes_over,
    seconds_at_rest,
    target_position,
)
from uas_coverage_env.compiled.kernels import inlined_kernel, kernel
from uas_coverage_env.entities.commands import HOME
from uas_coverage_env.entities.state import WIND
from uas_coverage_env.vehicle import layout as S
from uas_coverage_env.vehicle.range import margin_to_land, seconds_to_land
from uas_coverage_env.world.overhangs import is_below_overhang, widest_overhang_m
from uas_coverage_env.world.places import may_be_at
from uas_coverage_env.world.routes import (
    CLEAR,
    ROUND_CORNER,
    crossing,
    leg_from_corner,
    route,
)

_MOST_LEGS = 12  # of a way that are looked at

_STOPPING = 1.5
"""Of the time that the largest acceleration takes to stop [-]; `vehicle.range` takes as long for
turns."""

_ON_WHILE_STOPPING = 0.6  # of that time, for how long the speed now would lead as far [-]
_PLACES_AROUND, _RINGS = 8, 2  # where a UAS may come to rest after one more step

_TOWARDS = tuple(
    (math.cos(angle), math.sin(angle))
    for angle in (2.0 * math.pi * k / _PLACES_AROUND for k in range(_RINGS * _PLACES_AROUND + 1))
)
"""North and east of the directions of these places."""

_WIND_MARGIN_S, _WIND_MARGIN_SHARE = 15.0, 0.15
"""Where disturbances are declared, the margin is more: this share of the time [-], and these
seconds in a wind as fast as the UAS, in which it turns and stops the more slowly. How often that is
too little: `benchmarks/returns.py --level moderate`."""

_LEAVING_MPS, _LEAVING_S = 0.6, 15.0
"""From below an overhang a UAS feels its way at about this speed, and turns at both ends. Chosen by
hand; `benchmarks/return_mode.py --families overhangs` shows whether UAS are lost."""


@inlined_kernel
def _roofs_on_leg(arena, x0, y0, altitude0_m, x1, y1, altitude1_m, leg):
    """What a leg passes over.

    Returns:
        (highest roof [m], -inf without one; way to the first [m]; to the end of the last [m]).
    """
    length_m = math.hypot(x1 - x0, y1 - y0)
    roof_m = -math.inf
    first_m, last_m = length_m, 0.0
    for o in range(arena.obstacles.shape[0]):
        obstacle = arena.obstacles[o]
        at, over, ends = crossing(obstacle, arena.normals, arena.offsets_m, x0, y0, x1, y1)
        highest_m = max(altitude0_m, altitude1_m)
        if at > 1.0 or not passes_over(obstacle, over, ends, leg, highest_m):
            continue
        back, _, _ = crossing(obstacle, arena.normals, arena.offsets_m, x1, y1, x0, y0)
        roof_m = max(roof_m, obstacle.roof_m + arena.rules[0].length_scale * HEADROOM_M)
        first_m = min(first_m, at * length_m)
        last_m = max(last_m, (1.0 - min(back, 1.0)) * length_m)
    return roof_m, first_m, last_m


@kernel
def _out_of_overhangs_s(arena, i, x, y, z):
    """Time to come out from below what overhangs a place, and to climb past it [s]."""
    if not is_below_overhang(arena, x, y, z):
        return 0.0
    across_m, climb_m = widest_overhang_m(arena, x, y, z)
    return _LEAVING_S + across_m / _LEAVING_MPS + climb_m / arena.uas[i].climb_mps


@kernel
def _more_in_wind_s(arena, i, belief, north_m, east_m):
    """By how much longer than in still air a leg takes in the wind believed in [s].

    No time is saved where it comes from behind.
    """
    length_m = math.hypot(north_m, east_m)
    if length_m <= 0.0:
        return 0.0
    speed_mps = estimated_speed(
        arena.vehicles[i].reference_max_mps, arena.uas[i].speed_mps, belief[WIND], belief[WIND + 1],
        north_m / length_m, east_m / length_m,
    )  # fmt: skip
    return length_m / speed_mps - length_m / arena.uas[i].speed_mps


@inlined_kernel
def route_home(arena, i, x0, y0, z0):
    """`route` of UAS i from a place to its home."""
    row, x1, y1, z1 = target_position(arena, i, HOME)
    return route(arena, row, x0, y0, z0, x1, y1, z1)


@kernel
def _flight_from(arena, i, x0, y0, z0, way, away_mps, belief=None):
    """See `flight_home`: from a place, by `route_home` from there, flying away at away_mps."""
    row, x1, y1, z1 = target_position(arena, i, HOME)
    end_x, end_y, way_m, leg = way
    obstructed = leg != CLEAR
    roof_m, before_m, until_m = -math.inf, way_m, 0.0
    flown_m = 0.0
    more_s = 0.0
    here_x, here_y = x0, y0
    for _ in range(_MOST_LEGS):
        found_m, first_m, last_m = _roofs_on_leg(arena, here_x, here_y, -z0, end_x, end_y, -z1, leg)
        if found_m > -math.inf:
            roof_m = max(roof_m, found_m)
            before_m = min(before_m, flown_m + first_m)
            until_m = max(until_m, flown_m + last_m)
        if belief is not None and arena.rules[0].disturbed:
            more_s += _more_in_wind_s(arena, i, belief, end_x - here_x, end_y - here_y)
        if leg != ROUND_CORNER:
            break
        # what such corners cost at scale 1 is in what was fitted
        if arena.rules[0].length_scale < 1.0 and is_tight(arena, end_x, end_y):
            more_s += seconds_at_rest(arena, i)
        flown_m += math.hypot(end_x - here_x, end_y - here_y)
        here_x, here_y = end_x, end_y
        end_x, end_y, leg = leg_from_corner(arena, row, here_x, here_y, z0, x1, y1, z1)
    seconds = seconds_to_land(
        arena.vehicles[i], way_m, -away_mps, z1 - z0, roof_m + z1, before_m,
        max(way_m - until_m, 0.0),
    )  # fmt: skip
    if belief is not None and arena.rules[0].disturbed:
        down_mps = arena.vehicles[i].v_down_max_mps
        slower_mps = down_mps - vertical_margin_mps(belief)
        more_s += max(z1 - z0, 0.0) * (1.0 / slower_mps - 1.0 / down_mps)
    if obstructed:
        seconds += _out_of_overhangs_s(arena, i, x0, y0, z0)
        seconds += _out_of_overhangs_s(arena, i, x1, y1, z1)
    margin_s = margin_to_land(seconds + more_s, obstructed)
    if belief is not None and arena.rules[0].disturbed:
        wind_mps = math.hypot(belief[WIND], belief[WIND + 1])
        margin_s += _WIND_MARGIN_SHARE * (seconds + more_s)
        margin_s += _WIND_MARGIN_S * wind_mps / arena.uas[i].speed_mps
    return seconds + more_s, margin_s


@kernel
def flight_home(arena, i, x, belief=None):
    """Time to fly UAS i home and land it, past the fixed obstacles: `flight_by` the route."""
    return flight_by(arena, i, x, route_home(arena, i, x[S.X], x[S.Y], x[S.Z]), belief)


@kernel
def flight_by(arena, i, x, way, belief=None):
    """Time to fly UAS i home by a route, and land it.

    Args:
        arena: The mission.
        i: Index of the UAS.
        x: (14,) its state.
        way: `route_home` from there.
        belief: (N_BELIEF,) of its inner loop; None: in still air.

    Returns:
        The expected time [s], and the margin to add to it [s].
    """
    home_m = arena.uas[i].home_m
    north_m = home_m[0] - x[S.X]
    east_m = home_m[1] - x[S.Y]
    away_m = max(math.hypot(north_m, east_m), 1e-9)
    away_mps = -(north_m * x[S.VX] + east_m * x[S.VY]) / away_m
    return _flight_from(arena, i, x[S.X], x[S.Y], x[S.Z], way, away_mps, belief)


@kernel
def latest_flight_home(arena, i, x, belief):
    """Time to fly UAS i home if it flies one more step, whatever its command [s].

    The way home may be much longer from behind the next building. So the UAS is taken to come to
    rest first: where it would if it braked one step later, or at one of sixteen places around, as
    far away as one and two steps of the largest acceleration lead. From the farthest of these it
    flies home.
    """
    vehicle = arena.vehicles[i]
    dt_s = vehicle.dt_s
    most_mps2 = vehicle.gravity_mps2 * math.tan(vehicle.tilt_max_rad)
    stopping_s = _STOPPING * math.hypot(x[S.VX], x[S.VY]) / most_mps2
    on_s = dt_s + _ON_WHILE_STOPPING * stopping_s
    longest_s = _STOPPING * vehicle.v_xy_max_mps / most_mps2
    around_m = most_mps2 * dt_s * (dt_s + _ON_WHILE_STOPPING * longest_s)
    z = min(x[S.Z] + dt_s * vehicle.v_down_max_mps, -arena.rules[0].floor_m)
    latest_s = 0.0
    for k in range(_RINGS * _PLACES_AROUND + 1):
        north, east = _TOWARDS[k]
        aside_m = around_m * ((k + _PLACES_AROUND - 1) // _PLACES_AROUND)
        north_m = x[S.X] + on_s * x[S.VX] + aside_m * north
        east_m = x[S.Y] + on_s * x[S.VY] + aside_m * east
        if may_be_at(arena, i, north_m, east_m, z):
            way = route_home(arena, i, north_m, east_m, z)
            seconds, margin_s = _flight_from(arena, i, north_m, east_m, z, way, 0.0, belief)
            latest_s = max(latest_s, seconds + margin_s)
    return dt_s + stopping_s + latest_s
