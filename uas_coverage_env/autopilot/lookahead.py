"""What would happen if a command were flown for a step, and then the brakes were put on."""

import math

from uas_coverage_env.autopilot.belief import believed_kinematics, believed_wrench
from uas_coverage_env.autopilot.control import command_wrench
from uas_coverage_env.compiled.kernels import kernel, rare_kernel, stack_array
from uas_coverage_env.entities.commands import WRENCH
from uas_coverage_env.entities.state import FLYING, WIND
from uas_coverage_env.geometry.segments import (
    cylinder_clearance,
    segment_clearance,
    signed_distance,
)
from uas_coverage_env.vehicle import layout as S
from uas_coverage_env.vehicle import plant_step
from uas_coverage_env.vehicle.inner_loop import reseed_reference
from uas_coverage_env.vehicle.layout import N_INPUTS, N_STATES
from uas_coverage_env.vehicle.lpv import fly_kinematics
from uas_coverage_env.world.contacts import face_between, moving_clearance
from uas_coverage_env.world.height import in_landing_zone
from uas_coverage_env.world.routes import box_apart

TOLERANCE_M = 1e-3
"""Clearances of a braking flight may be missed by this: rounding must not forbid braking on."""

PLENTY_M = 2.0
"""More distance to spare than this makes no difference; obstacles farther away are skipped [m]."""

SURPRISE_S = 1.0
"""What moves may turn: its keep-out is widened by how far it goes in this time, or less of it for a
UAS that is quicker than the shipped multirotors (`governor.time_scale`) [s]. Chosen by hand;
`benchmarks/safety_filter.py` shows how many UAS are hit."""

TURN_S = 2.5
"""In planar missions what moves may turn round, and is looked at for this long on its way back, or
less of it as above [s]. Chosen by hand: 3.5 and 5 cost more steps and lose no fewer UAS in the
offices of `docs/safety_filter.md`."""

_STILL_MPS, _STILL_RAD = 0.02, 0.004
"""A UAS stands when its speed is less, its tilt nearer to that of a hover, and its rates
[rad/s] are less: what is left of the motion is centimetres."""

_SURELY_M = 1e-6
"""More than rounding can change in a distance [m]."""

_CREEPING_MPS = 0.1
"""A UAS that is no faster at the end of a prediction is taken to stand, too."""


@kernel
def _is_still(x, roll_rad, pitch_rad):
    """Slow and as level as in a hover."""
    return (
        abs(x[S.VX]) + abs(x[S.VY]) + abs(x[S.VZ]) < _STILL_MPS
        and abs(x[S.PHI] - roll_rad) + abs(x[S.THETA] - pitch_rad) < _STILL_RAD
        and abs(x[S.WX]) + abs(x[S.WY]) < _STILL_RAD
    )


@kernel
def _kept_m(required_m, now_m):
    """What has to be kept: the distance required, or the distance now where it is less already.

    So a UAS that starts too near to something may stay or leave, but not come nearer.
    """
    return min(required_m, now_m - TOLERANCE_M)


@rare_kernel
def _fly_as_believed(vehicle, belief, x, governed, command, nonlinear, u):
    """Fly a command for a step in the disturbances believed in."""
    believed_wrench(vehicle, belief, x, governed, command, u)
    believed_kinematics(vehicle, belief, nonlinear, x, u)


@kernel
def fly_kinematically(vehicle, x, governed, command, u, belief=None):
    """Fly a command for a step, by the linear model without the battery."""
    if belief is None:
        command_wrench(vehicle, x, governed, command, u)
        fly_kinematics(vehicle, x, u)
    else:
        _fly_as_believed(vehicle, belief, x, governed, command, False, u)


@kernel
def _tube_at(arena, i, k):
    """The tube of UAS i after k steps [m]; beyond the lookahead as wide as at its end."""
    return arena.tube_m[i, min(k, arena.tube_m.shape[1] - 1)]


@kernel
def _nears_fence(arena, i, path_m, k, enough_m):
    """Whether the k-th place of a path has less than enough to spare from the geofence, for sure.

    What is kept is no more than what `_fence_slack` keeps, so that this is never said in error.
    """
    rules = arena.rules[0]
    normals, offsets_m = arena.normals, arena.offsets_m
    for h in range(rules.fence_first, rules.fence_last):
        spare_m = -signed_distance(
            normals, offsets_m, h, h + 1, path_m[k, 0], path_m[k, 1], path_m[k, 2]
        )
        at_least = max(abs(normals[h, 0]), abs(normals[h, 1]))
        kept_m = rules.fence_margin_m + at_least * _tube_at(arena, i, k)
        if spare_m - kept_m < enough_m - _SURELY_M:
            now_m = -signed_distance(
                normals, offsets_m, h, h + 1, path_m[0, 0], path_m[0, 1], path_m[0, 2]
            )
            if spare_m - _kept_m(kept_m, now_m) < enough_m - _SURELY_M:
                return True
    return False


