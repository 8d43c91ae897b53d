"""What a UAS touches, or comes too near to, on the straight way from sample to sample."""

import math

from uas_coverage_env.compiled.kernels import inlined_kernel, kernel, rare_kernel, stack_array
from uas_coverage_env.compiled.views import rows_view
from uas_coverage_env.entities.commands import WRENCH
from uas_coverage_env.entities.outcome import (
    BATTERY,
    BREACH_TOLERANCE_M,
    FENCE,
    LIMITS,
    MOVING_OBSTACLE,
    NONE,
    OBSTACLE,
    UAS,
)
from uas_coverage_env.entities.state import FLYING
from uas_coverage_env.geometry.segments import (
    cylinder_clearance,
    cylinder_gap,
    outside_cylinder,
    segment_clearance,
    signed_distance,
)
from uas_coverage_env.vehicle.layout import DOD, X, Y, Z
from uas_coverage_env.vehicle.limits import is_out_of_control, limits_exceeded
from uas_coverage_env.world.broad_phase import (
    BLOCK,
    EPS_M,
    MEASURED,
    write_lower_bounds,
    write_meetings,
)
from uas_coverage_env.world.height import is_too_low
from uas_coverage_env.world.routes import box_apart


@kernel
def face_between(normals, offsets_m, first, last, x0, y0, z0, x1, y1, z1):
    """A lower bound of the clearance of a segment: the face that both ends are farthest from."""
    faces = rows_view(normals, first, (last - first, 3))
    away_m = rows_view(offsets_m, first, last - first)
    largest = -math.inf
    for h in range(away_m.shape[0]):
        n0 = faces[h, 0]
        n1 = faces[h, 1]
        n2 = faces[h, 2]
        d0 = n0 * x0 + n1 * y0 + n2 * z0
        d1 = n0 * x1 + n1 * y1 + n2 * z1
        largest = max(largest, min(d0, d1) + away_m[h])
    return largest


@inlined_kernel
def _likely_nearest(columns, x0, y0, z0, x1, y1, z1):
    """The obstacle with the least lower bound."""
    bound_m = stack_array(BLOCK)
    likely = 0
    least_m = math.inf
    for first in range(0, columns.shape[1], BLOCK):
        n = min(BLOCK, columns.shape[1] - first)
        write_lower_bounds(columns, first, n, x0, y0, z0, x1, y1, z1, bound_m)
        for o in range(n):
            if bound_m[o] < least_m:
                least_m = bound_m[o]
                likely = first + o
    return likely


@inlined_kernel
def _may_be_measured(columns, x0, y0, z0, x1, y1, z1):
    """Whether a segment comes near enough to an obstacle for the distance to matter."""
    meets = stack_array(BLOCK)
    n_met = 0
    for first in range(0, columns.shape[1], BLOCK):
        n = min(BLOCK, columns.shape[1] - first)
        write_meetings(columns, MEASURED, first, n, x0, y0, z0, x1, y1, z1, meets)
        for o in range(n):
            n_met += meets[o] > 0.0
    return n_met > 0


@inlined_kernel
def obstacle_clearance(arena, x0, y0, z0, x1, y1, z1):
    """Smallest clearance of a segment from the fixed obstacles, exact up to `rules.measured_m`.

    The likely nearest comes first: most others cannot be as near as that.

    Returns:
        (clearance [m], index of the obstacle); (inf, -1) where there is none so near.
    """
    obstacles = arena.obstacles
    columns = arena.obstacle_columns
    normals = arena.normals
    offsets_m = arena.offsets_m
    n_obstacles = obstacles.shape[0]
    if not _may_be_measured(columns, x0, y0, z0, x1, y1, z1):
        return math.inf, -1
    nearest = _likely_nearest(columns, x0, y0, z0, x1, y1, z1)
    smallest = segment_clearance(
        normals, offsets_m, obstacles[nearest].first_face, obstacles[nearest].last_face,
        x0, y0, z0, x1, y1, z1,
    )  # fmt: skip
    measured_m = arena.rules[0].measured_m
    smallest = min(smallest, measured_m)
    likely = nearest
    bound_m = stack_array(BLOCK)
    for begin in range(0, n_obstacles, BLOCK):
        n = min(BLOCK, columns.shape[1] - begin)
        write_lower_bounds(columns, begin, n, x0, y0, z0, x1, y1, z1, bound_m)
        for b in range(min(n, n_obstacles - begin)):
            o = begin + b
            if o == likely or bound_m[b] > smallest:
                continue
            first = obstacles[o].first_face
            last = obstacles[o].last_face
            if face_between(normals, offsets_m, first, last, x0, y0, z0, x1, y1, z1) > smallest:
                continue
            clearance = segment_clearance(normals, offsets_m, first, last, x0, y0, z0, x1, y1, z1)
            if clearance < smallest or (clearance == smallest and o < nearest):
                smallest = clearance
                nearest = o
    if smallest >= measured_m:
        return math.inf, -1
    return smallest, nearest


