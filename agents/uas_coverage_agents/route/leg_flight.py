"""Flying along a route without stopping: which velocity next, past the coming spheres.

Velocities in several directions and speeds are simulated with the vehicle's own inner loop until
the next waypoint is covered, at most for `HORIZON` steps: held all the way, and, of the best, held
for a step or two and then changed once, since a flight that turns at a waypoint begins to turn
before it. A network says how long the two waypoints after it take from the state reached; what is
quickest is flown, for one step. So nothing that the network gets wrong misses a waypoint.
"""

import math

import numpy as np

from uas_coverage_agents.route.landing import towards_home
from uas_coverage_agents.route.layers import value_of
from uas_coverage_env.autopilot.control import command_wrench, write_command
from uas_coverage_env.autopilot.guidance import HEADROOM_M, LEAD_S, passes_over
from uas_coverage_env.autopilot.lookahead import fixed_slack, fly_and_brake
from uas_coverage_env.compiled.kernels import allocating_kernel
from uas_coverage_env.entities.commands import VELOCITY
from uas_coverage_env.vehicle import layout as S
from uas_coverage_env.vehicle.lpv import fly_kinematics
from uas_coverage_env.world.height import lowest_altitude
from uas_coverage_env.world.routes import NO_WAY, ROUND_CORNER, crossing, route

(
    WAY, FIRST_RADIUS, ALONG, ACROSS, TILT_ALONG, TILT_ACROSS, LOOP_ALONG, LOOP_ACROSS,
    SECOND_ALONG, SECOND_ACROSS, SECOND_RADIUS, THIRD_ALONG, THIRD_ACROSS, THIRD_RADIUS,
    FIRST_DOWN, SECOND_DOWN, DESCENT, FIRST_IS_HOME, SECOND_IS_HOME, THIRD_IS_HOME, WAY_ON,
) = range(21)  # fmt: skip
"""Columns of what the network reads; `layout` says what they mean."""

N_FLIGHT = WAY_ON + 1
"""Numbers that the network reads about a state and the next three places."""

HORIZON = 12
_LATER_STEPS = 2  # than the soonest visit so far, and a velocity comes after all others
_TOO_LATE_S = 100.0
_CHANGED = 8  # velocities, the best if held, that are changed
_CHANGED_AFTER = 2  # steps at most
_EVERY = 11  # of the velocities is one that they are changed to
AHEAD = 4
"""Places ahead that matter: three are looked at after the first is covered."""

_LAST = AHEAD - 1

NORTH, EAST, DOWN, RADIUS, IS_HOME = range(5)
"""Columns of the places ahead."""

_SPEEDS = np.array([1.0, 0.75, 0.5, 0.25, 0.05])
_TURNS_BACK, _TURNS_ON = 5, 11
N_VELOCITIES = (_TURNS_BACK + _TURNS_ON) * len(_SPEEDS)

_LENGTH_M, _SPEED_MPS, _TILT_RAD, _CLIMB_MPS, _RADIUS_M, _RISE_M = 50.0, 12.0, 0.44, 3.0, 15.0, 10.0
CORNER_M = 4.0
_WITHIN_M = 0.15
_TRIED = 16
MOST_HELD = 4
"""Steps for which a command is held at most before braking is simulated."""


