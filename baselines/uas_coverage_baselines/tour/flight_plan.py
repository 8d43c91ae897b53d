"""Flight plans: how to fly the coming waypoints of a route, improved by trying it out.

A plan says where each of the next spheres is aimed at, how fast, and how early the flight turns to
the next; and what is added to the velocity in single steps. It is flown by pursuit, so that a
change early in the plan does not spoil what comes later. Each change is simulated with the inner
loop and the dynamics that the world flies, and kept where the UAS comes home earlier.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from uas_coverage_env.geometry import cylinder_clearance, segment_meets, signed_distance
from uas_coverage_env.vehicle import VX, VY, VZ, X, Y, Z, fly_kinematics
from uas_coverage_env.world.commands import CLIMB, VELOCITY
from uas_coverage_env.world.control import command_wrench, write_command
from uas_coverage_env.world.guidance import CRUISE_ALTITUDE_M, guide, target_position
from uas_coverage_env.world.lookahead import fixed_slack, fly_and_brake, moving_slack
from uas_coverage_env.world.routes import CLEAR, box_apart, crossing, route

FloatArray = NDArray[np.float64]

HOME_TARGET = -1
LEGS = 6
"""How many waypoints ahead are aimed at by choice."""

SAFE_BELOW_S = 1e5
_UNFLYABLE_S = 1e6  # cost of a plan that comes too near to something fixed
SLOWER = 1.15  # how much longer flights take than legs straight at full speed
_PEER_S = 30.0  # cost of coming too near to another UAS, for each step
_MOVING_S_PER_M = 5.0  # cost of coming too near to a moving obstacle
_MARGIN_M = 0.3  # beyond the distances that count as a breach
_PEER_MARGIN_M = 1.5
_PEER_STEPS = 10  # as long as the plans of others are believed
_EXACT_STEPS = 6  # of which braking is simulated as the safety filter does; then estimated
_LAG_S = 1.6  # the inner loop follows a velocity with about this delay
_AIM_SHARE = 0.8  # of the radius, at most, for the first aim
_STRETCH_S = 5.0  # the longest stretch that a change touches


class Task(NamedTuple):
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


class Plan(NamedTuple):
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


def empty_plan(n_steps: int) -> Plan:
    """A plan in which nothing is written yet."""
    return Plan(
        np.zeros((LEGS, 3)),
        np.zeros(LEGS),
        np.ones(n_steps),
        np.zeros((n_steps, 3)),
        np.zeros((n_steps, 3)),
        np.zeros((n_steps + 1, 14)),
        np.zeros((n_steps + 1, 2)),
        np.zeros(n_steps + 1, np.int64),
        np.zeros(n_steps + 1, np.int64),
        np.zeros((n_steps + 1, 3)),
    )


@njit(cache=True, error_model="numpy")
def brake_seconds(arena, i, command):
    """How far braking leads ahead from the highest speed, over that speed [s]."""
    x, reference, u = np.zeros(14), np.zeros(2), np.zeros(5)
    speed_mps, steps = arena.uas[i].speed_mps, arena.rules[0].lookahead_steps
    write_command(command, CLIMB, speed_mps, 0.0, 0.0)
    for _ in range(2 * steps):
        command_wrench(arena.vehicles[i], x, reference, command, u)
        fly_kinematics(arena.vehicles[i], x, u)
    path_m = np.empty((steps + 1, 3))
    fly_and_brake(arena, i, x, reference, arena.rules[0].brake, False, path_m)
    return (path_m[:, 0].max() - x[X]) / speed_mps


@njit(cache=True, error_model="numpy")
def _begin(plan, x, reference):
    plan.x[0] = x
    plan.reference[0] = reference
    plan.covered[0] = 0
    plan.leg[0] = 0
    plan.path_m[0] = x[:3]


@njit(cache=True, error_model="numpy")
def _write_step(arena, i, task, plan, k, command):
    """Simulate step k of a plan."""
    x, reference = plan.x[k + 1], plan.reference[k + 1]
    x[:] = plan.x[k]
    reference[:] = plan.reference[k]
    u = np.zeros(5)
    vehicle = arena.vehicles[i]
    command_wrench(vehicle, x, reference, command, u)
    fly_kinematics(vehicle, x, u)
    plan.path_m[k + 1, 0] = x[X]
    plan.path_m[k + 1, 1] = x[Y]
    plan.path_m[k + 1, 2] = x[Z]
    done = plan.covered[k]
    while done < len(task.route):
        at_m = arena.waypoints[task.route[done]].position_m
        dx, dy, dz = x[X] - at_m[0], x[Y] - at_m[1], x[Z] - at_m[2]
        if math.sqrt(dx * dx + dy * dy + dz * dz) > task.cover_m[done]:
            break
        done += 1
    plan.covered[k + 1] = done
    leg = max(plan.leg[k], done)
    if leg == plan.leg[k] and leg < min(len(task.route), LEGS):
        aim_m = plan.aim_m[leg]
        if math.hypot(x[X] - aim_m[0], x[Y] - aim_m[1]) < plan.early_m[leg]:
            leg += 1
    plan.leg[k + 1] = leg


@njit(cache=True, error_model="numpy")
def _roofs_ahead(arena, i, x, x1, y1):
    """Altitude that low obstacles on a leg ask for, and the speed that leaves time to climb."""
    needed_m, speed_mps = -math.inf, arena.uas[i].speed_mps
    length_m = math.hypot(x1 - x[X], y1 - x[Y])
    for o in range(arena.obstacles.shape[0]):
        obstacle = arena.obstacles[o]
        at, over, _ = crossing(obstacle, arena.normals, arena.offsets_m, x[X], x[Y], x1, y1)
        if at > 1.0 or (obstacle.tall and not over):
            continue
        needed_m = max(needed_m, obstacle.roof_m)
        rise_m = obstacle.roof_m + x[Z]
        if rise_m > 0.0:
            speed_mps = min(speed_mps, at * length_m / (rise_m / arena.uas[i].climb_mps + _LAG_S))
    return needed_m, speed_mps


@njit(cache=True, error_model="numpy")
def _pursue(arena, i, task, plan, k):
    """Write command k of a plan: towards the aim of its leg, or to rest at home."""
    x, leg, uas, rules = plan.x[k], plan.leg[k], arena.uas[i], arena.rules[0]
    target = HOME_TARGET if leg >= len(task.route) else task.route[leg]
    row, x1, y1, z1 = target_position(arena, i, target)
    speed_mps = uas.speed_mps
    if target >= 0 and leg < LEGS:
        x1, y1, z1 = plan.aim_m[leg, 0], plan.aim_m[leg, 1], plan.aim_m[leg, 2]
    end_x, end_y, way_m, kind = route(arena, row, x[X], x[Y], x[Z], x1, y1, z1)
    altitude_m = -z1
    lead_s = 0.0
    if target == HOME_TARGET or task.cover_m[leg] < 0.0:
        left_m = max(way_m - (task.near_m[leg] if target >= 0 else 0.0), 0.0)
        lead_s = min(_LAG_S, left_m / (2.0 * math.hypot(x[VX], x[VY]) + 1e-9))
        left_m = max(left_m - lead_s * math.hypot(x[VX], x[VY]), 0.0)
        speed_mps = min(speed_mps, math.sqrt(task.acceleration_mps2 * left_m), 0.5 * left_m)
        if target == HOME_TARGET:
            altitude_m += uas.descent_mps * max(way_m / uas.speed_mps - 1.0, 0.0)
            altitude_m = min(altitude_m, max(-x[Z], rules.floor_m + CRUISE_ALTITUDE_M))
    if kind != CLEAR:
        needed_m, slow_mps = _roofs_ahead(arena, i, x, end_x, end_y)
        altitude_m = max(altitude_m, needed_m)
        speed_mps = min(speed_mps, slow_mps)
    dx, dy = end_x - x[X] - lead_s * x[VX], end_y - x[Y] - lead_s * x[VY]
    share = plan.share[k] * speed_mps / (math.hypot(dx, dy) + 1e-9)
    altitude_m = min(max(altitude_m, rules.floor_m), max(rules.ceiling_m, -z1))
    _write_pushed(arena, i, plan, k, share * dx, share * dy, altitude_m)


@njit(cache=True, error_model="numpy")
def _write_pushed(arena, i, plan, k, north_mps, east_mps, altitude_m):
    """Write command k of a plan: the one given and the push, within the limits."""
    rules, push = arena.rules[0], plan.push[k]
    north_mps += push[0]
    east_mps += push[1]
    share = min(1.0, arena.uas[i].speed_mps / (math.hypot(north_mps, east_mps) + 1e-9))
    plan.commands[k, 0] = share * north_mps
    plan.commands[k, 1] = share * east_mps
    pushed_m = max(altitude_m + push[2], min(rules.floor_m, altitude_m))
    plan.commands[k, 2] = min(pushed_m, max(rules.ceiling_m, altitude_m))


@njit(cache=True, error_model="numpy")
def _push_to_guidance(arena, i, task, plan, command):
    """Choose the pushes so that the world's own guidance is flown."""
    plan.share[:] = 1.0
    for k in range(plan.commands.shape[0]):
        plan.push[k] = 0.0
        _pursue(arena, i, task, plan, k)
        x, done = plan.x[k], plan.covered[k]
        target, stop = HOME_TARGET, True
        if done < len(task.route):
            target, stop = task.route[done], task.cover_m[done] < 0.0
        guide(arena, i, x, plan.reference[k], target, stop, False, command)
        altitude_m = command.values[2] if command.kind == VELOCITY else -x[Z]
        plan.push[k, 0] = command.values[0] - plan.commands[k, 0]
        plan.push[k, 1] = command.values[1] - plan.commands[k, 1]
        plan.push[k, 2] = altitude_m - plan.commands[k, 2]
        _pursue(arena, i, task, plan, k)
        write_command(command, VELOCITY, *_three(plan.commands[k]))
        _write_step(arena, i, task, plan, k, command)


