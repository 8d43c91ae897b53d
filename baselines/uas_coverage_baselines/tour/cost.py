"""What a simulated flight costs: the seconds to the end of the route, and what comes too near."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from uas_coverage_baselines.tour.pursuit import HOME_TARGET, fly_step
from uas_coverage_env.autopilot.belief import GUSTS, ground_speed
from uas_coverage_env.autopilot.guidance import target_position
from uas_coverage_env.autopilot.lookahead import fixed_slack, fly_and_brake, moving_slack
from uas_coverage_env.compiled.kernels import allocating_kernel
from uas_coverage_env.entities.state import WIND
from uas_coverage_env.geometry.segments import cylinder_clearance, segment_meets, signed_distance
from uas_coverage_env.vehicle import layout as S
from uas_coverage_env.vehicle.range import ROUTED, SpeedLimits, flight_seconds
from uas_coverage_env.world.height import in_landing_zone
from uas_coverage_env.world.routes import box_apart, route

FloatArray = NDArray[np.float64]

SAFE_BELOW_S = 1e5
"""A plan that costs more comes too near to something fixed."""

SLOWER = 1.15
"""How much longer flights take than legs straight at full speed."""

_UNFLYABLE_S = 1e6
_PEER_S = 30.0  # cost of coming too near to another UAS, for each step
_MOVING_S_PER_M = 5.0  # cost of coming too near to a moving obstacle
_MARGIN_M = 0.3  # beyond the distances that count as a breach, at scale 1
_PEER_MARGIN_M = 1.5
_PEER_STEPS = 10  # as long as the plans of others are believed
_EXACT_STEPS = 6  # of which braking is simulated as the safety filter does; then estimated


class Around(NamedTuple):
    """What a UAS keeps clear of in one decision.

    Attributes:
        keep_m: (O,) distances from the obstacles.
        fence_m: (F,) distances from the faces of the fence.
        height_m: Above the ground, outside of the landing zone.
        others_m: (U, N+1, 3) where the others are going; NaN where none is flying.
        path_m: (K, 3) written: a braking flight.
    """

    keep_m: FloatArray
    fence_m: FloatArray
    height_m: float
    others_m: FloatArray
    path_m: FloatArray


@allocating_kernel
def distances_kept(arena, i, x, others_m):
    """What is kept from obstacles, fence and ground: less where there is less already."""
    normals, offsets_m, rules = arena.normals, arena.offsets_m, arena.rules[0]
    margin_m = rules.length_scale * _MARGIN_M
    keep_m = np.empty(arena.obstacles.shape[0])
    for o in range(arena.obstacles.shape[0]):
        obstacle = arena.obstacles[o]
        now_m = signed_distance(
            normals, offsets_m, obstacle.first_kept, obstacle.last_kept, x[S.X], x[S.Y], x[S.Z]
        )
        keep_m[o] = min(arena.uas[i].radius_m + obstacle.safe_distance_m + margin_m, now_m - 1e-3)
    fence_m = np.empty(rules.fence_last - rules.fence_first)
    for h in range(len(fence_m)):
        face = rules.fence_first + h
        now_m = -signed_distance(normals, offsets_m, face, face + 1, x[S.X], x[S.Y], x[S.Z])
        fence_m[h] = min(rules.fence_margin_m + 0.5 * margin_m, now_m - 1e-3)
    height_m = -math.inf
    if rules.min_height_m > 0.0:
        height_m = rules.min_height_m + 0.5 * margin_m
        if not in_landing_zone(arena, i, x[S.X], x[S.Y]):
            height_m = min(height_m, -x[S.Z] - 1e-3)
    path_m = np.empty((rules.lookahead_steps + 1, 3))
    return Around(keep_m, fence_m, height_m, others_m, path_m)


@allocating_kernel
def _is_clear(arena, i, around, x0, y0, z0, x1, y1, z1):
    """Whether a segment keeps its distances from obstacles and fence, and its end the height."""
    if -z1 < around.height_m and not in_landing_zone(arena, i, x1, y1):
        return False
    normals, offsets_m, rules = arena.normals, arena.offsets_m, arena.rules[0]
    for h in range(rules.fence_first, rules.fence_last):
        outside_m = signed_distance(normals, offsets_m, h, h + 1, x1, y1, z1)
        if -outside_m < around.fence_m[h - rules.fence_first]:
            return False
    for o in range(arena.obstacles.shape[0]):
        obstacle = arena.obstacles[o]
        if box_apart(obstacle, x0, y0, z0, x1, y1, z1):
            continue
        first, last = obstacle.first_kept, obstacle.last_kept
        if segment_meets(normals, offsets_m, first, last, around.keep_m[o], x0, y0, z0, x1, y1, z1):
            return False
    return True


@allocating_kernel
def _has_landed(arena, i, task, x, covered):
    if covered < len(task.route):
        return False
    rules, home_m = arena.rules[0], arena.uas[i].home_m
    dx, dy, dz = x[S.X] - home_m[0], x[S.Y] - home_m[1], x[S.Z] - home_m[2]
    speed_mps = math.sqrt(x[S.VX] * x[S.VX] + x[S.VY] * x[S.VY] + x[S.VZ] * x[S.VZ])
    near = math.sqrt(dx * dx + dy * dy + dz * dz) < 0.9 * rules.landing_distance_m
    return near and speed_mps < 0.9 * rules.landing_speed_mps


@allocating_kernel
def _seconds_to(arena, i, task, x, covered, belief):
    """Flight time left after the plan, estimated."""
    uas = arena.uas[i]
    heads_home = covered == len(task.route)
    target = HOME_TARGET if heads_home else task.route[covered]
    row, x1, y1, z1 = target_position(arena, i, target)
    corner_x, corner_y, way_m, _ = route(arena, row, x[S.X], x[S.Y], x[S.Z], x1, y1, z1)
    near_m = task.near_m[covered]
    left_m = max(way_m - near_m, 0.0)
    up_m, down_m = max(x[S.Z] - z1 - near_m, 0.0), max(z1 - x[S.Z] - near_m, 0.0)
    dx, dy = corner_x - x[S.X], corner_y - x[S.Y]
    length_m = math.hypot(dx, dy) + 1e-9
    speed_mps = uas.speed_mps
    if belief is not None:
        speed_mps = ground_speed(
            speed_mps, GUSTS, belief[WIND], belief[WIND + 1], dx / length_m, dy / length_m
        )
    speeds = SpeedLimits(speed_mps, uas.climb_mps, uas.descent_mps)
    seconds = flight_seconds(ROUTED, speeds, 0.0, left_m, up_m, down_m)
    # what is left for later takes longer than straight flight: no gain in putting it off
    seconds = SLOWER * seconds + task.rest_s[covered]
    # what is lost until the velocity is the wanted one
    wanted_mps = speed_mps
    if heads_home or task.cover_m[covered] < 0.0:
        wanted_mps = min(wanted_mps, math.sqrt(2.0 * task.acceleration_mps2 * left_m))
        seconds += 0.5 * wanted_mps / task.acceleration_mps2
    dvx, dvy = x[S.VX] - wanted_mps * dx / length_m, x[S.VY] - wanted_mps * dy / length_m
    seconds += (dvx * dvx + dvy * dvy) / (2.0 * task.acceleration_mps2 * uas.speed_mps)
    return seconds


@allocating_kernel
def surroundings_cost(arena, i, task, plan, n_flown, others_m):
    """Cost of coming near to other UAS and to what moves."""
    cost = 0.0
    for j in range(others_m.shape[0]):
        if j == i or math.isnan(others_m[j, 0, 0]):
            continue
        keep_m = arena.uas[i].radius_m + arena.uas[j].radius_m
        keep_m += arena.rules[0].uas_safe_distance_m
        keep_m += arena.rules[0].length_scale * _PEER_MARGIN_M
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


@allocating_kernel
def cost_s(arena, i, task, plan, first, around, command, limit_s, belief=None):
    """Simulate a plan from step `first` on; the flight time to the end, and what it costs more.

    Gives up, with inf, where the plan is seen to cost more than the limit.
    """
    dt_s, n_steps = arena.rules[0].dt_s, plan.commands.shape[0]
    n_flown = n_steps
    cost = 0.0
    for k in range(n_steps):
        if k >= first:
            fly_step(arena, i, task, plan, k, command, belief)
            a, x = plan.path_m[k], plan.x[k + 1]
            clear = _is_clear(arena, i, around, a[0], a[1], a[2], x[S.X], x[S.Y], x[S.Z])
            if clear and k < _EXACT_STEPS:
                n_braking, slack_m = fly_and_brake(
                    arena, i, plan.x[k], plan.reference[k], command, False, around.path_m, belief
                )
                clear = fixed_slack(arena, i, around.path_m, n_braking, 0.0, slack_m) >= 0.0
            elif clear:
                clear = _is_clear(
                    arena, i, around, x[S.X], x[S.Y], x[S.Z], x[S.X] + task.brake_s * x[S.VX],
                    x[S.Y] + task.brake_s * x[S.VY], x[S.Z] + 0.5 * dt_s * x[S.VZ],
                )  # fmt: skip
            if not clear:
                cost = _UNFLYABLE_S * (2.0 - k / n_steps)
                if cost > limit_s:
                    return math.inf
                for later in range(k + 1, n_steps):
                    fly_step(arena, i, task, plan, later, command, belief)
                break
        if _has_landed(arena, i, task, plan.x[k + 1], plan.covered[k + 1]):
            n_flown = k + 1
            break
    cost += n_flown * dt_s
    if n_flown == n_steps:
        cost += _seconds_to(arena, i, task, plan.x[n_steps], plan.covered[n_steps], belief)
    if cost > limit_s:
        return math.inf
    return cost + surroundings_cost(arena, i, task, plan, n_flown, around.others_m)