@allocating_kernel
def aim_ahead(vehicle, x, ahead, aims_m):
    """Where the coming spheres are touched on a short way: (AHEAD, 3), by coordinate descent."""
    n = ahead.shape[0]
    for k in range(n):
        aims_m[k] = ahead[k, :3]
    for _ in range(4):
        for k in range(n - 1):
            if ahead[k, IS_HOME] > 0.0:
                break
            at, following = ahead[k], aims_m[k + 1]
            bx, by, bz = x[S.X], x[S.Y], x[S.Z]
            if k > 0:
                bx, by, bz = aims_m[k - 1, 0], aims_m[k - 1, 1], aims_m[k - 1, 2]
            off_m = 0.5 * at[RADIUS]
            # its own height, where climb and descent are quick enough
            before_s = math.hypot(at[NORTH] - bx, at[EAST] - by) / vehicle.v_xy_max_mps
            after_s = math.hypot(at[NORTH] - following[0], at[EAST] - following[1])
            after_s /= vehicle.v_xy_max_mps
            up, down = vehicle.v_up_max_mps, vehicle.v_down_max_mps
            z = min(max(at[DOWN], bz - up * before_s), bz + down * before_s)
            z = min(max(z, following[2] - down * after_s), following[2] + up * after_s)
            dz = min(max(z - at[DOWN], -off_m), off_m)
            radius_m = 0.97 * math.sqrt(at[RADIUS] ** 2 - dz * dz)
            radius_m = max(radius_m - 2.0 * _WITHIN_M, 0.5 * radius_m)
            dx, dy = following[0] - bx, following[1] - by
            share = (at[NORTH] - bx) * dx + (at[EAST] - by) * dy
            share = min(max(share / (dx * dx + dy * dy + 1e-9), 0.0), 1.0)
            qx, qy = bx + share * dx - at[NORTH], by + share * dy - at[EAST]
            away_m = math.hypot(qx, qy)
            if away_m > radius_m:
                qx *= radius_m / away_m
                qy *= radius_m / away_m
            aims_m[k, 0], aims_m[k, 1], aims_m[k, 2] = at[NORTH] + qx, at[EAST] + qy, at[DOWN] + dz


@allocating_kernel
def observe_places(x, reference, speed_mps, first, second, third, row):
    """Write what the network reads of a state and the next three places.

    Everything is told along and across the direction of the first place; the second lies on the
    positive side, so that nothing depends on where north or the left is.

    Returns:
        Time [s] straight along the places at full speed, which the network's output is added to.
    """
    dx, dy = first[NORTH] - x[S.X], first[EAST] - x[S.Y]
    way_m = math.hypot(dx, dy)
    ex, ey = 1.0, 0.0
    if way_m > 1e-3:
        ex, ey = dx / way_m, dy / way_m
    ax, ay = second[NORTH] - first[NORTH], second[EAST] - first[EAST]
    bx, by = third[NORTH] - second[NORTH], third[EAST] - second[EAST]
    side = 1.0 if ex * ay - ey * ax >= 0.0 else -1.0
    px, py = -side * ey, side * ex
    row[WAY] = way_m / _LENGTH_M
    row[FIRST_RADIUS] = first[RADIUS] / _RADIUS_M
    row[ALONG] = (x[S.VX] * ex + x[S.VY] * ey) / _SPEED_MPS
    row[ACROSS] = (x[S.VX] * px + x[S.VY] * py) / _SPEED_MPS
    row[TILT_ALONG] = (-x[S.THETA] * ex + x[S.PHI] * ey) / _TILT_RAD
    row[TILT_ACROSS] = (-x[S.THETA] * px + x[S.PHI] * py) / _TILT_RAD
    row[LOOP_ALONG] = (reference[0] * ex + reference[1] * ey) / _SPEED_MPS
    row[LOOP_ACROSS] = (reference[0] * px + reference[1] * py) / _SPEED_MPS
    row[SECOND_ALONG] = (ax * ex + ay * ey) / _LENGTH_M
    row[SECOND_ACROSS] = (ax * px + ay * py) / _LENGTH_M
    row[SECOND_RADIUS] = second[RADIUS] / _RADIUS_M
    row[THIRD_ALONG] = (bx * ex + by * ey) / _LENGTH_M
    row[THIRD_ACROSS] = (bx * px + by * py) / _LENGTH_M
    row[THIRD_RADIUS] = third[RADIUS] / _RADIUS_M
    row[FIRST_DOWN] = (first[DOWN] - x[S.Z]) / _RISE_M
    row[SECOND_DOWN] = (second[DOWN] - first[DOWN]) / _RISE_M
    row[DESCENT] = x[S.VZ] / _CLIMB_MPS
    row[FIRST_IS_HOME] = first[IS_HOME]
    row[SECOND_IS_HOME] = second[IS_HOME]
    row[THIRD_IS_HOME] = third[IS_HOME]
    row[WAY_ON] = math.hypot(ax, ay) / _LENGTH_M
    for f in range(N_FLIGHT):
        row[f] = min(max(row[f], -3.0), 3.0)
    return (way_m + math.hypot(ax, ay) + math.hypot(bx, by)) / speed_mps


