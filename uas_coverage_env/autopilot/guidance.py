"""A velocity command that flies a UAS to a waypoint or home, past the fixed obstacles."""

import math

import numpy as np

from uas_coverage_env.autopilot.control import write_brake, write_command
from uas_coverage_env.autopilot.lookahead import fixed_slack, fly_and_brake
from uas_coverage_env.autopilot.low_way import low_way
from uas_coverage_env.autopilot.way_out import LEG_TO_TARGET, TARGET_IS_PLACE, past_overhangs
from uas_coverage_env.compiled.kernels import allocating_kernel, inlined_kernel, kernel, rare_kernel
from uas_coverage_env.geometry import signed_distance
from uas_coverage_env.vehicle import VX, VY, VZ, X, Y, Z
from uas_coverage_env.world.commands import GO_TO, HOME, VELOCITY
from uas_coverage_env.world.height import lowest_altitude
from uas_coverage_env.world.routes import (
    CLEAR,
    NO_WAY,
    ROUND_CORNER,
    crossing,
    level_apart,
    route,
)
from uas_coverage_env.world.state import FLYING, WIND

LEAD_S = 1.6
"""The inner loop follows a velocity with about this delay; guidance steers from ahead [s]."""

CRUISE_ALTITUDE_M = 8.0
"""On a longer way UAS do not sink below this altitude above the floor [m]."""

_GLIDE_SLOPE = 0.12
HEADROOM_M = 0.5
"""Roofs are passed this much above the distance of routes [m]."""

_TIGHT_M = 3.0
"""A corner so near to what routes avoid of two obstacles lies in a gap that is seen through from
there alone: UAS come to rest at it before they turn."""

_TO_HOME = 0.85
"""Of the way from where braking would end to home, what a UAS that lands in wind flies in a second
or a step, whichever is longer: a velocity held for a step moves that end on by the way of a step.
"""

_WIND_TO_HURRY = 0.5
"""Of the highest airspeed: in a stronger wind a gust may take all of it, and braking takes longer
than simulated. There, as in still air, a UAS comes home slowly."""

_SHARES_OF_SPEED = (1.0, 0.7, 0.4, 0.15)
_TURNS = (0.9, -0.9, 1.8, -1.8, 2.7, -2.7)
_SHARE_WHEN_TURNED = 0.4


@inlined_kernel
def target_position(arena, i, target):
    """Row of node_distance_m and place (north, east, down) [m] of a waypoint; home if negative."""
    if target < 0:
        home_m = arena.uas[i].home_m
        return arena.waypoints.shape[0] + i, home_m[0], home_m[1], home_m[2]
    position_m = arena.waypoints[target].position_m
    return target, position_m[0], position_m[1], position_m[2]


@kernel
def path_length_home_m(arena, i, x):
    """Length [m] of the horizontal way home of UAS i past the tall obstacles."""
    row, x1, y1, z1 = target_position(arena, i, -1)
    return route(arena, row, x[X], x[Y], x[Z], x1, y1, z1)[2]


@inlined_kernel
def comes_to_rest(arena, state, target):
    """Whether guidance stops at a target, as it does at home, and does not fly by.

    At what is covered there is nothing to fly by for; and at rest in its centre a waypoint that
    asks for heights or a speed is covered for sure.
    """
    return target < 0 or not state.uncovered[target] or arena.waypoints[target].asks


@inlined_kernel
def passes_over(obstacle, over, ends, leg, highest_m):
    """Whether a leg that crosses an obstacle has to pass over it; `over`, `ends`: see `crossing`.

    Args:
        obstacle: A record of OBSTACLE_DTYPE.
        over: Whether the leg starts or ends above (or below) the obstacle.
        ends: Whether it ends in the widened footprint.
        leg: CLEAR, IN_SIGHT, ROUND_CORNER or NO_WAY.
        highest_m: The higher one of the altitudes of both ends [m].
    """
    if leg == CLEAR:
        # the straight line passes beside or below what is higher than both of its ends, and
        # where it ends there is nothing to stay above
        return obstacle.roof_m <= highest_m and not ends
    return over or not obstacle.tall or leg == NO_WAY


