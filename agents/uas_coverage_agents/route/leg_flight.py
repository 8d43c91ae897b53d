"""Flying along a route without stopping: which velocity next, past the coming spheres.

Constant velocities in several directions and speeds are simulated with the vehicle's own inner
loop until the next waypoint is covered, or for `HORIZON` steps. A network says how long the flight
past the two waypoints after it takes from the state reached; the quickest velocity is flown, for
one step. So nothing that the network gets wrong misses a waypoint.
"""

import math

import numpy as np

from uas_coverage_agents.route.layers import value_of
from uas_coverage_env.autopilot.control import command_wrench, write_command
from uas_coverage_env.autopilot.guidance import CRUISE_ALTITUDE_M, HEADROOM_M, LEAD_S, passes_over
from uas_coverage_env.autopilot.lookahead import fixed_slack, fly_hold_and_brake
from uas_coverage_env.compiled.kernels import allocating_kernel
from uas_coverage_env.vehicle import PHI, THETA, VX, VY, VZ, X, Y, Z, fly_kinematics
from uas_coverage_env.world.commands import VELOCITY
from uas_coverage_env.world.height import lowest_altitude
from uas_coverage_env.world.routes import NO_WAY, ROUND_CORNER, crossing, route

N_FLIGHT = 21
"""Numbers that the network reads about a state and the next three places."""

HORIZON = 12
AHEAD = 4
"""Places ahead that matter: three are looked at after the first is covered."""

NORTH, EAST, DOWN, RADIUS, IS_HOME = range(5)
"""Columns of the places ahead."""

_SPEEDS = np.array([1.0, 0.75, 0.5, 0.25, 0.05])
_TURNS_BACK, _TURNS_ON = 5, 11
N_VELOCITIES = (_TURNS_BACK + _TURNS_ON) * len(_SPEEDS)

_LENGTH_M, _SPEED_MPS, _TILT_RAD, _CLIMB_MPS, _RADIUS_M, _RISE_M = 50.0, 12.0, 0.44, 3.0, 15.0, 10.0
_CORNER_M = 4.0
_WITHIN_M = 0.15
_TRIED = 16
_HELD = 4
_LANDING_M = 12.0


@allocating_kernel
def aim_ahead(x, ahead, aims_m):
    """Where the coming spheres are touched on a short way: (AHEAD, 3), by coordinate descent."""
    n = ahead.shape[0]
    for k in range(n):
        aims_m[k] = ahead[k, :3]
    for _ in range(4):
        for k in range(n - 1):
            if ahead[k, IS_HOME] > 0.0:
                break
            at, following = ahead[k], aims_m[k + 1]
            bx, by, bz = x[X], x[Y], x[Z]
            if k > 0:
                bx, by, bz = aims_m[k - 1, 0], aims_m[k - 1, 1], aims_m[k - 1, 2]
            off_m = 0.5 * at[RADIUS]
            dz = min(max(0.5 * (bz + following[2]) - at[DOWN], -off_m), off_m)
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
def look_ahead(x, reference, speed_mps, first, second, third, row):
    """Write what the network reads of a state and the next three places.

    Everything is told along and across the direction of the first place; the second lies on the
    positive side, so that nothing depends on where north or the left is.

    Returns:
        Time [s] straight along the places at full speed, which the network's output is added to.
    """
    dx, dy = first[NORTH] - x[X], first[EAST] - x[Y]
    way_m = math.hypot(dx, dy)
    ex, ey = 1.0, 0.0
    if way_m > 1e-3:
        ex, ey = dx / way_m, dy / way_m
    ax, ay = second[NORTH] - first[NORTH], second[EAST] - first[EAST]
    bx, by = third[NORTH] - second[NORTH], third[EAST] - second[EAST]
    side = 1.0 if ex * ay - ey * ax >= 0.0 else -1.0
    px, py = -side * ey, side * ex
    row[0] = way_m / _LENGTH_M
    row[1] = first[RADIUS] / _RADIUS_M
    row[2] = (x[VX] * ex + x[VY] * ey) / _SPEED_MPS
    row[3] = (x[VX] * px + x[VY] * py) / _SPEED_MPS
    row[4] = (-x[THETA] * ex + x[PHI] * ey) / _TILT_RAD
    row[5] = (-x[THETA] * px + x[PHI] * py) / _TILT_RAD
    row[6] = (reference[0] * ex + reference[1] * ey) / _SPEED_MPS
    row[7] = (reference[0] * px + reference[1] * py) / _SPEED_MPS
    row[8] = (ax * ex + ay * ey) / _LENGTH_M
    row[9] = (ax * px + ay * py) / _LENGTH_M
    row[10] = second[RADIUS] / _RADIUS_M
    row[11] = (bx * ex + by * ey) / _LENGTH_M
    row[12] = (bx * px + by * py) / _LENGTH_M
    row[13] = third[RADIUS] / _RADIUS_M
    row[14] = (first[DOWN] - x[Z]) / _RISE_M
    row[15] = (second[DOWN] - first[DOWN]) / _RISE_M
    row[16] = x[VZ] / _CLIMB_MPS
    row[17] = first[IS_HOME]
    row[18] = second[IS_HOME]
    row[19] = third[IS_HOME]
    row[20] = math.hypot(ax, ay) / _LENGTH_M
    for f in range(N_FLIGHT):
        row[f] = min(max(row[f], -3.0), 3.0)
    return (way_m + math.hypot(ax, ay) + math.hypot(bx, by)) / speed_mps