@allocating_kernel
def weigh(vehicle, speed_mps, x, reference, ahead, layers, aims_m, commands, costs, command):
    """Simulate the velocities that may be flown next: held, and changed once.

    Args:
        vehicle: Record of VEHICLE_DTYPE.
        speed_mps: Its top speed.
        x: (14,) state.
        reference: (2,) [m/s] of the inner loop.
        ahead: (AHEAD, 5) places to come, home repeated at the end; the first is no home.
        layers: `Layers`.
        aims_m: (AHEAD, 3) written.
        commands: (N_VELOCITIES, 3) written: velocity north and east [m/s], altitude [m].
        costs: (N_VELOCITIES,) written: time to the end of the places ahead [s].
        command: A record of COMMAND_DTYPE; written.
    """
    aim_ahead(vehicle, x, ahead, aims_m)
    to_first = math.atan2(aims_m[0, 1] - x[S.Y], aims_m[0, 0] - x[S.X])
    turn = math.atan2(aims_m[1, 1] - x[S.Y], aims_m[1, 0] - x[S.X]) - to_first
    turn = math.atan2(math.sin(turn), math.cos(turn))
    sign = 1.0 if turn > 0.0 else -1.0
    there, governed, u = np.zeros(S.N_STATES), np.zeros(2), np.zeros(S.N_INPUTS)
    row = np.empty(N_FLIGHT)
    n, most = 0, HORIZON
    for q in range(-_TURNS_BACK, _TURNS_ON):
        angle = to_first + (turn * q / 8.0 if q >= 0 else 0.15 * q * sign)
        for s in range(_SPEEDS.shape[0]):
            commands[n, 0] = _SPEEDS[s] * speed_mps * math.cos(angle)
            commands[n, 1] = _SPEEDS[s] * speed_mps * math.sin(angle)
            commands[n, 2] = -aims_m[0, 2]
            there[:] = x
            governed[:] = reference
            steps = _fly_on(vehicle, there, governed, commands[n], ahead[0], most, command, u)
            costs[n] = _cost_s(vehicle, speed_mps, there, governed, steps, ahead, layers, row)
            if steps < 0:
                most = min(most, _LATER_STEPS - steps)
            elif most < HORIZON:
                costs[n] += _TOO_LATE_S
            n += 1
    left = costs.copy()
    held, held_reference = np.zeros(S.N_STATES), np.zeros(2)
    for _ in range(_CHANGED):
        first = left.argmin()
        left[first] = np.inf
        held[:] = x
        held_reference[:] = reference
        for after in range(1, _CHANGED_AFTER + 1):
            if _fly_on(vehicle, held, held_reference, commands[first], ahead[0], 1, command, u) < 0:
                break
            for second in range(0, N_VELOCITIES, _EVERY):
                there[:] = held
                governed[:] = held_reference
                steps = _fly_on(
                    vehicle, there, governed, commands[second], ahead[0], most - after, command, u
                )
                if steps < 0:
                    cost_s = _cost_s(
                        vehicle, speed_mps, there, governed, steps - after, ahead, layers, row
                    )
                    costs[first] = min(costs[first], cost_s)


@allocating_kernel
def covers(x, at):
    """Whether a state covers a place, with something to spare."""
    within_m = max(0.985 * at[RADIUS] - _WITHIN_M, 0.5 * at[RADIUS])
    dx, dy, dz = x[S.X] - at[NORTH], x[S.Y] - at[EAST], x[S.Z] - at[DOWN]
    return dx * dx + dy * dy + dz * dz <= within_m * within_m


@allocating_kernel
def _fly_on(vehicle, x, reference, values, at, most_steps, command, u):
    """Fly a velocity until a place is covered, at most so long; steps, negative if it is."""
    steps = 0
    while steps < most_steps:
        write_command(command, VELOCITY, values[0], values[1], values[2])
        command_wrench(vehicle, x, reference, command, u)
        fly_kinematics(vehicle, x, u)
        steps += 1
        if covers(x, at):
            return -steps
    return steps


