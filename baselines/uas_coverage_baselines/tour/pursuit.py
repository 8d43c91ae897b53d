"""Pursuit: from a plan to a flight, simulated with the inner loop that the world flies.

A plan says where each of the next spheres is aimed at, and how early the flight turns to the next;
and what is added to the command in single steps. A command always points from where the UAS is to
the aim of its leg, so that a change early in the plan does not spoil what comes later.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.autopilot.control import command_wrench, write_command
from uas_coverage_env.autopilot.guidance import guide, target_position
from uas_coverage_env.autopilot.lookahead import fly_and_brake, fly_kinematically
from uas_coverage_env.autopilot.room import new_room
from uas_coverage_env.compiled.kernels import allocating_kernel
from uas_coverage_env.entities.commands import CLIMB, VELOCITY
from uas_coverage_env.geometry.segments import signed_distance
from uas_coverage_env.vehicle import layout as S
from uas_coverage_env.vehicle.lpv import fly_kinematics
from uas_coverage_env.world.height import CRUISE_ALTITUDE_M, lowest_altitude
from uas_coverage_env.world.routes import CLEAR, box_apart, crossing, route

FloatArray = NDArray[np.float64]

HOME_TARGET = -1
LEGS = 6
"""How many waypoints ahead are aimed at by choice."""

_LAG_S = 1.6  # the inner loop follows a velocity with about this delay, at scale 1
_AIM_SHARE = 0.8  # of the radius, at most, for the first aim
_SPEED_SHARE = 0.97  # of the speed at which a waypoint may be covered, in plans
_SLOW_SHARE = 0.85  # and in what is pursued
_HEIGHT_SPARE_M = 0.3  # within the heights that are asked for, in plans
_SLOW_BRAKING = 0.6  # share of the acceleration that slows down in time
_SLOW_WITHIN = 0.7  # share of the radius within which that holds


class PursuitTask(NamedTuple):
    """What one UAS has to do next.

    Attributes:
        route: (K,) waypoints to cover in this order; then home.
        cover_m: (K,) how near counts as covered; negative where the waypoint is blocked.
        near_m: (K+1,) how far from each, and from home, its leg may end.
        rest_s: (K+1,) flight time estimated from each waypoint to the end; 0 from home.
        acceleration_mps2: How fast the velocity can change.
        brake_s: Braking leads ahead by the velocity times this.
        moving_margin_m: Kept from moving obstacles beyond what counts as a breach.
    """

    route: NDArray[np.int64]
    cover_m: FloatArray
    near_m: FloatArray
    rest_s: FloatArray
    acceleration_mps2: float
    brake_s: float
    moving_margin_m: float


class PursuitPlan(NamedTuple):
    """A plan for N steps and L legs, and its simulated flight.

    Attributes:
        aim_m: (L, 3) what is aimed at in each of the first spheres of the route.
        early_m: (L,) so near to the aim the flight turns to the next.
        share: (N,) of the pursuit's speed.
        push: (N, 3) added to the commands: north, east [m/s], altitude [m].
        commands: (N, 3) velocity north and east [m/s], altitude [m].
        x: (N+1, 14) states.
        reference: (N+1, 2) of the inner loop.
        covered: (N+1,) how many waypoints of the route are covered.
        leg: (N+1,) which leg is flown: at least `covered`.
        path_m: (N+1, 3).
    """

    aim_m: FloatArray
    early_m: FloatArray
    share: FloatArray
    push: FloatArray
    commands: FloatArray
    x: FloatArray
    reference: FloatArray
    covered: NDArray[np.int64]
    leg: NDArray[np.int64]
    path_m: FloatArray


def empty_plan(n_steps: int) -> PursuitPlan:
    """A plan in which nothing is written yet."""
    return PursuitPlan(
        np.zeros((LEGS, 3)),
        np.zeros(LEGS),
        np.ones(n_steps),
        np.zeros((n_steps, 3)),
        np.zeros((n_steps, 3)),
        np.zeros((n_steps + 1, S.N_STATES)),
        np.zeros((n_steps + 1, 2)),
        np.zeros(n_steps + 1, np.int64),
        np.zeros(n_steps + 1, np.int64),
        np.zeros((n_steps + 1, 3)),
    )


@allocating_kernel
def brake_seconds(arena, i, command):
    """How far braking leads ahead from the highest speed, over that speed [s]."""
    x, reference, u = np.zeros(S.N_STATES), np.zeros(2), np.zeros(S.N_INPUTS)
    speed_mps, steps = arena.uas[i].speed_mps, arena.rules[0].lookahead_steps
    write_command(command, CLIMB, speed_mps, 0.0, 0.0)
    for _ in range(2 * steps):
        command_wrench(arena.vehicles[i], x, reference, command, u)
        fly_kinematics(arena.vehicles[i], x, u)
    path_m = np.empty((steps + 1, 3))
    fly_and_brake(arena, i, x, reference, arena.rules[0].brake, False, path_m)
    return (path_m[:, 0].max() - x[S.X]) / speed_mps


@allocating_kernel
def begin(plan, x, reference):
    """Put the flight of a plan at its start."""
    plan.x[0] = x
    plan.reference[0] = reference
    plan.covered[0] = 0
    plan.leg[0] = 0
    plan.path_m[0] = x[:3]


@allocating_kernel
def _is_as_asked(waypoint, x):
    """Whether height and speed are those that a waypoint asks for, with some to spare."""
    speed_mps = math.sqrt(x[S.VX] * x[S.VX] + x[S.VY] * x[S.VY] + x[S.VZ] * x[S.VZ])
    spare_m = min(_HEIGHT_SPARE_M, 0.25 * (waypoint.highest_m - waypoint.lowest_m))
    return (
        waypoint.lowest_m + spare_m <= -x[S.Z] <= waypoint.highest_m - spare_m
        and speed_mps <= _SPEED_SHARE * waypoint.max_speed_mps
    )


@allocating_kernel
def _write_step(arena, i, task, plan, k, command, belief):
    """Simulate step k of a plan."""
    x, reference = plan.x[k + 1], plan.reference[k + 1]
    x[:] = plan.x[k]
    reference[:] = plan.reference[k]
    fly_kinematically(arena.vehicles[i], x, reference, command, np.zeros(S.N_INPUTS), belief)
    plan.path_m[k + 1, 0] = x[S.X]
    plan.path_m[k + 1, 1] = x[S.Y]
    plan.path_m[k + 1, 2] = x[S.Z]
    done = plan.covered[k]
    while done < len(task.route):
        waypoint = arena.waypoints[task.route[done]]
        at_m = waypoint.position_m
        dx, dy, dz = x[S.X] - at_m[0], x[S.Y] - at_m[1], x[S.Z] - at_m[2]
        if math.sqrt(dx * dx + dy * dy + dz * dz) > task.cover_m[done]:
            break
        if waypoint.asks and not _is_as_asked(waypoint, x):
            break
        done += 1
    plan.covered[k + 1] = done
    leg = max(plan.leg[k], done)
    if leg == plan.leg[k] and leg < min(len(task.route), LEGS):
        aim_m = plan.aim_m[leg]
        if math.hypot(x[S.X] - aim_m[0], x[S.Y] - aim_m[1]) < plan.early_m[leg]:
            leg += 1
    plan.leg[k + 1] = leg


@allocating_kernel
def _roofs_ahead(arena, i, x, x1, y1):
    """Altitude that low obstacles on a leg ask for, and the speed that leaves time to climb."""
    needed_m, speed_mps = -math.inf, arena.uas[i].speed_mps
    lag_s = arena.uas[i].time_scale * _LAG_S
    length_m = math.hypot(x1 - x[S.X], y1 - x[S.Y])
    for o in range(arena.obstacles.shape[0]):
        obstacle = arena.obstacles[o]
        at, over, _ = crossing(obstacle, arena.normals, arena.offsets_m, x[S.X], x[S.Y], x1, y1)
        if at > 1.0 or (obstacle.tall and not over):
            continue
        needed_m = max(needed_m, obstacle.roof_m)
        rise_m = obstacle.roof_m + x[S.Z]
        if rise_m > 0.0:
            speed_mps = min(speed_mps, at * length_m / (rise_m / arena.uas[i].climb_mps + lag_s))
    return needed_m, speed_mps


@allocating_kernel
def _pursue(arena, i, task, plan, k):
    """Write command k of a plan: towards the aim of its leg, or to rest at home."""
    x, leg, uas, rules = plan.x[k], plan.leg[k], arena.uas[i], arena.rules[0]
    target = HOME_TARGET if leg >= len(task.route) else task.route[leg]
    row, x1, y1, z1 = target_position(arena, i, target)
    speed_mps = uas.speed_mps
    if target >= 0 and leg < LEGS:
        x1, y1, z1 = plan.aim_m[leg, 0], plan.aim_m[leg, 1], plan.aim_m[leg, 2]
    end_x, end_y, way_m, kind = route(arena, row, x[S.X], x[S.Y], x[S.Z], x1, y1, z1)
    altitude_m = -z1
    lead_s, lag_s = 0.0, uas.time_scale * _LAG_S
    if target >= 0 and arena.waypoints[target].max_speed_mps < speed_mps:
        slow_mps = _SLOW_SHARE * arena.waypoints[target].max_speed_mps
        left_m = way_m - _SLOW_WITHIN * arena.waypoints[target].radius_m
        left_m = max(left_m - lag_s * math.hypot(x[S.VX], x[S.VY]), 0.0)
        braking_mps2 = 2.0 * _SLOW_BRAKING * task.acceleration_mps2
        speed_mps = min(speed_mps, math.sqrt(slow_mps * slow_mps + braking_mps2 * left_m))
    if target == HOME_TARGET or task.cover_m[leg] < 0.0:
        left_m = max(way_m - (task.near_m[leg] if target >= 0 else 0.0), 0.0)
        lead_s = min(lag_s, left_m / (2.0 * math.hypot(x[S.VX], x[S.VY]) + 1e-9))
        left_m = max(left_m - lead_s * math.hypot(x[S.VX], x[S.VY]), 0.0)
        speed_mps = min(speed_mps, math.sqrt(task.acceleration_mps2 * left_m), 0.5 * left_m)
        if target == HOME_TARGET:
            altitude_m += uas.descent_mps * max(way_m / uas.speed_mps - 1.0, 0.0)
            altitude_m = min(
                altitude_m, max(-x[S.Z], rules.floor_m + rules.length_scale * CRUISE_ALTITUDE_M)
            )
    if kind != CLEAR:
        needed_m, slow_mps = _roofs_ahead(arena, i, x, end_x, end_y)
        altitude_m = max(altitude_m, needed_m)
        speed_mps = min(speed_mps, slow_mps)
    dx, dy = end_x - x[S.X] - lead_s * x[S.VX], end_y - x[S.Y] - lead_s * x[S.VY]
    share = plan.share[k] * speed_mps / (math.hypot(dx, dy) + 1e-9)
    floor_m = lowest_altitude(arena, i, x[S.X], x[S.Y])
    altitude_m = min(max(altitude_m, floor_m), max(rules.ceiling_m, -z1))
    _write_pushed(arena, i, plan, k, share * dx, share * dy, altitude_m)


@allocating_kernel
def _write_pushed(arena, i, plan, k, north_mps, east_mps, altitude_m):
    """Write command k of a plan: the one given and the push, within the limits."""
    rules, push, x = arena.rules[0], plan.push[k], plan.x[k]
    north_mps += push[0]
    east_mps += push[1]
    share = min(1.0, arena.uas[i].speed_mps / (math.hypot(north_mps, east_mps) + 1e-9))
    plan.commands[k, 0] = share * north_mps
    plan.commands[k, 1] = share * east_mps
    floor_m = lowest_altitude(arena, i, x[S.X], x[S.Y])
    pushed_m = max(altitude_m + push[2], min(floor_m, altitude_m))
    plan.commands[k, 2] = min(pushed_m, max(rules.ceiling_m, altitude_m))


@allocating_kernel
def fly_step(arena, i, task, plan, k, command, belief=None):
    """Pursue for step k of a plan: its command, and the state that it leads to.

    Where the wind is known, the belief of the inner loop (N_BELIEF,) is given, and held.
    """
    _pursue(arena, i, task, plan, k)
    values = plan.commands[k]
    write_command(command, VELOCITY, values[0], values[1], values[2])
    _write_step(arena, i, task, plan, k, command, belief)


@allocating_kernel
def push_to_guidance(arena, i, task, plan, command, belief=None):
    """Choose the pushes so that the world's own guidance is flown."""
    plan.share[:] = 1.0
    for k in range(plan.commands.shape[0]):
        plan.push[k] = 0.0
        _pursue(arena, i, task, plan, k)
        x, done = plan.x[k], plan.covered[k]
        target, stop = HOME_TARGET, True
        if done < len(task.route):
            target = task.route[done]
            stop = task.cover_m[done] < 0.0 or arena.waypoints[target].asks
        guide(new_room(arena), arena, i, x, plan.reference[k], target, stop, False, command, belief)
        altitude_m = command.values[2] if command.kind == VELOCITY else -x[S.Z]
        plan.push[k, 0] = command.values[0] - plan.commands[k, 0]
        plan.push[k, 1] = command.values[1] - plan.commands[k, 1]
        plan.push[k, 2] = altitude_m - plan.commands[k, 2]
        fly_step(arena, i, task, plan, k, command, belief)