@rare_kernel
def fly_and_brake(
    arena, i, start, reference, command, nonlinear, path_m, belief=None, n_held=1,
    enough_m=-math.inf,
):  # fmt: skip
    """Simulate a command for one step, or n_held, then braking until the UAS stands.

    The simulation is the inner loop and the dynamics that the world flies. So where a command was
    found safe, its braking flight is still there to be flown in the next step: from a safe state
    there is always a safe command (against what stands still).

    Nothing but `path_m` is written; after a stop the position stays. `enough_m`: the flight is
    given up where `fixed_slack` is less than this for sure, by the geofence.

    Returns:
        (steps until it stands, slack [m]): the slack is PLENTY_M, but negative where the UAS has
        not come to rest at the end of the path, and -inf where the flight was given up.
    """
    n_steps = path_m.shape[0] - 1
    vehicle = arena.vehicles[i]
    x = stack_array(N_STATES)
    governed = stack_array(2)
    u = stack_array(N_INPUTS)
    for k in range(N_STATES):
        x[k] = start[k]
    for k in range(2):
        governed[k] = reference[k]
    for k in range(N_INPUTS):
        u[k] = 0.0
    for axis in range(3):
        path_m[0, axis] = x[S.X + axis]
    roll_rad, pitch_rad = 0.0, 0.0
    if belief is not None and arena.rules[0].disturbed:
        # a hover leans into the wind
        roll_rad = -vehicle.trim_rad_per_mps * belief[WIND + 1]
        pitch_rad = vehicle.trim_rad_per_mps * belief[WIND]
    for k in range(n_steps):
        # one call: what is flown becomes part of this function
        flown = command if k < n_held else arena.rules[0].brake
        if belief is not None and arena.rules[0].disturbed:
            _fly_as_believed(vehicle, belief, x, governed, flown, nonlinear, u)
        else:
            command_wrench(vehicle, x, governed, flown, u)
            if nonlinear:
                plant_step(vehicle, x, u, x)
            else:
                fly_kinematics(vehicle, x, u)
        if k < n_held and command.kind == WRENCH:
            reseed_reference(vehicle, x, governed)
        for axis in range(3):
            path_m[k + 1, axis] = x[S.X + axis]
        if enough_m > -math.inf and _nears_fence(arena, i, path_m, k + 1, enough_m):
            return k + 1, -math.inf
        if k + 1 >= n_held and _is_still(x, roll_rad, pitch_rad):
            for later in range(k + 2, n_steps + 1):
                for axis in range(3):
                    path_m[later, axis] = x[S.X + axis]
            return k + 1, PLENTY_M
    speed_mps = math.sqrt(x[S.VX] * x[S.VX] + x[S.VY] * x[S.VY] + x[S.VZ] * x[S.VZ])
    return n_steps, min(PLENTY_M, _CREEPING_MPS - speed_mps)


@kernel
def _box_of(path_m, n_flown, low, high):
    """Bounds of the first n_flown segments of a path."""
    for axis in range(3):
        low[axis] = path_m[0, axis]
        high[axis] = path_m[0, axis]
        for k in range(1, n_flown + 1):
            low[axis] = min(low[axis], path_m[k, axis])
            high[axis] = max(high[axis], path_m[k, axis])


@kernel
def _fence_slack(arena, i, path_m, n_flown, low, high, slack_m):
    """The smaller of slack_m and the distance to spare from the geofence along a path."""
    rules = arena.rules[0]
    normals = arena.normals
    offsets_m = arena.offsets_m
    required_m = rules.fence_margin_m
    for h in range(rules.fence_first, rules.fence_last):
        outermost = offsets_m[h]
        for axis in range(3):
            outermost += max(normals[h, axis] * low[axis], normals[h, axis] * high[axis])
        if -outermost - required_m - _tube_at(arena, i, n_flown) - _SURELY_M >= slack_m:
            # the whole box around the path is far enough from this face
            continue
        # disturbances move a UAS horizontally
        level = math.hypot(normals[h, 0], normals[h, 1])
        for k in range(1, n_flown + 1):
            spare_m = -signed_distance(
                normals, offsets_m, h, h + 1, path_m[k, 0], path_m[k, 1], path_m[k, 2]
            )
            kept_m = required_m + level * _tube_at(arena, i, k)
            if spare_m - kept_m < slack_m:
                now_m = -signed_distance(
                    normals, offsets_m, h, h + 1, path_m[0, 0], path_m[0, 1], path_m[0, 2]
                )
                slack_m = min(slack_m, spare_m - _kept_m(kept_m, now_m))
    return slack_m