@allocating_kernel
def _cost_s(vehicle, speed_mps, x, reference, steps, ahead, layers, row):
    """Time [s] to the last of the places ahead, after so many steps (see `_fly_on`)."""
    if steps < 0:
        rest_s = observe_places(x, reference, speed_mps, ahead[1], ahead[2], ahead[_LAST], row)
    else:
        last, before = ahead[_LAST], ahead[_LAST - 1]
        beyond_m = math.hypot(last[NORTH] - before[NORTH], last[EAST] - before[EAST])
        rest_s = beyond_m / speed_mps
        rest_s += observe_places(x, reference, speed_mps, ahead[0], ahead[1], ahead[2], row)
    return abs(steps) * vehicle.dt_s + rest_s + value_of(layers, row)


@allocating_kernel
def spare_distance(arena, i, x, reference, command, n_held, enough_m, path_m, belief=None):
    """Distance to spare from what is fixed: a command held for some steps, then braking.

    Args:
        arena: The arena.
        i: Index of the UAS.
        x: (14,) its state.
        reference: (2,) [m/s] of its inner loop.
        command: A record of COMMAND_DTYPE.
        n_held: Steps for which it is held, at most `MOST_HELD`.
        enough_m: Stop looking when it is below this [m].
        path_m: (lookahead_steps + MOST_HELD, 3) written.
        belief: (N_BELIEF,) of its inner loop; None: in still air.

    Returns:
        See `fixed_slack`.
    """
    shown_m = path_m[: path_m.shape[0] - MOST_HELD + n_held]
    n_flown, slack_m = fly_and_brake(
        arena, i, x, reference, command, False, shown_m, belief, n_held
    )
    return fixed_slack(arena, i, path_m, n_flown, enough_m, slack_m)


@allocating_kernel
def _is_safe(arena, i, x, reference, command, n_held, least_m, path_m):
    """Whether a command held for some steps, and braking after it, leave distance to spare."""
    return spare_distance(arena, i, x, reference, command, n_held, least_m, path_m) >= least_m


@allocating_kernel
def over_roofs(arena, x, end_x, end_y, end_altitude_m, uas, leg):
    """Altitude [m] at which a leg passes over what is low; the speed that leaves time to climb."""
    altitude_m = -x[S.Z]
    length_m = math.hypot(end_x - x[S.X], end_y - x[S.Y])
    needed_m, speed_mps = -math.inf, uas.speed_mps
    for o in range(arena.obstacles.shape[0]):
        obstacle = arena.obstacles[o]
        at, over, ends = crossing(
            obstacle, arena.normals, arena.offsets_m, x[S.X], x[S.Y], end_x, end_y
        )
        if at > 1.0 or not passes_over(obstacle, over, ends, leg, max(altitude_m, end_altitude_m)):
            continue
        needed_m = max(needed_m, obstacle.roof_m + arena.rules[0].length_scale * HEADROOM_M)
        rise_m = obstacle.roof_m - altitude_m
        if rise_m > 0.0:
            speed_mps = min(
                speed_mps, at * length_m / (rise_m / uas.climb_mps + uas.time_scale * LEAD_S)
            )
    return needed_m, speed_mps