@allocating_kernel
def weigh(vehicle, speed_mps, x, reference, ahead, layers, aims_m, commands, costs, command):
    """Simulate the velocities that may be flown next.

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
    aim_ahead(x, ahead, aims_m)
    to_first = math.atan2(aims_m[0, 1] - x[Y], aims_m[0, 0] - x[X])
    turn = math.atan2(aims_m[1, 1] - x[Y], aims_m[1, 0] - x[X]) - to_first
    turn = math.atan2(math.sin(turn), math.cos(turn))
    sign = 1.0 if turn > 0.0 else -1.0
    at = ahead[0]
    within_m = max(0.985 * at[RADIUS] - _WITHIN_M, 0.5 * at[RADIUS])
    beyond_m = math.hypot(ahead[3, NORTH] - ahead[2, NORTH], ahead[3, EAST] - ahead[2, EAST])
    there, governed, u = np.zeros(14), np.zeros(2), np.zeros(5)
    row = np.empty(N_FLIGHT)
    n = 0
    for q in range(-_TURNS_BACK, _TURNS_ON):
        angle = to_first + (turn * q / 8.0 if q >= 0 else 0.15 * q * sign)
        for s in range(_SPEEDS.shape[0]):
            north_mps = _SPEEDS[s] * speed_mps * math.cos(angle)
            east_mps = _SPEEDS[s] * speed_mps * math.sin(angle)
            commands[n, 0], commands[n, 1], commands[n, 2] = north_mps, east_mps, -aims_m[0, 2]
            there[:] = x
            governed[:] = reference
            steps, covers = 0, False
            while steps < HORIZON and not covers:
                write_command(command, VELOCITY, north_mps, east_mps, -aims_m[0, 2])
                command_wrench(vehicle, there, governed, command, u)
                fly_kinematics(vehicle, there, u)
                steps += 1
                dx, dy, dz = there[X] - at[NORTH], there[Y] - at[EAST], there[Z] - at[DOWN]
                covers = dx * dx + dy * dy + dz * dz <= within_m * within_m
            costs[n] = steps * vehicle.dt_s
            if covers:
                costs[n] += look_ahead(
                    there, governed, speed_mps, ahead[1], ahead[2], ahead[3], row
                )
            else:
                costs[n] += beyond_m / speed_mps + look_ahead(
                    there, governed, speed_mps, ahead[0], ahead[1], ahead[2], row
                )
            costs[n] += value_of(layers, row)
            n += 1


@allocating_kernel
def towards_home(uas, x, home_m, altitude_floor_m, values):
    """Write the velocity (north, east) and altitude that flies straight home, to rest there."""
    dx, dy = home_m[0] - x[X], home_m[1] - x[Y]
    way_m, now_mps = math.hypot(dx, dy), math.hypot(x[VX], x[VY])
    lead_s = min(LEAD_S, way_m / (2.0 * now_mps + 1e-9))
    left_m = max(way_m - lead_s * now_mps, 0.0)
    speed_mps = min(uas.speed_mps, math.sqrt(3.4 * left_m), 0.5 * left_m)
    dx, dy = dx - lead_s * x[VX], dy - lead_s * x[VY]
    length_m = math.hypot(dx, dy) + 1e-9
    values[0], values[1] = speed_mps * dx / length_m, speed_mps * dy / length_m
    glide_m = -home_m[2] + uas.descent_mps * max(way_m / uas.speed_mps - 1.0, 0.0)
    cruise_m = max(-x[Z], altitude_floor_m + CRUISE_ALTITUDE_M)
    values[2] = min(glide_m, cruise_m)


@allocating_kernel
def _is_safe(arena, i, x, reference, command, n_held, path_m):
    """Whether a command held for some steps, and braking after it, is clear of what is fixed."""
    n_flown, slack_m = fly_hold_and_brake(
        arena, i, x, reference, command, n_held, False, path_m[: path_m.shape[0] - _HELD + n_held]
    )
    return fixed_slack(arena, i, path_m, n_flown, 0.0, slack_m) >= 0.0


@allocating_kernel
def _over_roofs(arena, x, end_x, end_y, end_altitude_m, uas, leg):
    """Altitude [m] at which a leg passes over what is low; the speed that leaves time to climb."""
    altitude_m = -x[Z]
    length_m = math.hypot(end_x - x[X], end_y - x[Y])
    needed_m, speed_mps = -math.inf, uas.speed_mps
    for o in range(arena.obstacles.shape[0]):
        obstacle = arena.obstacles[o]
        at, over, ends = crossing(
            obstacle, arena.normals, arena.offsets_m, x[X], x[Y], end_x, end_y
        )
        if at > 1.0 or not passes_over(obstacle, over, ends, leg, max(altitude_m, end_altitude_m)):
            continue
        needed_m = max(needed_m, obstacle.roof_m + HEADROOM_M)
        rise_m = obstacle.roof_m - altitude_m
        if rise_m > 0.0:
            speed_mps = min(speed_mps, at * length_m / (rise_m / uas.climb_mps + LEAD_S))
    return needed_m, speed_mps


@allocating_kernel
def steer_along(arena, i, x, reference, targets, n_targets, layers, command):
    """Write the velocity that flies UAS i along its route.

    Args:
        arena: The arena.
        i: Index of the UAS.
        x: (14,) its state.
        reference: (2,) [m/s] of its inner loop.
        targets: (AHEAD,) the next waypoints of its route.
        n_targets: How many of them; after them comes home.
        layers: `Layers`.
        command: A record of COMMAND_DTYPE; written.

    Returns:
        Whether there is one: the way is clear or round a corner, and braking stays possible. Where
        not, the world's guidance knows better.
    """
    rules, uas = arena.rules[0], arena.uas[i]
    ahead = np.zeros((AHEAD, 5))
    target = targets[0] if n_targets > 0 else arena.waypoints.shape[0] + i
    to_m = arena.waypoints[targets[0]].position_m if n_targets > 0 else uas.home_m
    end_x, end_y, _, leg = route(arena, target, x[X], x[Y], x[Z], to_m[0], to_m[1], to_m[2])
    if leg == NO_WAY:
        return False
    path_m = np.empty((rules.lookahead_steps + _HELD, 3))
    needed_m, speed_mps = _over_roofs(arena, x, end_x, end_y, -to_m[2], uas, leg)
    n = 0
    if leg == ROUND_CORNER:
        ahead[0, NORTH], ahead[0, EAST] = end_x, end_y
        ahead[0, DOWN] = min(to_m[2], x[Z]) if n_targets > 0 else x[Z]
        ahead[0, RADIUS] = _CORNER_M
        n = 1
    elif n_targets == 0:
        if math.hypot(to_m[0] - x[X], to_m[1] - x[Y]) < _LANDING_M:
            return False
        values = np.empty(3)
        towards_home(uas, x, to_m, rules.floor_m, values)
        altitude_m = max(values[2], lowest_altitude(arena, i, x[X], x[Y]), needed_m)
        share = min(1.0, speed_mps / (math.hypot(values[0], values[1]) + 1e-9))
        write_command(command, VELOCITY, share * values[0], share * values[1], altitude_m)
        return _is_safe(arena, i, x, reference, command, 1, path_m)
    for k in range(n, AHEAD):
        if k - n < n_targets:
            waypoint = arena.waypoints[targets[k - n]]
            ahead[k, :3] = waypoint.position_m
            ahead[k, RADIUS] = waypoint.radius_m
        else:
            ahead[k, :3] = uas.home_m
            ahead[k, IS_HOME] = 1.0
    aims_m = np.empty((AHEAD, 3))
    commands, costs = np.empty((N_VELOCITIES, 3)), np.empty(N_VELOCITIES)
    weigh(
        arena.vehicles[i], uas.speed_mps, x, reference, ahead, layers, aims_m, commands, costs,
        command,
    )  # fmt: skip
    floor_m = max(lowest_altitude(arena, i, x[X], x[Y]), needed_m)
    share = min(1.0, speed_mps / uas.speed_mps)
    for n_held in (_HELD, 1):
        left = costs.copy()
        for _ in range(_TRIED):
            best = left.argmin()
            wanted_m = commands[best, 2]
            altitude_m = min(max(wanted_m, floor_m), max(rules.ceiling_m, wanted_m))
            write_command(
                command, VELOCITY, share * commands[best, 0], share * commands[best, 1], altitude_m
            )
            if _is_safe(arena, i, x, reference, command, n_held, path_m):
                return True
            left[best] = np.inf
    return False