@kernel
def _height_slack(arena, i, path_m, n_flown, slack_m):
    """The smaller of slack_m and the height to spare along a path, roofs not counted."""
    required_m = arena.rules[0].min_height_m
    if not in_landing_zone(arena, i, path_m[0, 0], path_m[0, 1]):
        required_m = _kept_m(required_m, -path_m[0, 2])
    for k in range(1, n_flown + 1):
        if not in_landing_zone(arena, i, path_m[k, 0], path_m[k, 1]):
            slack_m = min(slack_m, -path_m[k, 2] - required_m)
    return slack_m


@rare_kernel
def fixed_slack(arena, i, path_m, n_flown, enough_m, slack_m):
    """Least distance to spare from geofence, fixed obstacles and least height along a path.

    `enough_m`: where the slack is below this, nothing more is looked at. `slack_m`: what is known
    so far; `n_flown`: in so many segments the UAS moves.

    Returns:
        The smaller of slack_m and the distance to spare [m]: beyond the tube, which grows along the
        path, since disturbances lead off the more the longer they last.
    """
    low = stack_array(3)
    high = stack_array(3)
    _box_of(path_m, n_flown, low, high)
    slack_m = _fence_slack(arena, i, path_m, n_flown, low, high, slack_m)
    if arena.rules[0].min_height_m > 0.0:
        slack_m = _height_slack(arena, i, path_m, n_flown, slack_m)
    normals = arena.normals
    offsets_m = arena.offsets_m
    for o in range(arena.obstacles.shape[0]):
        obstacle = arena.obstacles[o]
        if box_apart(obstacle, low[0], low[1], low[2], high[0], high[1], high[2]):
            continue
        first = obstacle.first_kept
        last = obstacle.last_kept
        least_m = arena.uas[i].radius_m + obstacle.safe_distance_m
        for k in range(n_flown):
            required_m = least_m + _tube_at(arena, i, k + 1)
            x0 = path_m[k, 0]
            y0 = path_m[k, 1]
            z0 = path_m[k, 2]
            x1 = path_m[k + 1, 0]
            y1 = path_m[k + 1, 1]
            z1 = path_m[k + 1, 2]
            bound = face_between(normals, offsets_m, first, last, x0, y0, z0, x1, y1, z1)
            if bound - required_m >= slack_m:
                continue
            clearance = segment_clearance(normals, offsets_m, first, last, x0, y0, z0, x1, y1, z1)
            if clearance - required_m < slack_m:
                now_m = signed_distance(
                    normals, offsets_m, first, last, path_m[0, 0], path_m[0, 1], path_m[0, 2]
                )
                slack_m = min(slack_m, clearance - _kept_m(required_m, now_m))
                if slack_m < enough_m:
                    return slack_m
    return slack_m


@kernel
def required_from(arena, step, i, m):
    """The clearance that UAS i keeps from moving obstacle m [m]: more, the faster that moves."""
    velocity_mps = arena.moving_velocity_mps[step, m]
    north_mps, east_mps, down_mps = velocity_mps[0], velocity_mps[1], velocity_mps[2]
    speed_mps = math.sqrt(north_mps * north_mps + east_mps * east_mps + down_mps * down_mps)
    required_m = arena.uas[i].radius_m + arena.moving[m].safe_distance_m
    return required_m + SURPRISE_S * min(arena.uas[i].time_scale, 1.0) * speed_mps


@kernel
def _slack_beside(
    obstacle, centre_m, velocity_mps, dt_s, path_m, n_steps, required_m, enough_m, slack_m
):  # fmt: skip
    """Least distance to spare from what moves at one velocity, in the first steps of a path [m]."""
    vx, vy, vz = velocity_mps[0] * dt_s, velocity_mps[1] * dt_s, velocity_mps[2] * dt_s
    for k in range(n_steps):
        clearance = cylinder_clearance(
            obstacle.radius_m,
            obstacle.half_height_m,
            path_m[k, 0] - centre_m[0] - k * vx,
            path_m[k, 1] - centre_m[1] - k * vy,
            path_m[k, 2] - centre_m[2] - k * vz,
            path_m[k + 1, 0] - centre_m[0] - (k + 1) * vx,
            path_m[k + 1, 1] - centre_m[1] - (k + 1) * vy,
            path_m[k + 1, 2] - centre_m[2] - (k + 1) * vz,
        )
        slack_m = min(slack_m, clearance - required_m)
        if slack_m < enough_m:
            return slack_m
    return slack_m