@njit(cache=True, error_model="numpy")
def _has_landed(arena, i, task, x, covered):
    if covered < len(task.route):
        return False
    rules, home_m = arena.rules[0], arena.uas[i].home_m
    dx, dy, dz = x[X] - home_m[0], x[Y] - home_m[1], x[Z] - home_m[2]
    speed_mps = math.sqrt(x[VX] * x[VX] + x[VY] * x[VY] + x[VZ] * x[VZ])
    near = math.sqrt(dx * dx + dy * dy + dz * dz) < 0.9 * rules.landing_distance_m
    return near and speed_mps < 0.9 * rules.landing_speed_mps


@njit(cache=True, error_model="numpy")
def _is_clear(arena, keep_m, fence_m, x0, y0, z0, x1, y1, z1):
    """Whether a segment keeps the distances (O,) from the obstacles and (F,) from the fence."""
    normals, offsets_m, rules = arena.normals, arena.offsets_m, arena.rules[0]
    for h in range(rules.fence_first, rules.fence_last):
        outside_m = signed_distance(normals, offsets_m, h, h + 1, x1, y1, z1)
        if -outside_m < fence_m[h - rules.fence_first]:
            return False
    for o in range(arena.obstacles.shape[0]):
        obstacle = arena.obstacles[o]
        if box_apart(obstacle, x0, y0, z0, x1, y1, z1):
            continue
        first, last = obstacle.first_face, obstacle.last_face
        if segment_meets(normals, offsets_m, first, last, keep_m[o], x0, y0, z0, x1, y1, z1):
            return False
    return True


