"""How far it is past obstacles, and what the flight takes: for observations and rewards."""

import math

from uas_coverage_env.autopilot.guidance import target_position
from uas_coverage_env.compiled.kernels import inlined_kernel, kernel
from uas_coverage_env.vehicle.range import (
    SpeedLimits,
    TravelTimeModel,
    flight_seconds,
)
from uas_coverage_env.world.routes import shortest_way

OBSERVED = TravelTimeModel(in_turn=True)
"""Of observations, at the limits of the vehicle: trained networks read it."""


@inlined_kernel
def way_to(arena, i, target, x, y, z):
    """The way of UAS i from a place to a waypoint, or to its start.

    Args:
        arena: The mission.
        i: Index of the UAS.
        target: Index of the waypoint; negative: its start.
        x: North of the place [m].
        y: East of the place [m].
        z: Down of the place [m].

    Returns:
        (north [m], east [m], length [m], down [m]): where the first leg ends, the horizontal length
        of the whole way, and how far the target is below.
    """
    row, x1, y1, z1 = target_position(arena, i, target)
    leg_x, leg_y, way_m = shortest_way(arena, row, x, y, z, x1, y1, z1)
    return leg_x, leg_y, way_m, z1 - z


@inlined_kernel
def seconds_of(arena, i, way_m, up_m, down_m):
    """How long UAS i flies at top speed [s]."""
    uas = arena.uas[i]
    speeds = SpeedLimits(uas.speed_mps, uas.climb_mps, uas.descent_mps)
    return flight_seconds(OBSERVED, speeds, 0.0, way_m, up_m, down_m)


@kernel
def seconds_there(arena, i, target, x, y, z):
    """Way [m] of UAS i from a place to a target, and time at top speed, up and down, too [s]."""
    _, _, way_m, below_m = way_to(arena, i, target, x, y, z)
    return way_m, seconds_of(arena, i, way_m, max(0.0, -below_m), max(0.0, below_m))


@kernel
def seconds_home_from(arena, i, w):
    """Time that UAS i takes home from a waypoint [s]."""
    position_m = arena.waypoints[w].position_m
    return seconds_there(arena, i, -1, position_m[0], position_m[1], position_m[2])[1]


@inlined_kernel
def straight_m(arena, w, x, y):
    """Horizontal distance of a place from a waypoint: no way is shorter [m]."""
    position_m = arena.waypoints[w].position_m
    dx = position_m[0] - x
    dy = position_m[1] - y
    return math.sqrt(dx * dx + dy * dy)