@allocating_kernel
def places_ahead(arena, i, x, targets, n_targets, ahead):
    """Write the next places of UAS i: a corner on the way past obstacles, waypoints, then home.

    Args:
        arena: The arena.
        i: Index of the UAS.
        x: (14,) its state.
        targets: (AHEAD,) the next waypoints of its route.
        n_targets: How many of them.
        ahead: (AHEAD, 5) written.

    Returns:
        Kind of the first leg (see `route`); altitude at which it passes over what is low [m]; the
        speed that leaves time to climb there [m/s].
    """
    target = targets[0] if n_targets > 0 else arena.waypoints.shape[0] + i
    to_m = arena.waypoints[targets[0]].position_m if n_targets > 0 else arena.uas[i].home_m
    end_x, end_y, _, leg = route(arena, target, x[S.X], x[S.Y], x[S.Z], to_m[0], to_m[1], to_m[2])
    needed_m, speed_mps = over_roofs(arena, x, end_x, end_y, -to_m[2], arena.uas[i], leg)
    ahead[:] = 0.0
    n = 0
    if leg == ROUND_CORNER:
        ahead[0, NORTH], ahead[0, EAST] = end_x, end_y
        ahead[0, DOWN] = min(to_m[2], x[S.Z]) if n_targets > 0 else x[S.Z]
        ahead[0, RADIUS] = CORNER_M
        n = 1
    for k in range(n, AHEAD):
        if k - n < n_targets:
            waypoint = arena.waypoints[targets[k - n]]
            ahead[k, :3] = waypoint.position_m
            ahead[k, RADIUS] = waypoint.radius_m
        else:
            ahead[k, :3] = arena.uas[i].home_m
            ahead[k, IS_HOME] = 1.0
    return leg, needed_m, speed_mps


@allocating_kernel
def steer_along(
    arena, i, x, reference, targets, n_targets, layers, least_held, least_spare_m, command
):
    """Write the velocity that flies UAS i along its route.

    Args:
        arena: The arena.
        i: Index of the UAS.
        x: (14,) its state.
        reference: (2,) [m/s] of its inner loop.
        targets: (AHEAD,) the next waypoints of its route.
        n_targets: How many of them; after them comes home.
        layers: `Layers`.
        least_held: Steps for which the velocity can be flown before braking.
        least_spare_m: Distance to spare then, beyond what has to be kept [m].
        command: A record of COMMAND_DTYPE; written.

    Returns:
        Whether there is one: the way is clear or round a corner, and braking stays possible. Where
        not, the world's guidance knows better.
    """
    ahead = np.empty((AHEAD, 5))
    leg, needed_m, speed_mps = places_ahead(arena, i, x, targets, n_targets, ahead)
    if leg == NO_WAY:
        return False
    return steer_to(
        arena, i, x, reference, ahead, needed_m, speed_mps, layers, least_held, least_spare_m,
        command,
    )  # fmt: skip


@allocating_kernel
def steer_to(
    arena, i, x, reference, ahead, needed_m, speed_mps, layers, least_held, least_spare_m, command
):
    """`steer_along` to given places, at a least altitude [m] and a highest speed [m/s]."""
    rules, uas = arena.rules[0], arena.uas[i]
    path_m = np.empty((rules.lookahead_steps + MOST_HELD, 3))
    if ahead[0, IS_HOME] > 0.0:
        values = np.empty(3)
        towards_home(arena.vehicles[i], uas, rules, x, reference, values, command)
        altitude_m = max(values[2], needed_m)
        share = min(1.0, speed_mps / (math.hypot(values[0], values[1]) + 1e-9))
        write_command(command, VELOCITY, share * values[0], share * values[1], altitude_m)
        return _is_safe(arena, i, x, reference, command, least_held, least_spare_m, path_m)
    aims_m = np.empty((AHEAD, 3))
    commands, costs = np.empty((N_VELOCITIES, 3)), np.empty(N_VELOCITIES)
    weigh(
        arena.vehicles[i], uas.speed_mps, x, reference, ahead, layers, aims_m, commands, costs,
        command,
    )  # fmt: skip
    floor_m = max(lowest_altitude(arena, i, x[S.X], x[S.Y]), needed_m)
    share = min(1.0, speed_mps / uas.speed_mps)
    for n_held in (MOST_HELD, least_held):
        left = costs.copy()
        for _ in range(_TRIED):
            best = left.argmin()
            wanted_m = commands[best, 2]
            altitude_m = min(max(wanted_m, floor_m), max(rules.ceiling_m, wanted_m))
            write_command(
                command, VELOCITY, share * commands[best, 0], share * commands[best, 1], altitude_m
            )
            if _is_safe(arena, i, x, reference, command, n_held, least_spare_m, path_m):
                return True
            left[best] = np.inf
    return False