@njit(cache=True, error_model="numpy")
def _distances_to_keep(arena, i, x):
    """What is kept from obstacles and fence: less where there is less already."""
    normals, offsets_m, rules = arena.normals, arena.offsets_m, arena.rules[0]
    keep_m = np.empty(arena.obstacles.shape[0])
    for o in range(arena.obstacles.shape[0]):
        obstacle = arena.obstacles[o]
        now_m = signed_distance(
            normals, offsets_m, obstacle.first_face, obstacle.last_face, x[X], x[Y], x[Z]
        )
        keep_m[o] = min(
            arena.uas[i].radius_m + obstacle.safe_distance_m + _MARGIN_M, now_m - 1e-3
        )
    fence_m = np.empty(rules.fence_last - rules.fence_first)
    for h in range(len(fence_m)):
        face = rules.fence_first + h
        now_m = -signed_distance(normals, offsets_m, face, face + 1, x[X], x[Y], x[Z])
        fence_m[h] = min(rules.fence_margin_m + 0.5 * _MARGIN_M, now_m - 1e-3)
    return keep_m, fence_m


@njit(cache=True, error_model="numpy")
def _seconds_to(arena, i, task, x, covered):
    """Flight time left after the plan, estimated."""
    uas = arena.uas[i]
    heads_home = covered == len(task.route)
    target = HOME_TARGET if heads_home else task.route[covered]
    row, x1, y1, z1 = target_position(arena, i, target)
    corner_x, corner_y, way_m, _ = route(arena, row, x[X], x[Y], x[Z], x1, y1, z1)
    near_m = task.near_m[covered]
    left_m = max(way_m - near_m, 0.0)
    up_m, down_m = max(x[Z] - z1 - near_m, 0.0), max(z1 - x[Z] - near_m, 0.0)
    seconds = max(left_m / uas.speed_mps, up_m / uas.climb_mps + down_m / uas.descent_mps)
    # what is left for later takes longer than straight flight: no gain in putting it off
    seconds = SLOWER * seconds + task.rest_s[covered]
    # what is lost until the velocity is the wanted one
    wanted_mps = uas.speed_mps
    if heads_home or task.cover_m[covered] < 0.0:
        wanted_mps = min(wanted_mps, math.sqrt(2.0 * task.acceleration_mps2 * left_m))
        seconds += 0.5 * wanted_mps / task.acceleration_mps2
    dx, dy = corner_x - x[X], corner_y - x[Y]
    length_m = math.hypot(dx, dy) + 1e-9
    dvx, dvy = x[VX] - wanted_mps * dx / length_m, x[VY] - wanted_mps * dy / length_m
    seconds += (dvx * dvx + dvy * dvy) / (2.0 * task.acceleration_mps2 * uas.speed_mps)
    return seconds


