"""Kinds of action as a user writes them: outside of the package, in one file."""

import math

import numpy as np

from uas_coverage_env.autopilot import write_command
from uas_coverage_env.autopilot.control import write_brake
from uas_coverage_env.compiled.kernels import kernel
from uas_coverage_env.entities.commands import CLIMB, GO_TO, HOME, VELOCITY
from uas_coverage_env.env import ActionKind
from uas_coverage_env.vehicle.layout import VX, VY, Z
from uas_coverage_env.world import Velocity


@kernel
def write_climb(arena, state, tables, learners, i, parameters, values, command):
    write_command(command, CLIMB, values[0], values[1], -values[2])


def climb_ranges(vehicle, scenario):
    limits = vehicle.limits
    level = (-limits.v_xy_max_mps, 0.0, limits.v_xy_max_mps)
    return level, level, (-limits.v_down_max_mps, 0.0, limits.v_up_max_mps)


CLIMB_RATE = ActionKind(
    name="climb_rate",
    meaning="North and east velocity, and a rate of climb.",
    write=write_climb,
    numbers=("north_mps", "east_mps", "climb_mps"),
    ranges=climb_ranges,
)


@kernel
def write_heading(arena, state, tables, learners, i, parameters, values, command):
    # five numbers, of which the last two are gains: a kind may have any number of them
    altitude_m = -state.x[i, Z] + parameters[0] * values[2]
    north_mps = values[1] * math.cos(values[0]) + 0.0 * values[3]
    east_mps = values[1] * math.sin(values[0]) + 0.0 * values[4]
    write_command(command, VELOCITY, north_mps, east_mps, altitude_m)


def heading_ranges(vehicle, scenario):
    speed_mps = vehicle.limits.v_xy_max_mps
    unused = (0.0, 0.0, 0.0)
    return (-math.pi, 0.0, math.pi), (0.0, 0.0, speed_mps), (-1.0, 0.0, 1.0), unused, unused


def heading_of(arena, state, tables, learners, i, parameters, command):
    if not isinstance(command, Velocity):
        raise ValueError("it flies a Velocity")
    rise = (command.altitude_m + state.x[i, Z]) / parameters[0]
    heading = math.atan2(command.east_mps, command.north_mps)
    return heading, math.hypot(command.north_mps, command.east_mps), rise, 0.0, 0.0


def heading_and_speed(rise_m):
    return ActionKind(
        name="heading",
        meaning="Heading, speed, and a part of `rise_m` to climb.",
        write=write_heading,
        numbers=("heading_rad", "speed_mps", "rise", "unused", "unused_too"),
        ranges=heading_ranges,
        express=heading_of,
        parameters=(rise_m,),
    )


GO_HOME, BRAKE, GO_ON = range(3)


@kernel
def write_manoeuvre(arena, state, tables, learners, i, parameters, values, command):
    if values[0] == GO_HOME:
        command.kind = GO_TO
        command.values[0] = HOME
        command.returning = True
    elif values[0] == BRAKE:
        write_brake(command)
    else:
        write_command(command, CLIMB, state.x[i, VX] + parameters[0], state.x[i, VY], 0.0)


def not_twice(candidates):
    """Braking is not on offer while the tenth candidate is there: any rule will do."""
    mask = np.ones((*candidates.shape[:-1], 3), dtype=np.bool_)
    mask[..., BRAKE] = candidates[..., 9] < 0
    return mask


MANOEUVRES = ActionKind(
    name="manoeuvres",
    meaning="Home, brake, or faster to the north.",
    write=write_manoeuvre,
    choices=3,
    mask=not_twice,
    goes_to=True,
    parameters=(1.0,),
)


@kernel
def write_nothing_good(arena, state, tables, learners, i, parameters, values, command):
    write_command(command, VELOCITY, values[0], 0.0, 10.0)
    if values[0] > 0.5:
        command.values[1] = math.nan if parameters[0] == 0.0 else 1.0
        command.kind = GO_TO if parameters[0] == 1.0 else VELOCITY
        command.kind = 17 if parameters[0] == 2.0 else command.kind


def faulty(fault):
    return ActionKind(
        name="faulty",
        meaning="Writes what cannot be flown above 0.5.",
        write=write_nothing_good,
        numbers=("north_mps",),
        ranges=lambda vehicle, scenario: ((-1.0, 0.0, 1.0),),
        parameters=(float(fault),),
    )
