"""What a UAS touches, or comes too near to, on the straight way from sample to sample."""

import math

from numba import njit

from uas_coverage_env.geometry import cylinder_clearance, segment_clearance, signed_distance
from uas_coverage_env.vehicle import DOD, X, Y, Z
from uas_coverage_env.world.outcome import BATTERY, FENCE, MOVING_OBSTACLE, NONE, OBSTACLE, UAS
from uas_coverage_env.world.routes import box_apart
from uas_coverage_env.world.state import FLYING


@njit(cache=True, error_model="numpy")
def face_between(normals, offsets_m, first, last, x0, y0, z0, x1, y1, z1):
    """A lower bound of the clearance of a segment: the face that both ends are farthest from."""
    largest = -math.inf
    for h in range(first, last):
        n0 = normals[h, 0]
        n1 = normals[h, 1]
        n2 = normals[h, 2]
        d0 = n0 * x0 + n1 * y0 + n2 * z0
        d1 = n0 * x1 + n1 * y1 + n2 * z1
        largest = max(largest, min(d0, d1) + offsets_m[h])
    return largest


@njit(cache=True, error_model="numpy")
def obstacle_clearance(obstacles, normals, offsets_m, x0, y0, z0, x1, y1, z1):
    """Smallest clearance of a segment from the fixed obstacles, exact.

    Near obstacles come first: what they leave is less than the far ones can be (near_m).

    Returns:
        (clearance [m], index of the obstacle); (inf, -1) where there is none.
    """
    smallest = math.inf
    nearest = -1
    for far in range(2):
        for o in range(obstacles.shape[0]):
            obstacle = obstacles[o]
            if box_apart(obstacle, x0, y0, z0, x1, y1, z1) != (far == 1):
                continue
            if far == 1 and obstacle.near_m >= smallest:
                continue
            first = obstacle.first_face
            last = obstacle.last_face
            bound = face_between(normals, offsets_m, first, last, x0, y0, z0, x1, y1, z1)
            if bound >= smallest:
                continue
            clearance = segment_clearance(normals, offsets_m, first, last, x0, y0, z0, x1, y1, z1)
            if clearance < smallest:
                smallest = clearance
                nearest = o
    return smallest, nearest


@njit(cache=True, error_model="numpy")
def moving_clearance(moving, now_m, next_m, m, x0, y0, z0, x1, y1, z1):
    """Smallest clearance from moving obstacle m, going straight from now_m to next_m (M, 3)."""
    return cylinder_clearance(
        moving[m].radius_m,
        moving[m].half_height_m,
        x0 - now_m[m, 0],
        y0 - now_m[m, 1],
        z0 - now_m[m, 2],
        x1 - next_m[m, 0],
        y1 - next_m[m, 1],
        z1 - next_m[m, 2],
    )


@njit(cache=True, error_model="numpy")
def separation(before_m, after_m, i, j):
    """Smallest separation of two UAS, each going straight from before_m to after_m (U, 3)."""
    return cylinder_clearance(
        0.0,
        0.0,
        before_m[i, 0] - before_m[j, 0],
        before_m[i, 1] - before_m[j, 1],
        before_m[i, 2] - before_m[j, 2],
        after_m[i, 0] - after_m[j, 0],
        after_m[i, 1] - after_m[j, 1],
        after_m[i, 2] - after_m[j, 2],
    )


@njit(cache=True, error_model="numpy")
def _blame(event, contact, index):
    """Note what a UAS was lost to; of several contacts in a step, the first code counts."""
    if event.contact == NONE:
        event.contact = contact
        event.contact_with = index