@njit(cache=True, error_model="numpy")
def _surroundings_cost(arena, i, task, plan, n_flown, others_m):
    """Cost of coming near to other UAS and to what moves."""
    cost = 0.0
    for j in range(others_m.shape[0]):
        if j == i or math.isnan(others_m[j, 0, 0]):
            continue
        keep_m = arena.uas[i].radius_m + arena.uas[j].radius_m
        keep_m += arena.rules[0].uas_safe_distance_m + _PEER_MARGIN_M
        for k in range(min(n_flown, _PEER_STEPS)):
            a, b, c, d = plan.path_m[k], plan.path_m[k + 1], others_m[j, k], others_m[j, k + 1]
            apart_m = cylinder_clearance(
                0.0, 0.0, a[0] - c[0], a[1] - c[1], a[2] - c[2],
                b[0] - d[0], b[1] - d[1], b[2] - d[2],
            )  # fmt: skip
            if apart_m < keep_m:
                cost += _PEER_S * (1.0 + (keep_m - apart_m) / keep_m)
    if arena.moving.shape[0]:
        flown_m = plan.path_m[: n_flown + 1]
        slack_m = moving_slack(arena, 0, i, flown_m, -math.inf, task.moving_margin_m)
        cost += _MOVING_S_PER_M * (task.moving_margin_m - slack_m)
    return cost


