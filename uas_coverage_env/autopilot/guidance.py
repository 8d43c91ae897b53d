"""A velocity command that flies a UAS to a waypoint or home, past the fixed obstacles.

Constants without a source were chosen by hand on flights of the village. What they cost is shown by
`benchmarks/returns.py` for the way home, and by `uas-coverage compare --planners nearest-waypoint`
for flights past waypoints.
"""

import math

import numpy as np

from uas_coverage_env.autopilot.control import write_brake, write_command
from uas_coverage_env.autopilot.exit_overhang import LEG_TO_TARGET, TARGET_IS_PLACE, past_overhangs
from uas_coverage_env.autopilot.lookahead import fixed_slack, fly_and_brake
from uas_coverage_env.autopilot.low_altitude_return import low_way
from uas_coverage_env.autopilot.room import new_room
from uas_coverage_env.autopilot.wishes import IN_PLACE, LEVEL, STRAIGHT_ON, TRIES
from uas_coverage_env.compiled.kernels import (
    allocating_kernel,
    inlined_kernel,
    kernel,
    rare_kernel,
    stack_array,
)
from uas_coverage_env.entities.commands import GO_TO, HOME, VELOCITY, GoTo, Velocity, command_mode
from uas_coverage_env.entities.outcome import OUTCOME_DTYPE
from uas_coverage_env.entities.state import FLYING, WIND, WorldState
from uas_coverage_env.geometry.segments import signed_distance
from uas_coverage_env.vehicle import layout as S
from uas_coverage_env.world.arena import Arena
from uas_coverage_env.world.height import CRUISE_ALTITUDE_M, lowest_altitude
from uas_coverage_env.world.obstacles import NODE_MARGIN_M
from uas_coverage_env.world.routes import CLEAR, NO_WAY, ROUND_CORNER, crossing, level_apart, route

LEAD_S = 1.6
"""The inner loop follows a velocity with about this delay; guidance steers from ahead. At scale 1,
as all times below, see `governor.time_scale` [s]."""

HEADROOM_M = 0.5
"""Roofs are passed this much above the distance of routes, at scale 1 [m]."""

_GLIDE_SLOPE = 0.12  # metres down a metre of way, towards the altitude of the target [-]
_GLIDE_ENDS_M = 15.0  # before the target, at scale 1 [m]

_TIGHT_M = 3.0
"""A corner so near to what routes avoid of two obstacles lies in a gap that is seen through from
there alone, at scale 1: UAS come to rest at it before they turn [m]."""

_STOPPING_PER_S = 0.28
"""Speed over distance on the way to a stop [1/s]."""

_CORNER_SHARE, _CORNER_PER_S = 0.65, 0.25
"""Speed round a corner, of the highest [-], and by how much faster a metre before it [1/s]."""

_PASSING_SHARE, _PASSING_PER_S = 0.75, 0.8
"""Speed past a waypoint: of the highest [-], and over its radius [1/s], whichever is less."""

_SLOWING_PER_S, _SLOWED_M = 0.2, 8.0
"""By how much faster a metre before it [1/s], down to this distance from it, at scale 1 [m]."""

_HEIGHT_SHARE, _CLIMBING_MPS = 0.6, 0.5
"""Of its radius, how far above or below its centre a waypoint is covered for sure [-]; and what is
flown towards it in any case while climbing [m/s]."""

_LEAD_SHARE = 0.5
"""Of the time left to what is flown by, how far ahead guidance looks at most [-]: to look beyond it
would turn the UAS round before it gets there."""

_TO_HOME = 0.85
"""Of the way from where braking would end to home, what a UAS that lands in wind flies in a second
or a step, whichever is longer: a velocity held for a step moves that end on by the way of a step
[-]. `benchmarks/returns.py --level moderate` shows what it saves."""