@njit(cache=True, error_model="numpy")
def judge_obstacles(arena, state, before_m, outcome):
    """Clearances from fixed and moving obstacles over the step, and contacts with them."""
    step = min(state.step[0], arena.moving_path_m.shape[0] - 2)
    now_m = arena.moving_path_m[step]
    next_m = arena.moving_path_m[step + 1]
    for i in range(state.status.shape[0]):
        event = outcome[i]
        if state.status[i] != FLYING:
            continue
        x0 = before_m[i, 0]
        y0 = before_m[i, 1]
        z0 = before_m[i, 2]
        x1 = state.x[i, X]
        y1 = state.x[i, Y]
        z1 = state.x[i, Z]
        smallest, nearest = obstacle_clearance(
            arena.obstacles, arena.normals, arena.offsets_m, x0, y0, z0, x1, y1, z1
        )
        radius_m = arena.uas[i].radius_m
        if smallest < radius_m:
            _blame(event, OBSTACLE, nearest)
        for m in range(arena.moving.shape[0]):
            clearance = moving_clearance(arena.moving, now_m, next_m, m, x0, y0, z0, x1, y1, z1)
            if clearance < radius_m:
                _blame(event, MOVING_OBSTACLE, m)
            smallest = min(smallest, clearance)
        event.obstacle_clearance_m = smallest


@njit(cache=True, error_model="numpy")
def judge_separation(arena, state, before_m, outcome):
    """Separations between flying UAS over the step, and contacts: both are lost."""
    n_uas = state.status.shape[0]
    for i in range(n_uas):
        if state.status[i] != FLYING:
            continue
        for j in range(i + 1, n_uas):
            if state.status[j] != FLYING:
                continue
            apart_m = separation(before_m, state.x, i, j)
            outcome[i].separation_m = min(outcome[i].separation_m, apart_m)
            outcome[j].separation_m = min(outcome[j].separation_m, apart_m)
            if apart_m < arena.uas[i].radius_m + arena.uas[j].radius_m:
                _blame(outcome[i], UAS, j)
                _blame(outcome[j], UAS, i)


@njit(cache=True, error_model="numpy")
def judge_limits(arena, state, outcome):
    """Contacts with the geofence and the end of the battery.

    The fence is convex: a segment that starts inside leaves it only if its end lies outside.
    """
    rules = arena.rules[0]
    for i in range(state.status.shape[0]):
        if state.status[i] != FLYING:
            continue
        outside_m = signed_distance(
            arena.normals,
            arena.offsets_m,
            rules.fence_first,
            rules.fence_last,
            state.x[i, X],
            state.x[i, Y],
            state.x[i, Z],
        )
        if outside_m > 0.0:
            _blame(outcome[i], FENCE, -1)
        if state.x[i, DOD] > arena.uas[i].dod_max:
            _blame(outcome[i], BATTERY, -1)


@njit(cache=True, error_model="numpy")
def _obstacle_breaches(arena, i, x, y, z):
    count = 0
    for o in range(arena.obstacles.shape[0]):
        obstacle = arena.obstacles[o]
        if not box_apart(obstacle, x, y, z, x, y, z):
            clearance = signed_distance(
                arena.normals, arena.offsets_m, obstacle.first_face, obstacle.last_face, x, y, z
            )
            if clearance < arena.uas[i].radius_m + obstacle.safe_distance_m:
                count += 1
    return count


@njit(cache=True, error_model="numpy")
def count_breaches(arena, state, outcome):
    """Count, at the new sample, what each UAS that is still whole is too near to."""
    rules = arena.rules[0]
    step = min(state.step[0] + 1, arena.moving_path_m.shape[0] - 1)
    next_m = arena.moving_path_m[step]
    for i in range(state.status.shape[0]):
        if state.status[i] != FLYING or outcome[i].contact != NONE:
            continue
        x = state.x[i, X]
        y = state.x[i, Y]
        z = state.x[i, Z]
        radius_m = arena.uas[i].radius_m
        count = _obstacle_breaches(arena, i, x, y, z)
        for m in range(arena.moving.shape[0]):
            clearance = moving_clearance(arena.moving, next_m, next_m, m, x, y, z, x, y, z)
            if clearance < radius_m + arena.moving[m].safe_distance_m:
                count += 1
        for j in range(state.status.shape[0]):
            if j != i and state.status[j] == FLYING and outcome[j].contact == NONE:
                keep_m = radius_m + arena.uas[j].radius_m + rules.uas_safe_distance_m
                if separation(state.x, state.x, i, j) < keep_m:
                    count += 1
        inside_m = -signed_distance(
            arena.normals, arena.offsets_m, rules.fence_first, rules.fence_last, x, y, z
        )
        if inside_m < rules.fence_margin_m:
            count += 1
        outcome[i].breaches = count