@kernel
def _climb_on_leg(arena, i, x, x1, y1, altitude1_m, leg):
    """Altitude needed over the low obstacles on a leg, and the speed that leaves time to climb.

    Returns:
        (altitude [m], speed [m/s]).
    """
    altitude_m = -x[Z]
    length_m = math.hypot(x1 - x[X], y1 - x[Y])
    needed_m = -math.inf
    speed_mps = arena.uas[i].speed_mps
    ceiling_m = arena.rules[0].ceiling_m
    for o in range(arena.obstacles.shape[0]):
        obstacle = arena.obstacles[o]
        at, over, ends = crossing(obstacle, arena.normals, arena.offsets_m, x[X], x[Y], x1, y1)
        if at > 1.0:
            continue
        roof_m = obstacle.roof_m
        if not passes_over(obstacle, over, ends, leg, max(altitude_m, altitude1_m)):
            continue
        needed_m = max(needed_m, roof_m + HEADROOM_M)
        # where it can be passed right below the ceiling, no more height is waited for
        if roof_m > ceiling_m > obstacle.top_m + HEADROOM_M:
            roof_m = ceiling_m - HEADROOM_M
        rise_m = roof_m - altitude_m
        if rise_m > 0.0:
            climbing_s = rise_m / arena.uas[i].climb_mps + LEAD_S
            speed_mps = min(speed_mps, at * length_m / climbing_s)
    return needed_m, speed_mps


@kernel
def _is_tight(arena, x, y):
    """Whether a corner of routes lies in a gap that is little wider than what they keep."""
    n_near = 0
    for o in range(arena.obstacles.shape[0]):
        obstacle = arena.obstacles[o]
        if obstacle.tall and not level_apart(obstacle, x, y, x, y):
            first, last = obstacle.first_side, obstacle.last_side
            away_m = signed_distance(arena.normals, arena.offsets_m, first, last, x, y, 0.0)
            n_near += away_m < _TIGHT_M
    return n_near > 1


@inlined_kernel
def _brakes_late(arena, i, belief, target, leg):
    """Whether a UAS on the last leg home brakes as late as it can, in the wind believed in.

    In still air it does not: recorded flights and trained policies know the slower landing.
    """
    if belief is None or not arena.rules[0].disturbed or target >= 0 or leg == ROUND_CORNER:
        return False
    wind_mps = math.hypot(belief[WIND], belief[WIND + 1])
    return wind_mps <= _WIND_TO_HURRY * arena.vehicles[i].reference_max_mps


@kernel
def _approach_speed(arena, i, x, target, stop, brakes_late, distance_m, leg, altitude1_m):
    """Speed towards the end of a leg [m/s]: slower for turns, a stop, and a climb or descent."""
    uas = arena.uas[i]
    if brakes_late:
        return min(uas.speed_mps, _TO_HOME * distance_m / max(arena.rules[0].dt_s, 1.0))
    if stop:
        return min(uas.speed_mps, 0.28 * distance_m)
    if leg == ROUND_CORNER:
        return min(uas.speed_mps, 0.65 * uas.speed_mps + 0.25 * distance_m)
    # flying by: fast, but neither past a small sphere nor before the altitude is reached
    radius_m = arena.waypoints[target].radius_m
    passing_mps = min(0.75 * uas.speed_mps, 0.8 * radius_m)
    speed_mps = min(uas.speed_mps, passing_mps + 0.2 * max(0.0, distance_m - 8.0))
    missing_m = abs(altitude1_m + x[Z]) - 0.6 * radius_m
    if missing_m > 0.0:
        rate_mps = uas.climb_mps if altitude1_m > -x[Z] else uas.descent_mps
        speed_mps = min(speed_mps, 0.5 + distance_m / (missing_m / rate_mps + LEAD_S))
    return speed_mps