@allocating_kernel
def push_to(arena, i, task, plan, wanted, command, belief=None):
    """Choose the pushes so that given commands (N, 3) are flown, within the limits."""
    for k in range(plan.commands.shape[0]):
        plan.push[k] = 0.0
        _pursue(arena, i, task, plan, k)
        for axis in range(3):
            plan.push[k, axis] = wanted[k, axis] - plan.commands[k, axis]
        fly_step(arena, i, task, plan, k, command, belief)


@allocating_kernel
def aim(arena, i, task, plan, leg):
    """Aim a leg anew: at the side of the sphere where the flight turns, and climbs or descends."""
    waypoint = arena.waypoints[task.route[leg]]
    at_m = waypoint.position_m
    before = task.route[leg - 1] if leg > 0 else HOME_TARGET
    after = task.route[leg + 1] if leg + 1 < len(task.route) else task.route[leg]
    _, ax, ay, az = target_position(arena, i, before)
    if leg == 0:
        ax, ay, az = plan.path_m[0, 0], plan.path_m[0, 1], plan.path_m[0, 2]
    _, bx, by, bz = target_position(arena, i, after)
    if leg + 1 == len(task.route):
        _, bx, by, _ = target_position(arena, i, HOME_TARGET)
    a = math.hypot(ax - at_m[0], ay - at_m[1]) + 1e-9
    b = math.hypot(bx - at_m[0], by - at_m[1]) + 1e-9
    aside_m = 0.5 * _AIM_SHARE * waypoint.radius_m
    plan.aim_m[leg, 0] = at_m[0] + aside_m * ((ax - at_m[0]) / a + (bx - at_m[0]) / b)
    plan.aim_m[leg, 1] = at_m[1] + aside_m * ((ay - at_m[1]) / a + (by - at_m[1]) / b)
    off_m = 0.5 * waypoint.radius_m
    plan.aim_m[leg, 2] = min(max(0.5 * (az + bz), at_m[2] - off_m), at_m[2] + off_m)
    if waypoint.asks:
        plan.aim_m[leg, 2] = at_m[2]
    plan.early_m[leg] = 0.0
    pull_clear(arena, i, task, plan, leg)


