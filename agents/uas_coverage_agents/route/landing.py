"""Flying home and landing: how long to fly on, how hard to brake."""

import math

import numpy as np

from uas_coverage_env.autopilot.control import command_wrench, write_command
from uas_coverage_env.autopilot.guidance import LEAD_S
from uas_coverage_env.compiled.kernels import allocating_kernel
from uas_coverage_env.entities.commands import VELOCITY
from uas_coverage_env.vehicle import layout as S
from uas_coverage_env.vehicle.lpv import fly_kinematics
from uas_coverage_env.world.coverage import away_from_home_m, speed_of
from uas_coverage_env.world.height import CRUISE_ALTITUDE_M

_LANDING_SHARE = 0.9
"""Of the distance and the speed at which a UAS has landed."""

_BRAKING_FROM_S = 6.0
_BRAKING_STEPS = 7
_GLIDE_S = 0.8
_LOW_M = 0.05
_SPEEDS = np.array([1.0, 0.95, 0.9, 0.85, 0.8, 0.75, 0.7, 0.65, 0.6, 0.5, 0.4, 0.3, 0.15])
_BRAKES = np.array([1.0, 0.4, 0.2, 0.0, -0.05, -0.1, -0.2, -0.3])


@allocating_kernel
def _homewards(uas, rules, x, speed_mps, values):
    """Write the velocity (north, east) and altitude that flies straight home at a speed."""
    dx, dy = uas.home_m[0] - x[S.X], uas.home_m[1] - x[S.Y]
    way_m, now_mps = math.hypot(dx, dy), math.hypot(x[S.VX], x[S.VY])
    lead_s = min(uas.time_scale * LEAD_S, way_m / (2.0 * now_mps + 1e-9))
    dx, dy = dx - lead_s * x[S.VX], dy - lead_s * x[S.VY]
    length_m = math.hypot(dx, dy) + 1e-9
    values[0], values[1] = speed_mps * dx / length_m, speed_mps * dy / length_m
    glide_m = -uas.home_m[2] + uas.descent_mps * max(way_m / uas.speed_mps - _GLIDE_S, 0.0)
    values[2] = min(glide_m, max(-x[S.Z], rules.floor_m + rules.length_scale * CRUISE_ALTITUDE_M))
    next_m = math.hypot(
        uas.home_m[0] - x[S.X] - rules.dt_s * x[S.VX], uas.home_m[1] - x[S.Y] - rules.dt_s * x[S.VY]
    )
    lowest_m = rules.floor_m
    if next_m > rules.landing_zone_m - 1.0 and rules.min_height_m > 0.0:
        lowest_m = max(lowest_m, rules.min_height_m + _LOW_M)
    values[2] = max(values[2], lowest_m)


@allocating_kernel
def _cautious_mps(uas, x):
    """Speed homewards that comes to rest at home without being planned."""
    way_m = math.hypot(uas.home_m[0] - x[S.X], uas.home_m[1] - x[S.Y])
    left_m = max(
        way_m - min(uas.time_scale * LEAD_S * math.hypot(x[S.VX], x[S.VY]), 0.5 * way_m), 0.0
    )
    return min(uas.speed_mps, math.sqrt(3.4 * left_m), 0.5 * left_m)


@allocating_kernel
def is_landed(uas, rules, x):
    """Whether a UAS is near and slow enough to land."""
    return (
        away_from_home_m(uas, x) < _LANDING_SHARE * rules.landing_distance_m
        and speed_of(x) < _LANDING_SHARE * rules.landing_speed_mps
    )


@allocating_kernel
def towards_home(vehicle, uas, rules, x, reference, values, command):
    """Write the velocity (north, east) and altitude that flies straight home and lands soonest.

    Speeds held for some steps, and brakes put on after them (a velocity the other way), are
    simulated until the UAS is slow enough for a sample: it has landed then, tilted as it is.

    Args:
        vehicle: Record of VEHICLE_DTYPE.
        uas: Record of the arena.
        rules: Record of the arena.
        x: (14,) state.
        reference: (2,) [m/s] of the inner loop.
        values: (3,) written: velocity north and east [m/s], altitude [m].
        command: A record of COMMAND_DTYPE; written.
    """
    way_m = math.hypot(uas.home_m[0] - x[S.X], uas.home_m[1] - x[S.Y])
    _homewards(uas, rules, x, _cautious_mps(uas, x), values)
    if way_m > _BRAKING_FROM_S * uas.speed_mps:
        return
    on, on_reference = np.zeros(S.N_STATES), np.zeros(2)
    there, governed = np.zeros(S.N_STATES), np.zeros(2)
    u, trial, first = np.zeros(S.N_INPUTS), np.zeros(3), np.zeros(3)
    most = 2 * _BRAKING_STEPS
    for speed in _SPEEDS:
        on[:] = x
        on_reference[:] = reference
        for held in range(_BRAKING_STEPS):
            for brake in _BRAKES:
                there[:] = on
                governed[:] = on_reference
                now_mps = math.hypot(there[S.VX], there[S.VY]) + 1e-9
                north = -brake * uas.speed_mps * there[S.VX] / now_mps
                east = -brake * uas.speed_mps * there[S.VY] / now_mps
                for steps in range(held + 1, min(held + _BRAKING_STEPS, most)):
                    _homewards(uas, rules, there, 0.0, trial)
                    if steps == 1:
                        first[0], first[1], first[2] = north, east, trial[2]
                    write_command(command, VELOCITY, north, east, trial[2])
                    command_wrench(vehicle, there, governed, command, u)
                    fly_kinematics(vehicle, there, u)
                    if is_landed(uas, rules, there):
                        most = steps
                        values[:] = first
                        break
            _homewards(uas, rules, on, speed * uas.speed_mps, trial)
            if held == 0:
                first[:] = trial
            write_command(command, VELOCITY, trial[0], trial[1], trial[2])
            command_wrench(vehicle, on, on_reference, command, u)
            fly_kinematics(vehicle, on, u)