@njit(cache=True, error_model="numpy")
def _cost_s(arena, i, task, plan, first, keep_m, fence_m, others_m, command, scratch_m, limit_s):
    """Simulate a plan from step `first` on; the flight time to the end, and what it costs more.

    Gives up, with inf, where the plan is seen to cost more than the limit.
    """
    dt_s, n_steps = arena.rules[0].dt_s, plan.commands.shape[0]
    n_flown = n_steps
    cost = 0.0
    for k in range(n_steps):
        if k >= first:
            _pursue(arena, i, task, plan, k)
            write_command(command, VELOCITY, *_three(plan.commands[k]))
            _write_step(arena, i, task, plan, k, command)
            a, x = plan.path_m[k], plan.x[k + 1]
            clear = _is_clear(arena, keep_m, fence_m, a[0], a[1], a[2], x[X], x[Y], x[Z])
            if clear and k < _EXACT_STEPS:
                n_braking, slack_m = fly_and_brake(
                    arena, i, plan.x[k], plan.reference[k], command, False, scratch_m
                )
                clear = fixed_slack(arena, i, scratch_m, n_braking, 0.0, slack_m) >= 0.0
            elif clear:
                clear = _is_clear(
                    arena, keep_m, fence_m, x[X], x[Y], x[Z], x[X] + task.brake_s * x[VX],
                    x[Y] + task.brake_s * x[VY], x[Z] + 0.5 * dt_s * x[VZ],
                )  # fmt: skip
            if not clear:
                cost = _UNFLYABLE_S * (2.0 - k / n_steps)
                if cost > limit_s:
                    return math.inf
                for later in range(k + 1, n_steps):
                    _pursue(arena, i, task, plan, later)
                    write_command(command, VELOCITY, *_three(plan.commands[later]))
                    _write_step(arena, i, task, plan, later, command)
                break
        if _has_landed(arena, i, task, plan.x[k + 1], plan.covered[k + 1]):
            n_flown = k + 1
            break
    cost += n_flown * dt_s
    if n_flown == n_steps:
        cost += _seconds_to(arena, i, task, plan.x[n_steps], plan.covered[n_steps])
    if cost > limit_s:
        return math.inf
    return cost + _surroundings_cost(arena, i, task, plan, n_flown, others_m)


@njit(cache=True, error_model="numpy")
def _three(values):
    return values[0], values[1], values[2]


@njit(cache=True, error_model="numpy")
def _aim(arena, i, task, plan, leg):
    """Aim a leg anew: at the side of the sphere on which the flight turns."""
    at_m = arena.waypoints[task.route[leg]].position_m
    reach_m = _AIM_SHARE * arena.waypoints[task.route[leg]].radius_m
    before = task.route[leg - 1] if leg > 0 else HOME_TARGET
    after = task.route[leg + 1] if leg + 1 < len(task.route) else HOME_TARGET
    _, ax, ay, _ = target_position(arena, i, before)
    if leg == 0:
        ax, ay = plan.path_m[0, 0], plan.path_m[0, 1]
    _, bx, by, _ = target_position(arena, i, after)
    a = math.hypot(ax - at_m[0], ay - at_m[1]) + 1e-9
    b = math.hypot(bx - at_m[0], by - at_m[1]) + 1e-9
    plan.aim_m[leg, 0] = at_m[0] + 0.5 * reach_m * ((ax - at_m[0]) / a + (bx - at_m[0]) / b)
    plan.aim_m[leg, 1] = at_m[1] + 0.5 * reach_m * ((ay - at_m[1]) / a + (by - at_m[1]) / b)
    plan.aim_m[leg, 2] = at_m[2]
    plan.early_m[leg] = 0.0
    _pull_clear(arena, i, task, plan, leg)