@kernel
def _altitude(arena, i, x, altitude1_m, way_m, needed_m):
    """Altitude to hold [m]: descend along a glide slope, but stay over what has to be passed."""
    rules = arena.rules[0]
    glide_m = altitude1_m + _GLIDE_SLOPE * max(0.0, way_m - 15.0)
    cruise_m = max(-x[Z], rules.floor_m + CRUISE_ALTITUDE_M)
    altitude_m = max(altitude1_m, min(cruise_m, glide_m), needed_m)
    floor_m = lowest_altitude(arena, i, x[X], x[Y])
    return min(max(altitude_m, floor_m), max(rules.ceiling_m, altitude1_m))


@rare_kernel  # in one copy: guidance is a good part of a first start
def _leaves_room_to_brake(arena, i, x, reference, nonlinear, command, path_m, belief):
    """Whether a command, and braking after it, keeps clear of fence and fixed obstacles."""
    n_flown, slack_m = fly_and_brake(arena, i, x, reference, command, nonlinear, path_m, belief)
    return fixed_slack(arena, i, path_m, n_flown, 0.0, slack_m) >= 0.0


@rare_kernel
def _brake(arena, i, x, reference, nonlinear, path_m, belief):
    """Write the path on which UAS i would come to rest."""
    fly_and_brake(arena, i, x, reference, arena.rules[0].brake, nonlinear, path_m, belief)


