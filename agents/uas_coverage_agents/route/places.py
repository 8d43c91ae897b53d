"""The next places of a route: waypoints and home, with or without the corners on the way there.

Over or round is asked as for leg times (`planning.routing.terrain`).
"""

import math

import numpy as np

from uas_coverage_agents.route.leg_flight import (
    AHEAD,
    CORNER_M,
    DOWN,
    EAST,
    IS_HOME,
    NORTH,
    RADIUS,
    over_roofs,
    places_ahead,
)
from uas_coverage_env.autopilot.guidance import LEAD_S
from uas_coverage_env.compiled.kernels import allocating_kernel
from uas_coverage_env.planning.routing.terrain import corner_between, over_s, round_s
from uas_coverage_env.vehicle import layout as S
from uas_coverage_env.world.routes import CLEAR, ROUND_CORNER, route


@allocating_kernel
def write_place(arena, i, targets, n_targets, k, place):
    """Write the k-th of the next targets of UAS i, after the last one home; its row in `route`."""
    place[:] = 0.0
    if k < n_targets:
        waypoint = arena.waypoints[targets[k]]
        place[:3] = waypoint.position_m
        place[RADIUS] = waypoint.radius_m
        return targets[k]
    place[:3] = arena.uas[i].home_m
    place[IS_HOME] = 1.0
    return arena.waypoints.shape[0] + i


@allocating_kernel
def detour_s(arena, around, i, row, x, to):
    """How much longer the way of UAS i past obstacles takes than the straight one [s].

    Args:
        arena: The arena.
        around: The same with its obstacles raised.
        i: Index of the UAS.
        row: Of the place in `route`.
        x: (14,) state.
        to: (5,) the place.
    """
    uas = arena.uas[i]
    straight_m = math.hypot(to[NORTH] - x[S.X], to[EAST] - x[S.Y])
    end_x, end_y, way_m, leg = route(
        arena, row, x[S.X], x[S.Y], x[S.Z], to[NORTH], to[EAST], to[DOWN]
    )
    if leg == CLEAR:
        return 0.0
    needed_m, _ = over_roofs(arena, x, end_x, end_y, -to[DOWN], uas, leg)
    seconds = over_s(uas, x, to, to[RADIUS], way_m, needed_m)
    if needed_m + x[S.Z] > 0.0:
        seconds = min(seconds, round_s(around, uas, row, x, to))
    return seconds - straight_m / uas.speed_mps


@allocating_kernel
def places_along(arena, around, i, x, targets, n_targets, ahead):
    """`places_ahead`, round where that is sooner than over, and with the corners of later legs."""
    uas = arena.uas[i]
    leg, needed_m, speed_mps = places_ahead(arena, i, x, targets, n_targets, ahead)
    to = np.empty(5)
    row = write_place(arena, i, targets, n_targets, 0, to)
    corner = leg == ROUND_CORNER
    if needed_m > max(-x[S.Z], -to[DOWN]):
        way_m = math.hypot(to[NORTH] - x[S.X], to[EAST] - x[S.Y])
        climbing_s = over_s(uas, x, to, to[RADIUS], way_m, needed_m)
        north_m, east_m, way_m, round_leg = route(
            around, row, x[S.X], x[S.Y], x[S.Z], to[NORTH], to[EAST], to[DOWN]
        )
        if (
            round_leg == ROUND_CORNER
            and way_m / uas.speed_mps < climbing_s + uas.time_scale * LEAD_S
        ):
            corner, leg = True, ROUND_CORNER
            ahead[0] = 0.0
            ahead[0, NORTH], ahead[0, EAST], ahead[0, RADIUS] = north_m, east_m, CORNER_M
            ahead[0, DOWN] = min(to[DOWN], x[S.Z]) if n_targets > 0 else x[S.Z]
            needed_m, speed_mps = over_roofs(around, x, north_m, east_m, -to[DOWN], uas, leg)
    k, j = (1, 0) if corner else (0, 0)
    while k < AHEAD:
        row = write_place(arena, i, targets, n_targets, j, to)
        if k > 0:
            north_m, east_m, there = corner_between(
                arena, around, row, ahead[k - 1], corner and k == 1, to
            )
            if there:
                ahead[k] = 0.0
                ahead[k, NORTH], ahead[k, EAST], ahead[k, RADIUS] = north_m, east_m, CORNER_M
                ahead[k, DOWN] = ahead[k - 1, DOWN] if j >= n_targets else to[DOWN]
                k += 1
        if k < AHEAD:
            ahead[k] = to
            k += 1
        j += 1
    return leg, needed_m, speed_mps