@rare_kernel
def _solid_clearance(arena, x0, y0, z0, x1, y1, z1):
    """`obstacle_clearance` without the no-fly zones: what can be touched; rarely asked for."""
    smallest = math.inf
    nearest = -1
    for o in range(arena.obstacles.shape[0]):
        obstacle = arena.obstacles[o]
        if obstacle.no_fly_zone:
            continue
        clearance = segment_clearance(
            arena.normals, arena.offsets_m, obstacle.first_face, obstacle.last_face,
            x0, y0, z0, x1, y1, z1,
        )  # fmt: skip
        if clearance < smallest:
            smallest = clearance
            nearest = o
    return smallest, nearest


@kernel
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


@inlined_kernel
def _separation(before_m, other_before_m, after, other_after, measured_m):
    """Smallest separation of two UAS, each going straight from before (3,) to after (14,).

    Infinite beyond measured_m.
    """
    x0 = before_m[0] - other_before_m[0]
    y0 = before_m[1] - other_before_m[1]
    z0 = before_m[2] - other_before_m[2]
    x1 = after[X] - other_after[X]
    y1 = after[Y] - other_after[Y]
    z1 = after[Z] - other_after[Z]
    if cylinder_gap(0.0, 0.0, x0, y0, z0, x1, y1, z1) > measured_m:
        return math.inf
    apart_m = cylinder_clearance(0.0, 0.0, x0, y0, z0, x1, y1, z1)
    return apart_m if apart_m < measured_m else math.inf


@inlined_kernel
def _record_contact(event, contact, index):
    """Note what a UAS was lost to; of several contacts in a step, the first code counts."""
    if event.contact == NONE:
        event.contact = contact
        event.contact_with = index


@inlined_kernel
def check_obstacles_of(arena, state, i, outcome):
    """Clearances of a UAS from fixed and moving obstacles over the step, and contacts with them."""
    if state.uas[i].status != FLYING:
        return
    step = min(state.step[0], arena.moving_path_m.shape[0] - 2)
    now_m = arena.moving_path_m[step]
    next_m = arena.moving_path_m[step + 1]
    rules = arena.rules[0]
    event = outcome[i]
    x0 = event.before_m[0]
    y0 = event.before_m[1]
    z0 = event.before_m[2]
    x1 = state.x[i, X]
    y1 = state.x[i, Y]
    z1 = state.x[i, Z]
    smallest, nearest = obstacle_clearance(arena, x0, y0, z0, x1, y1, z1)
    radius_m = arena.uas[i].radius_m
    if smallest < radius_m:
        if arena.obstacles[nearest].no_fly_zone:
            near_m, nearest = _solid_clearance(arena, x0, y0, z0, x1, y1, z1)
        else:
            near_m = smallest
        if near_m < radius_m:
            _record_contact(event, OBSTACLE, nearest)
    for m in range(arena.moving.shape[0]):
        moving = arena.moving[m]
        gap_m = cylinder_gap(
            moving.radius_m,
            moving.half_height_m,
            x0 - now_m[m, 0],
            y0 - now_m[m, 1],
            z0 - now_m[m, 2],
            x1 - next_m[m, 0],
            y1 - next_m[m, 1],
            z1 - next_m[m, 2],
        )
        if gap_m > smallest or gap_m > rules.measured_m:
            # farther than something else; no contact either, or there is one already
            continue
        clearance = moving_clearance(arena.moving, now_m, next_m, m, x0, y0, z0, x1, y1, z1)
        if clearance < radius_m:
            _record_contact(event, MOVING_OBSTACLE, m)
        if clearance < rules.measured_m:
            smallest = min(smallest, clearance)
    event.obstacle_clearance_m = smallest


@inlined_kernel
def check_obstacles(arena, state, outcome):
    """`check_obstacles_of` all UAS."""
    for i in range(state.uas.shape[0]):
        check_obstacles_of(arena, state, i, outcome)


@inlined_kernel
def check_separation(arena, state, outcome):
    """Separations between flying UAS over the step, and contacts: both are lost."""
    n_uas = state.uas.shape[0]
    measured_m = arena.rules[0].measured_m
    for i in range(n_uas):
        if state.uas[i].status != FLYING:
            continue
        for j in range(i + 1, n_uas):
            if state.uas[j].status != FLYING:
                continue
            apart_m = _separation(
                outcome[i].before_m, outcome[j].before_m, state.x[i], state.x[j], measured_m
            )
            outcome[i].separation_m = min(outcome[i].separation_m, apart_m)
            outcome[j].separation_m = min(outcome[j].separation_m, apart_m)
            if apart_m < arena.uas[i].radius_m + arena.uas[j].radius_m:
                _record_contact(outcome[i], UAS, j)
                _record_contact(outcome[j], UAS, i)