@allocating_kernel
def guide(arena, i, x, reference, target, stop, nonlinear, command, belief=None):
    """Write the command that flies UAS i towards a target, clear of fence and fixed obstacles.

    The wish (fly along the route, in time over low roofs) is flown as far as it leaves room to
    brake: slower, without descending, up or down in place, to one side, or not at all. On the way
    home in a wind that it hardly gets ahead against, a UAS flies low.

    Args:
        arena: The arena.
        i: Index of the UAS.
        x: (14,) its state.
        reference: (2,) [m/s] of its inner loop.
        target: Index of a waypoint; home if negative.
        stop: Come to rest at the target instead of flying by.
        nonlinear: Whether the world flies the 6-DOF plant.
        command: A record of COMMAND_DTYPE; kind and values are written.
        belief: (N_BELIEF,) of its inner loop; None: in still air.
    """
    row, x1, y1, z1 = target_position(arena, i, target)
    end_x, end_y, way_m, leg = route(arena, row, x[X], x[Y], x[Z], x1, y1, z1)
    if leg != CLEAR and arena.rules[0].overhangs:
        place_m = np.empty(3)
        first = past_overhangs(arena, i, x[X], x[Y], x[Z], x1, y1, z1, place_m)
        if first != LEG_TO_TARGET:
            x1, y1, z1 = place_m[0], place_m[1], place_m[2]
            end_x, end_y, way_m, leg = x1, y1, 0.0, CLEAR
            if first == TARGET_IS_PLACE:
                end_x, end_y, way_m, leg = route(arena, row, x[X], x[Y], x[Z], x1, y1, z1)
            stop = True
    low = False
    if belief is not None and arena.rules[0].disturbed and target < 0:
        needed_m, _ = _climb_on_leg(arena, i, x, end_x, end_y, -z1, leg)
        altitude_m = _altitude(arena, i, x, -z1, way_m, needed_m)
        low, beside_x, beside_y = low_way(arena, i, x, belief, end_x, end_y, altitude_m, needed_m)
        if beside_x != end_x or beside_y != end_y:
            end_x, end_y, leg = beside_x, beside_y, ROUND_CORNER
    if leg == ROUND_CORNER:
        stop = _is_tight(arena, end_x, end_y)
    lead_s = LEAD_S
    if not stop:
        # to look beyond what is flown by would turn the UAS round before it gets there
        left_m = math.hypot(end_x - x[X], end_y - x[Y])
        lead_s = min(LEAD_S, 0.5 * left_m / (math.hypot(x[VX], x[VY]) + 1e-9))
    ahead_x = end_x - x[X] - lead_s * x[VX]
    ahead_y = end_y - x[Y] - lead_s * x[VY]
    path_m = np.empty((arena.rules[0].lookahead_steps + 1, 3))
    brakes_late = _brakes_late(arena, i, belief, target, leg)
    if brakes_late:
        _brake(arena, i, x, reference, nonlinear, path_m, belief)
        ahead_x, ahead_y = end_x - path_m[-1, X], end_y - path_m[-1, Y]
    distance_m = math.hypot(ahead_x, ahead_y)
    needed_m, speed_mps = _climb_on_leg(arena, i, x, end_x, end_y, -z1, leg)
    approach_mps = _approach_speed(arena, i, x, target, stop, brakes_late, distance_m, leg, -z1)
    speed_mps = min(speed_mps, approach_mps)
    altitude_m = _altitude(arena, i, x, -z1, 0.0 if low else way_m, needed_m)
    north_mps = 0.0
    east_mps = 0.0
    if distance_m > 1e-9:
        north_mps = ahead_x / distance_m * speed_mps
        east_mps = ahead_y / distance_m * speed_mps
    # what is in the way of a descent is not in the way of staying up
    level_m = max(altitude_m, -x[Z] - x[VZ])
    for share in _SHARES_OF_SPEED:
        for wanted_m in (altitude_m, level_m):
            write_command(command, VELOCITY, share * north_mps, share * east_mps, wanted_m)
            if _leaves_room_to_brake(arena, i, x, reference, nonlinear, command, path_m, belief):
                return
    if abs(altitude_m + x[Z]) > HEADROOM_M:
        write_command(command, VELOCITY, 0.0, 0.0, altitude_m)
        if _leaves_room_to_brake(arena, i, x, reference, nonlinear, command, path_m, belief):
            return
    if leg == CLEAR and arena.rules[0].overhangs:
        # what is in the way of a climb is not in the way of the straight line
        held_m = -x[Z] - x[VZ]
        for share in _SHARES_OF_SPEED:
            write_command(command, VELOCITY, share * north_mps, share * east_mps, held_m)
            if _leaves_room_to_brake(arena, i, x, reference, nonlinear, command, path_m, belief):
                return
    for turn in _TURNS:
        cos = _SHARE_WHEN_TURNED * math.cos(turn)
        sin = _SHARE_WHEN_TURNED * math.sin(turn)
        turned_north_mps = cos * north_mps - sin * east_mps
        turned_east_mps = sin * north_mps + cos * east_mps
        write_command(command, VELOCITY, turned_north_mps, turned_east_mps, level_m)
        if _leaves_room_to_brake(arena, i, x, reference, nonlinear, command, path_m, belief):
            return
    write_brake(command)


@allocating_kernel
def steer(arena, state, nonlinear, outcome):
    """Resolve commands that name a place into velocities; a UAS called home gets such a command.

    Args:
        arena: The arena.
        state: The state.
        nonlinear: Whether the world flies the 6-DOF plant.
        outcome: (U,) of OUTCOME_DTYPE; applied_command and returning are written.
    """
    for i in range(state.status.shape[0]):
        if state.status[i] != FLYING:
            continue
        command = outcome[i].applied_command
        if state.returning[i]:
            command.kind = GO_TO
            command.values[0] = HOME
            command.returning = True
            outcome[i].returning = True
        if command.kind == GO_TO:
            target = int(command.values[0])
            stop = comes_to_rest(arena, state, target)
            guide(
                arena, i, state.x[i], state.reference[i], target, stop, nonlinear, command,
                state.belief[i],
            )  # fmt: skip