@njit(cache=True, error_model="numpy")
def _pull_clear(arena, i, task, plan, leg):
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
                    normals, offsets_m, obstacle.first_face, obstacle.last_face, x, y, z
                )
                if clearance_m < obstacle.wall_m:
                    share = 0.5
        if share == 1.0:
            return
    for axis in range(3):
        aim_m[axis] = waypoint.position_m[axis]


@njit(cache=True, error_model="numpy")
def _aim(arena, i, task, plan, leg):
    """Aim a leg anew: at the side of the sphere on which the flight turns."""
    at_m = arena.waypoints[task.route[leg]].position_m
    reach_m = _AIM_SHARE * arena.waypoints[task.route[leg]].radius_m
    before = task.route[leg - 1] if leg > 0 else HOME_TARGET
    after = task.route[leg + 1] if leg + 1 < len(task.route) else HOME_TARGET
    _, ax, ay, _ = target_position(arena, i, before)
    if leg == 0:
        ax, ay = plan.path_m[0, 0], plan.path_m[0, 1]
    _, bx, by, _ = target_position(arena, i, after)
    a = math.hypot(ax - at_m[0], ay - at_m[1]) + 1e-9
    b = math.hypot(bx - at_m[0], by - at_m[1]) + 1e-9
    plan.aim_m[leg, 0] = at_m[0] + 0.5 * reach_m * ((ax - at_m[0]) / a + (bx - at_m[0]) / b)
    plan.aim_m[leg, 1] = at_m[1] + 0.5 * reach_m * ((ay - at_m[1]) / a + (by - at_m[1]) / b)
    plan.aim_m[leg, 2] = at_m[2]
    plan.early_m[leg] = 0.0
    _pull_clear(arena, i, task, plan, leg)


@njit(cache=True, error_model="numpy")
def _pull_clear(arena, i, task, plan, leg):
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
                    normals, offsets_m, obstacle.first_face, obstacle.last_face, x, y, z
                )
                if clearance_m < obstacle.wall_m:
                    share = 0.5
        if share == 1.0:
            return
    for axis in range(3):
        aim_m[axis] = waypoint.position_m[axis]


@njit(cache=True, error_model="numpy")
def _first_step_is_safe(arena, i, plan, command):
    """Whether the UAS can brake after the first command, as the safety filter asks."""
    path_m = np.empty((arena.rules[0].lookahead_steps + 1, 3))
    write_command(command, VELOCITY, *_three(plan.commands[0]))
    x, reference = plan.x[0], plan.reference[0]
    n_flown, slack_m = fly_and_brake(arena, i, x, reference, command, False, path_m)
    return fixed_slack(arena, i, path_m, n_flown, 0.0, slack_m) >= 0.0


@njit(cache=True, error_model="numpy")
def _change(arena, i, task, plan, rng, spread):
    """Change a plan in place; the step from which on it is another flight."""
    n_steps = plan.commands.shape[0]
    n_legs = min(len(task.route), LEGS)
    kind = rng.random()
    if n_legs == 0 or kind < 0.45:
        longest = max(1, min(n_steps, round(_STRETCH_S / arena.rules[0].dt_s)))
        first = int(n_steps * rng.random() * rng.random())
        last = min(n_steps, first + rng.integers(1, longest + 1))
        kept = 0.0 if rng.random() < 0.15 else 1.0
        north_mps, east_mps, up_m, speed = 0.0, 0.0, 0.0, 1.0
        what = rng.random()
        if what < 0.6:
            north_mps, east_mps = rng.normal() * 5.0 * spread, rng.normal() * 5.0 * spread
        elif what < 0.8:
            speed = rng.random()
        elif what < 0.95:
            up_m = rng.normal() * 8.0 * spread
        for k in range(first, last):
            plan.push[k, 0] = kept * plan.push[k, 0] + north_mps
            plan.push[k, 1] = kept * plan.push[k, 1] + east_mps
            plan.push[k, 2] = kept * plan.push[k, 2] + up_m
            if what >= 0.6:
                plan.share[k] = speed
        return first
    leg = int(n_legs * rng.random() * rng.random())
    first = 0
    while first < n_steps and plan.leg[first] < leg:
        first += 1
    if kind < 0.85:
        sigma_m = 0.5 * arena.waypoints[task.route[leg]].radius_m * spread
        level = rng.random() < 0.7
        for axis in range(3):
            if (axis < 2) == level:
                plan.aim_m[leg, axis] += rng.normal() * sigma_m
        _pull_clear(arena, i, task, plan, leg)
    else:
        plan.early_m[leg] = max(0.0, plan.early_m[leg] + rng.normal() * 12.0 * spread)
    return first