_WIND_TO_HURRY = 0.5
"""Of the highest airspeed: in a stronger wind a gust may take all of it, and braking takes longer
than simulated. There, as in still air, a UAS comes home slowly [-]. Without it, 2 of 151 UAS were
blown over the fence (docs/wind_and_models.md)."""

_NOWHERE_M = 1e-9  # nearer than this there is no direction [m]


@inlined_kernel
def target_position(arena, i, target):
    """Row of node_distance_m and place (north, east, down) [m] of a waypoint; home if negative."""
    if target < 0:
        home_m = arena.uas[i].home_m
        return arena.waypoints.shape[0] + i, home_m[0], home_m[1], home_m[2]
    position_m = arena.waypoints[target].position_m
    return target, position_m[0], position_m[1], position_m[2]


@inlined_kernel
def comes_to_rest(arena, state, target):
    """Whether guidance stops at a target, as it does at home, and does not fly by.

    At what is covered there is nothing to fly by for; and at rest in its centre a waypoint that
    asks for heights or a speed is covered for sure.
    """
    return target < 0 or not state.uncovered[target] or arena.waypoints[target].asks


@inlined_kernel
def passes_over(obstacle, over, ends, leg, highest_m):
    """Whether a leg that crosses an obstacle has to pass over it.

    Args:
        obstacle: A record of OBSTACLE_DTYPE.
        over: Whether the leg starts or ends above (or below) the obstacle, see `crossing`.
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
    """Altitude [m] needed over the roofs on a leg, and the speed [m/s] that leaves time to climb.

    -inf where there is no roof.
    """
    altitude_m = -x[S.Z]
    length_m = math.hypot(x1 - x[S.X], y1 - x[S.Y])
    needed_m = -math.inf
    speed_mps = arena.uas[i].speed_mps
    ceiling_m = arena.rules[0].ceiling_m
    headroom_m = arena.rules[0].length_scale * HEADROOM_M
    for o in range(arena.obstacles.shape[0]):
        obstacle = arena.obstacles[o]
        at, over, ends = crossing(obstacle, arena.normals, arena.offsets_m, x[S.X], x[S.Y], x1, y1)
        if at > 1.0:
            continue
        roof_m = obstacle.roof_m
        if not passes_over(obstacle, over, ends, leg, max(altitude_m, altitude1_m)):
            continue
        needed_m = max(needed_m, roof_m + headroom_m)
        # where it can be passed right below the ceiling, no more height is waited for
        if roof_m > ceiling_m > obstacle.top_m + headroom_m:
            roof_m = ceiling_m - headroom_m
        rise_m = roof_m - altitude_m
        if rise_m > 0.0:
            climbing_s = rise_m / arena.uas[i].climb_mps + arena.uas[i].time_scale * LEAD_S
            speed_mps = min(speed_mps, at * length_m / climbing_s)
    return needed_m, speed_mps


@kernel
def is_tight(arena, x, y):
    """Whether a corner of routes lies in a gap that is little wider than what they keep."""
    n_near = 0
    for o in range(arena.obstacles.shape[0]):
        obstacle = arena.obstacles[o]
        if obstacle.tall and not level_apart(obstacle, x, y, x, y):
            first, last = obstacle.first_side, obstacle.last_side
            away_m = signed_distance(arena.normals, arena.offsets_m, first, last, x, y, 0.0)
            n_near += away_m < arena.rules[0].length_scale * _TIGHT_M
    return n_near > 1


@kernel
def seconds_at_rest(arena, i):
    """By how much longer a leg takes at the end of which a UAS comes to rest, and flies on [s].

    At `_STOPPING_PER_S` it comes as near as corners lie to what routes avoid.
    """
    uas = arena.uas[i]
    per_s = _STOPPING_PER_S / uas.time_scale
    slowed_m = uas.speed_mps / per_s
    near_m = arena.rules[0].length_scale * NODE_MARGIN_M
    return max(math.log(slowed_m / near_m), 0.0) / per_s


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
def _passing_speed(arena, i, x, target, distance_m, altitude1_m):
    """Speed at which a waypoint is flown by, neither past a small sphere nor too high or low."""
    uas = arena.uas[i]
    radius_m = arena.waypoints[target].radius_m
    passing_mps = min(_PASSING_SHARE * uas.speed_mps, _PASSING_PER_S / uas.time_scale * radius_m)
    before_m = max(0.0, distance_m - arena.rules[0].length_scale * _SLOWED_M)
    speed_mps = min(uas.speed_mps, passing_mps + _SLOWING_PER_S / uas.time_scale * before_m)
    missing_m = abs(altitude1_m + x[S.Z]) - _HEIGHT_SHARE * radius_m
    if missing_m > 0.0:
        rate_mps = uas.climb_mps if altitude1_m > -x[S.Z] else uas.descent_mps
        climbing_s = missing_m / rate_mps + uas.time_scale * LEAD_S
        speed_mps = min(speed_mps, _CLIMBING_MPS + distance_m / climbing_s)
    return speed_mps


@kernel
def _approach_speed(arena, i, x, target, stop, brakes_late, distance_m, leg, altitude1_m):
    """Speed towards the end of a leg [m/s]: slower for turns, a stop, and a climb or descent."""
    most_mps = arena.uas[i].speed_mps
    if brakes_late:
        return min(most_mps, _TO_HOME * distance_m / max(arena.rules[0].dt_s, 1.0))
    if stop:
        return min(most_mps, _STOPPING_PER_S / arena.uas[i].time_scale * distance_m)
    if leg == ROUND_CORNER:
        per_s = _CORNER_PER_S / arena.uas[i].time_scale
        return min(most_mps, _CORNER_SHARE * most_mps + per_s * distance_m)
    return _passing_speed(arena, i, x, target, distance_m, altitude1_m)


@kernel
def _altitude(arena, i, x, altitude1_m, way_m, needed_m):
    """Altitude to hold [m]: descend along a glide slope, but stay over what has to be passed."""
    rules = arena.rules[0]
    glide_m = altitude1_m + _GLIDE_SLOPE * max(0.0, way_m - rules.length_scale * _GLIDE_ENDS_M)
    cruise_m = max(-x[S.Z], rules.floor_m + rules.length_scale * CRUISE_ALTITUDE_M)
    altitude_m = max(altitude1_m, min(cruise_m, glide_m), needed_m)
    floor_m = lowest_altitude(arena, i, x[S.X], x[S.Y])
    return min(max(altitude_m, floor_m), max(rules.ceiling_m, altitude1_m))


@inlined_kernel
def _next_leg(arena, i, x, target, stop, belief, room):
    """What is flown next on the way to a target, and how it ends.

    Returns:
        (north [m], east [m], altitude of the target [m], length of the whole way [m], leg, stop):
        the target is the place that leads past an overhang, where there is one; the length is 0
        where the UAS flies low at once.
    """
    row, x1, y1, z1 = target_position(arena, i, target)
    end_x, end_y, way_m, leg = route(arena, row, x[S.X], x[S.Y], x[S.Z], x1, y1, z1)
    if leg != CLEAR and arena.rules[0].overhangs:
        place_m = stack_array(3)
        first = past_overhangs(
            arena, i, x[S.X], x[S.Y], x[S.Z], x1, y1, z1, room.places_m, room.cells, place_m
        )
        if first != LEG_TO_TARGET:
            x1, y1, z1 = place_m[0], place_m[1], place_m[2]
            end_x, end_y, way_m, leg = x1, y1, 0.0, CLEAR
            if first == TARGET_IS_PLACE:
                end_x, end_y, way_m, leg = route(arena, row, x[S.X], x[S.Y], x[S.Z], x1, y1, z1)
            stop = True
    if belief is not None and arena.rules[0].disturbed and target < 0:
        needed_m, _ = _climb_on_leg(arena, i, x, end_x, end_y, -z1, leg)
        altitude_m = _altitude(arena, i, x, -z1, way_m, needed_m)
        low, beside_x, beside_y = low_way(arena, i, x, belief, end_x, end_y, altitude_m, needed_m)
        if low:
            way_m = 0.0
        if beside_x != end_x or beside_y != end_y:
            end_x, end_y, leg = beside_x, beside_y, ROUND_CORNER
    if leg == ROUND_CORNER:
        stop = is_tight(arena, end_x, end_y)
    return end_x, end_y, -z1, way_m, leg, stop


@rare_kernel
def _leaves_room_to_brake(arena, i, x, reference, nonlinear, command, path_m, belief):
    """Whether a command, and braking after it, keeps clear of fence and fixed obstacles."""
    n_flown, slack_m = fly_and_brake(arena, i, x, reference, command, nonlinear, path_m, belief)
    return fixed_slack(arena, i, path_m, n_flown, 0.0, slack_m) >= 0.0


@rare_kernel
def _brake(arena, i, x, reference, nonlinear, path_m, belief):
    """Write the path on which UAS i would come to rest."""
    fly_and_brake(arena, i, x, reference, arena.rules[0].brake, nonlinear, path_m, belief)


@inlined_kernel
def _write_safe(
    arena, i, x, reference, north_mps, east_mps, altitude_m, leg, nonlinear, command, path_m, belief
):
    """Write the wish, a velocity and an altitude, or the first of `TRIES` that leaves room."""
    headroom_m = arena.rules[0].length_scale * HEADROOM_M
    for k in range(TRIES.shape[0]):
        along, aside, height = TRIES[k]
        wanted_m = altitude_m
        if height == LEVEL:
            # what is in the way of a descent is not in the way of staying up
            wanted_m = max(altitude_m, -x[S.Z] - x[S.VZ])
        elif height == IN_PLACE and abs(altitude_m + x[S.Z]) <= headroom_m:
            continue
        elif height == STRAIGHT_ON:
            if leg != CLEAR or not arena.rules[0].overhangs:
                continue
            # what is in the way of a climb is not in the way of the straight line
            wanted_m = -x[S.Z] - x[S.VZ]
        shown_north_mps = along * north_mps - aside * east_mps
        shown_east_mps = aside * north_mps + along * east_mps
        write_command(command, VELOCITY, shown_north_mps, shown_east_mps, wanted_m)
        if _leaves_room_to_brake(arena, i, x, reference, nonlinear, command, path_m, belief):
            return
    write_brake(command)


@kernel
def guide(
    room, arena, i, x, reference, target, stop, nonlinear, command, belief=None, climb_m=0.0
):  # fmt: skip
    """Write the command that flies UAS i towards a target, clear of fence and fixed obstacles.

    The wish (fly along the route, in time over low roofs) is flown as far as it leaves room to
    brake. On the way home in a wind that it hardly gets ahead against, a UAS flies low.

    Args:
        room: `Room`; written.
        arena: The mission.
        i: Index of the UAS.
        x: (14,) its state.
        reference: (2,) [m/s] of its inner loop.
        target: Index of a waypoint; home if negative.
        stop: Come to rest at the target instead of flying by.
        nonlinear: Whether the world flies the 6-DOF plant.
        command: A record of COMMAND_DTYPE; kind and values are written.
        belief: (N_BELIEF,) of its inner loop; None: in still air.
        climb_m: By how much to climb above where it is; 0: it flies at the height of the way [m].
    """
    end_x, end_y, altitude1_m, way_m, leg, stop = _next_leg(arena, i, x, target, stop, belief, room)
    path_m = room.path_m
    lead_s = arena.uas[i].time_scale * LEAD_S
    if not stop:
        left_m = math.hypot(end_x - x[S.X], end_y - x[S.Y])
        lead_s = min(lead_s, _LEAD_SHARE * left_m / (math.hypot(x[S.VX], x[S.VY]) + _NOWHERE_M))
    ahead_x = end_x - x[S.X] - lead_s * x[S.VX]
    ahead_y = end_y - x[S.Y] - lead_s * x[S.VY]
    brakes_late = _brakes_late(arena, i, belief, target, leg)
    if brakes_late:
        _brake(arena, i, x, reference, nonlinear, path_m, belief)
        ahead_x, ahead_y = end_x - path_m[-1, S.X], end_y - path_m[-1, S.Y]
    distance_m = math.hypot(ahead_x, ahead_y)
    needed_m, speed_mps = _climb_on_leg(arena, i, x, end_x, end_y, altitude1_m, leg)
    approach_mps = _approach_speed(
        arena, i, x, target, stop, brakes_late, distance_m, leg, altitude1_m
    )
    speed_mps = min(speed_mps, approach_mps)
    if climb_m > 0.0:
        needed_m = max(needed_m, climb_m - x[S.Z])
    altitude_m = _altitude(arena, i, x, altitude1_m, way_m, needed_m)
    north_mps, east_mps = 0.0, 0.0
    if distance_m > _NOWHERE_M:
        north_mps = ahead_x / distance_m * speed_mps
        east_mps = ahead_y / distance_m * speed_mps
    _write_safe(
        arena, i, x, reference, north_mps, east_mps, altitude_m, leg, nonlinear, command, path_m,
        belief,
    )  # fmt: skip


@kernel
def steer_of(arena, state, nonlinear, outcome, i, room):
    """`steer` for one UAS; `Room` is written."""
    if state.uas[i].status != FLYING:
        return
    command = outcome[i].applied_command
    if state.uas[i].returning:
        command.kind = GO_TO
        command.values[0] = HOME
        command.values[1] = 0.0
        command.returning = True
        outcome[i].returning = True
    if command.kind == GO_TO:
        target = int(command.values[0])
        stop = comes_to_rest(arena, state, target)
        guide(
            room, arena, i, state.x[i], state.uas[i].reference_mps[:], target, stop, nonlinear,
            command, state.uas[i].belief[:], command.values[1],
        )  # fmt: skip


@allocating_kernel
def steer(arena, state, nonlinear, outcome):
    """Resolve commands that name a place into velocities; a UAS called home gets such a command.

    Of the outcome, applied_command and returning are written.
    """
    room = new_room(arena)
    for i in range(state.uas.shape[0]):
        steer_of(arena, state, nonlinear, outcome, i, room)


def velocity_of(
    arena: Arena, state: WorldState, i: int, command: GoTo, *, nonlinear: bool = False
) -> Velocity:
    """The velocity that flies as guidance does in the coming step.

    Args:
        arena: The mission, of the world or as a planner sees it (`WorldView`).
        state: The state.
        i: Index of the UAS, which flies.
        command: Where to.
        nonlinear: Whether the world flies the 6-DOF plant.

    Returns:
        A velocity of the same mode. Where guidance brakes, which it does by vertical speed and not
        by altitude, its altitude is the one that stops a climb or descent at once.
    """
    outcome = np.zeros(len(state.uas), OUTCOME_DTYPE)
    given = outcome[i]["applied_command"]
    given["kind"] = GO_TO
    given["values"][0] = HOME if command.waypoint is None else command.waypoint
    given["values"][1] = command.climb_m
    # return mode would be obeyed instead
    uas = state.uas.copy()
    uas["returning"] = False
    steer(arena, state._replace(uas=uas), nonlinear, outcome)
    north_mps, east_mps, altitude_m, _ = given["values"].tolist()
    if given["kind"] != VELOCITY:
        vehicle = arena.vehicles[i]
        (_, per_speed), (_, kept) = vehicle["vertical_A"].tolist()
        way, speed = vehicle["vertical_B"].tolist()
        stopping_s = per_speed - way / speed * kept
        altitude_m = -float(state.x[i, S.Z] + stopping_s * state.x[i, S.VZ])
    return Velocity(north_mps, east_mps, altitude_m, command_mode(command))