@rare_kernel
def moving_slack(arena, step, i, path_m, enough_m, slack_m):
    """Least distance to spare from moving obstacles that keep their present velocities.

    What moves may also turn without warning: see `required_from`. In the plane, where nothing can
    be flown over and walls are near, it may also go back the way it came, from now on: no UAS goes
    behind it that could not get away in time.

    Returns:
        The smaller of slack_m and the distance to spare [m].
    """
    dt_s = arena.rules[0].dt_s
    step = min(step, arena.moving_path_m.shape[0] - 1)
    centre_m = arena.moving_path_m[step]
    velocity_mps = arena.moving_velocity_mps[step]
    in_plane = arena.rules[0].floor_m == arena.rules[0].ceiling_m
    for m in range(arena.moving.shape[0]):
        obstacle = arena.moving[m]
        required_m = required_from(arena, step, i, m)
        now_m = moving_clearance(
            arena.moving, centre_m, centre_m, m,
            path_m[0, 0], path_m[0, 1], path_m[0, 2], path_m[0, 0], path_m[0, 1], path_m[0, 2],
        )  # fmt: skip
        required_m = _kept_m(required_m, now_m)
        n_steps = path_m.shape[0] - 1
        slack_m = _slack_beside(
            obstacle, centre_m[m], velocity_mps[m], dt_s, path_m, n_steps,
            required_m, enough_m, slack_m,
        )  # fmt: skip
        if slack_m >= enough_m and in_plane:
            n_back = min(n_steps, round(TURN_S * min(arena.uas[i].time_scale, 1.0) / dt_s))
            slack_m = _slack_beside(
                obstacle, centre_m[m], velocity_mps[m], -dt_s, path_m, n_back,
                required_m, enough_m, slack_m,
            )  # fmt: skip
        if slack_m < enough_m:
            return slack_m
    return slack_m


@kernel
def _paths_apart(path_m, other_m, k, keep_m):
    """Whether two paths are farther apart than keep_m in step k by a look at north and east."""
    for axis in range(2):
        a0 = path_m[k, axis]
        a1 = path_m[k + 1, axis]
        b0 = other_m[k, axis]
        b1 = other_m[k + 1, axis]
        if min(a0, a1) - max(b0, b1) > keep_m or min(b0, b1) - max(a0, a1) > keep_m:
            return True
    return False


@kernel
def separation_at(path_m, other_m, k):
    """Smallest separation [m] of two UAS on paths (S + 1, 3) between samples k and k + 1."""
    return cylinder_clearance(
        0.0,
        0.0,
        path_m[k, 0] - other_m[k, 0],
        path_m[k, 1] - other_m[k, 1],
        path_m[k, 2] - other_m[k, 2],
        path_m[k + 1, 0] - other_m[k + 1, 0],
        path_m[k + 1, 1] - other_m[k + 1, 1],
        path_m[k + 1, 2] - other_m[k + 1, 2],
    )


@rare_kernel
def peer_slack(arena, uas, i, path_m, committed_m, enough_m, slack_m):
    """Least distance to spare from the paths to which the other UAS are committed.

    Returns:
        The smaller of slack_m and the distance to spare [m].
    """
    tube_m = arena.tube_m
    for j in range(uas.shape[0]):
        if j == i or uas[j].status != FLYING:
            continue
        other_m = committed_m[j]
        least_m = arena.uas[i].radius_m + arena.uas[j].radius_m + arena.rules[0].uas_safe_distance_m
        now_m = max(
            math.hypot(path_m[0, 0] - other_m[0, 0], path_m[0, 1] - other_m[0, 1]),
            abs(path_m[0, 2] - other_m[0, 2]),
        )
        for k in range(path_m.shape[0] - 1):
            required_m = _kept_m(least_m + _tube_at(arena, i, k + 1) + tube_m[j, k + 1], now_m)
            if _paths_apart(path_m, other_m, k, required_m + max(slack_m, 0.0)):
                continue
            apart_m = separation_at(path_m, other_m, k)
            slack_m = min(slack_m, apart_m - required_m)
            if slack_m < enough_m:
                return slack_m
    return slack_m


@kernel
def braking_slack(
    arena, state, i, command, nonlinear, enough_m, path_m, committed_m, moving=True, in_doubt=False
):  # fmt: skip
    """Least distance to spare when a command is flown and then braked [m].

    From all that stands still or brakes, and if `moving` from what moves, too. `in_doubt`: where
    most such commands have less than enough to spare, the flight is given up as soon as that is
    sure, and `path_m` is its beginning; the answer is less than enough all the same.
    """
    n_flown, slack_m = fly_and_brake(
        arena,
        i,
        state.x[i],
        state.uas[i].reference_mps[:],
        command,
        nonlinear,
        path_m,
        state.uas[i].belief[:],
        1,
        enough_m if in_doubt else -math.inf,
    )
    if slack_m >= enough_m:
        slack_m = fixed_slack(arena, i, path_m, n_flown, enough_m, slack_m)
    if moving and slack_m >= enough_m:
        slack_m = moving_slack(arena, state.step[0], i, path_m, enough_m, slack_m)
    if slack_m >= enough_m:
        slack_m = peer_slack(arena, state.uas, i, path_m, committed_m, enough_m, slack_m)
    return slack_m