@allocating_kernel
def pull_clear(arena, i, task, plan, leg):
    """Pull an aim towards the centre of its sphere until it is in it and clear of obstacles."""
    normals, offsets_m = arena.normals, arena.offsets_m
    waypoint, aim_m = arena.waypoints[task.route[leg]], plan.aim_m[leg]
    away_m = 0.0
    for axis in range(3):
        away_m += (aim_m[axis] - waypoint.position_m[axis]) ** 2
    share = min(1.0, 0.98 * waypoint.radius_m / (math.sqrt(away_m) + 1e-9))
    for _ in range(5):
        for axis in range(3):
            offset_m = aim_m[axis] - waypoint.position_m[axis]
            aim_m[axis] = waypoint.position_m[axis] + share * offset_m
        share = 1.0
        for o in range(arena.obstacles.shape[0]):
            obstacle = arena.obstacles[o]
            x, y, z = aim_m[0], aim_m[1], aim_m[2]
            if not box_apart(obstacle, x, y, z, x, y, z):
                clearance_m = signed_distance(
                    normals, offsets_m, obstacle.first_kept, obstacle.last_kept, x, y, z
                )
                if clearance_m < obstacle.wall_m:
                    share = 0.5
        if share == 1.0:
            return
    for axis in range(3):
        aim_m[axis] = waypoint.position_m[axis]
