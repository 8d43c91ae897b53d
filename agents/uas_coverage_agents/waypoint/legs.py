"""Leg times between waypoints and to the starts, along the routes of the world."""

import math
from typing import Annotated, NamedTuple

import numpy as np
from numpy.typing import NDArray

from uas_coverage_agents.waypoint.layout import CRUISE_SHARE
from uas_coverage_env.autopilot.return_mode import seconds_home
from uas_coverage_env.compiled.kernels import allocating_kernel
from uas_coverage_env.compiled.memory import Memory
from uas_coverage_env.planning.reserves import LEARNED_LEG, LEARNED_RETURN
from uas_coverage_env.vehicle import layout as S
from uas_coverage_env.vehicle.range import (
    SpeedLimits,
    flight_seconds,
)
from uas_coverage_env.world import Arena
from uas_coverage_env.world.arena import ARENA
from uas_coverage_env.world.routes import route

ROUTED_UNITS = 6.0
"""Longer legs than this are rarely flown: they are taken straight."""

_LONE_UNIT_M = 60.0


class LegTimes(NamedTuple):
    """What does not change during a mission; computed once, for the slowest of the fleet."""

    between_s: Annotated[NDArray[np.float64], "W", "W"]
    """[s] from the first to the second waypoint."""
    home_s: Annotated[NDArray[np.float64], "U", "W"]
    """[s] from a waypoint to each start, landing included."""
    return_s: Annotated[NDArray[np.float64], "U", "W"]
    """[s] the same as return mode reckons it, with reserve."""
    unit: Annotated[NDArray[np.float64], 2]
    """`unit_m` and `unit_s`, see `layout`."""


LEGS = Memory(LegTimes)


@allocating_kernel
def leg_s(uas, way_m, rise_m, radius_m):
    """Time [s] to fly a leg: the slower of its horizontal and its vertical part.

    Args:
        uas: Record of UAS_DTYPE.
        way_m: Horizontal length of the route [m].
        rise_m: Altitude gained [m].
        radius_m: Of the waypoint at its end [m].
    """
    speeds = SpeedLimits(uas.speed_mps, uas.climb_mps, uas.descent_mps)
    credit_m = 0.6 * radius_m
    up_m, down_m = max(rise_m - credit_m, 0.0), max(-rise_m - credit_m, 0.0)
    return flight_seconds(LEARNED_LEG, speeds, 0.0, way_m, up_m, down_m)


@allocating_kernel
def home_leg_s(uas, way_m, altitude_m):
    """Time [s] to fly home over way_m, from altitude_m above the start, and land."""
    speeds = SpeedLimits(uas.speed_mps, uas.climb_mps, uas.descent_mps)
    return flight_seconds(LEARNED_RETURN, speeds, 0.0, way_m, 0.0, altitude_m)


@allocating_kernel
def _unit_m(waypoints):
    """Mean horizontal distance of a waypoint from its nearest neighbour [m]."""
    n = waypoints.shape[0]
    total_m = 0.0
    for a in range(n):
        nearest_m = math.inf
        for b in range(n):
            if b != a:
                dx = waypoints[a].position_m[0] - waypoints[b].position_m[0]
                dy = waypoints[a].position_m[1] - waypoints[b].position_m[1]
                nearest_m = min(nearest_m, math.hypot(dx, dy))
        total_m += nearest_m
    if n < 2 or total_m == 0.0:
        return _LONE_UNIT_M
    return total_m / n


@allocating_kernel
def _fill(arena, between_s, home_s, return_s, unit):
    waypoints = arena.waypoints
    n = waypoints.shape[0]
    there = np.zeros(S.N_STATES)
    slowest = 0
    for i in range(arena.uas.shape[0]):
        if arena.uas[i].speed_mps < arena.uas[slowest].speed_mps:
            slowest = i
    uas = arena.uas[slowest]
    unit[0] = _unit_m(waypoints)
    unit[1] = unit[0] / (CRUISE_SHARE * uas.speed_mps)
    for a in range(n):
        here_m = waypoints[a].position_m
        there[S.X], there[S.Y], there[S.Z] = here_m[0], here_m[1], here_m[2]
        for b in range(a + 1, n):
            there_m = waypoints[b].position_m
            way_m = math.hypot(there_m[0] - here_m[0], there_m[1] - here_m[1])
            if way_m < ROUTED_UNITS * unit[0]:
                way_m = route(
                    arena, b, here_m[0], here_m[1], here_m[2], there_m[0], there_m[1], there_m[2]
                )[2]
            rise_m = here_m[2] - there_m[2]
            between_s[a, b] = leg_s(uas, way_m, rise_m, waypoints[b].radius_m)
            between_s[b, a] = leg_s(uas, way_m, -rise_m, waypoints[a].radius_m)
        for i in range(arena.uas.shape[0]):
            home_m = arena.uas[i].home_m
            way_m = route(
                arena, n + i, here_m[0], here_m[1], here_m[2], home_m[0], home_m[1], home_m[2]
            )[2]
            altitude_m = max(home_m[2] - here_m[2], 0.0)
            home_s[i, a] = home_leg_s(arena.uas[i], way_m, altitude_m)
            return_s[i, a] = seconds_home(arena, i, there)


def legs_of(arena: Arena) -> LegTimes:
    """The leg times of a scenario."""
    legs = LEGS.zeros(ARENA.sizes_of(arena))
    _fill(arena, *legs)
    return legs