@inlined_kernel
def check_fence_and_battery(arena, state, outcome):
    """Contacts with the geofence and the end of the battery.

    The fence is convex: a segment that starts inside leaves it only if its end lies outside.
    """
    rules = arena.rules[0]
    for i in range(state.uas.shape[0]):
        if state.uas[i].status != FLYING:
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
        outcome[i].fence_clearance_m = -outside_m
        if outside_m > 0.0:
            _record_contact(outcome[i], FENCE, -1)
        if state.x[i, DOD] > arena.uas[i].dod_empty:
            _record_contact(outcome[i], BATTERY, -1)


@inlined_kernel
def flew_judged_wrench(arena, event):
    """Whether a step was flown by a wrench that has to keep the vehicle within its limits.

    Not so where an assistant or an event flew another command instead.
    """
    return arena.rules[0].judges_wrenches and event.applied_command.kind == WRENCH


@rare_kernel
def check_wrenches(arena, state, outcome):
    """Lose the UAS that their wrenches have taken out of control, see `vehicle.LOST_BEYOND`."""
    for i in range(state.uas.shape[0]):
        judged = state.uas[i].status == FLYING and flew_judged_wrench(arena, outcome[i])
        if judged and is_out_of_control(arena.vehicles[i], state.x[i]):
            _record_contact(outcome[i], LIMITS, -1)


@rare_kernel
def obstacle_breaches(arena, next_m, i, x, y, z):
    """How many fixed and moving obstacles, at next_m (M, 3), UAS i is too near to."""
    count = 0
    radius_m = arena.uas[i].radius_m
    for o in range(arena.obstacles.shape[0]):
        obstacle = arena.obstacles[o]
        if not box_apart(obstacle, x, y, z, x, y, z):
            clearance = signed_distance(
                arena.normals, arena.offsets_m, obstacle.first_face, obstacle.last_face, x, y, z
            )
            if clearance < radius_m + obstacle.safe_distance_m - BREACH_TOLERANCE_M:
                count += 1
    for m in range(arena.moving.shape[0]):
        moving = arena.moving[m]
        clearance = outside_cylinder(
            moving.radius_m,
            moving.half_height_m,
            x - next_m[m, 0],
            y - next_m[m, 1],
            z - next_m[m, 2],
        )
        if clearance < radius_m + moving.safe_distance_m - BREACH_TOLERANCE_M:
            count += 1
    return count


@inlined_kernel
def count_breaches(arena, state, outcome):
    """Count, at the new sample, what each UAS that is still whole is too near to."""
    rules = arena.rules[0]
    step = min(state.step[0] + 1, arena.moving_path_m.shape[0] - 1)
    next_m = arena.moving_path_m[step]
    for i in range(state.uas.shape[0]):
        event = outcome[i]
        if state.uas[i].status != FLYING or event.contact != NONE:
            continue
        x = state.x[i, X]
        y = state.x[i, Y]
        z = state.x[i, Z]
        radius_m = arena.uas[i].radius_m
        count = 0
        # at the end of the segment nothing is nearer than it was somewhere on it; the same below
        if event.obstacle_clearance_m < radius_m + rules.safe_distance_max_m + EPS_M:
            count = obstacle_breaches(arena, next_m, i, x, y, z)
        for j in range(state.uas.shape[0]):
            keep_m = radius_m + arena.uas[j].radius_m + rules.uas_safe_distance_m
            if event.separation_m > keep_m + EPS_M:
                continue
            if j != i and state.uas[j].status == FLYING and outcome[j].contact == NONE:
                other = state.x[j]
                apart_m = outside_cylinder(0.0, 0.0, x - other[X], y - other[Y], z - other[Z])
                if apart_m < keep_m - BREACH_TOLERANCE_M:
                    count += 1
        if event.fence_clearance_m < rules.fence_margin_m - BREACH_TOLERANCE_M:
            count += 1
        if rules.min_height_m > 0.0 and is_too_low(arena, i, x, y, z):
            event.too_low = True
            count += 1
        event.breaches = count


@inlined_kernel
def check_limits(arena, state, nonlinear, outcome):
    """Note which of the vehicle's limits each UAS that flew exceeds; one that has landed rests."""
    for i in range(state.uas.shape[0]):
        event = outcome[i]
        if event.flew:
            event.limits_exceeded = limits_exceeded(
                arena.vehicles[i], state.x[i], event.voltage_V, event.current_A, nonlinear,
                arena.rules[0].disturbed or arena.rules[0].eventful,
            )  # fmt: skip