@njit(cache=True, error_model="numpy")
def _copy(plan, other, first):
    plan.aim_m[:] = other.aim_m
    plan.share[:] = other.share
    plan.early_m[:] = other.early_m
    plan.push[:] = other.push
    plan.commands[first:] = other.commands[first:]
    plan.x[first:] = other.x[first:]
    plan.reference[first:] = other.reference[first:]
    plan.covered[first:] = other.covered[first:]
    plan.leg[first:] = other.leg[first:]
    plan.path_m[first:] = other.path_m[first:]


@njit(cache=True, error_model="numpy")
def improve(arena, i, task, x, reference, others_m, plan, trial, n_kept, n_changes, rng, command):
    """Plan the coming seconds of a UAS.

    Args:
        arena: The arena; its moving obstacles are where they are now, in row 0.
        i: Index of the UAS.
        task: What it has to do.
        x: (14,) its state.
        reference: (2,) [m/s] of its inner loop.
        others_m: (U, N+1, 3) [m] where the others are going; NaN where nobody flies.
        plan: What is left of the plan before is tried; written.
        trial: Another plan of the same size, written.
        n_kept: How many legs of the plan before are left; the others are aimed anew.
        n_changes: How many changes are tried.
        rng: Source of random numbers.
        command: A record of COMMAND_DTYPE, written.

    Returns:
        Estimated flight time to the end [s]; above SAFE_BELOW_S where the plan is not safe.
    """
    keep_m, fence_m = _distances_to_keep(arena, i, x)
    scratch_m = np.empty((arena.rules[0].lookahead_steps + 1, 3))
    n_legs = min(len(task.route), LEGS)
    _begin(plan, x, reference)
    _begin(trial, x, reference)
    for leg in range(n_legs):
        _aim(arena, i, task, trial, leg)
        if leg >= n_kept:
            _aim(arena, i, task, plan, leg)
    trial.push[:] = 0.0
    trial.share[:] = 1.0
    best = _cost_s(arena, i, task, trial, 0, keep_m, fence_m, others_m, command, scratch_m, math.inf)
    cost = _cost_s(arena, i, task, plan, 0, keep_m, fence_m, others_m, command, scratch_m, math.inf)
    if cost >= SAFE_BELOW_S:  # what is new is its last step: brake there
        plan.share[-1] = 0.0
        cost = _cost_s(
            arena, i, task, plan, 0, keep_m, fence_m, others_m, command, scratch_m, math.inf
        )
    if cost < best:
        best = cost
        _copy(trial, plan, 0)
    _copy(plan, trial, 0)
    _push_to_guidance(arena, i, task, trial, command)
    cost = _cost_s(arena, i, task, trial, 0, keep_m, fence_m, others_m, command, scratch_m, best)
    if cost < best:
        best = cost
        _copy(plan, trial, 0)
    _copy(trial, plan, 0)
    for change in range(n_changes):
        spread = 1.0 - 0.8 * change / n_changes
        first = _change(arena, i, task, trial, rng, spread)
        # steps before the change are known to be clear, unless the plan so far is unflyable
        begin = first if best < SAFE_BELOW_S else 0
        cost = _cost_s(arena, i, task, trial, begin, keep_m, fence_m, others_m, command, scratch_m, best)
        if cost < best - 1e-9:
            best = cost
            _copy(plan, trial, begin)
        else:
            _copy(trial, plan, begin)
    return best
