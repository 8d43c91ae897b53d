"""A velocity: what most learners fly."""

import math

from uas_coverage_env.autopilot.control import write_command
from uas_coverage_env.compiled.kernels import inlined_kernel
from uas_coverage_env.entities.commands import VELOCITY as COMMAND
from uas_coverage_env.entities.commands import Velocity, command_mode
from uas_coverage_env.env.actions.kind import ActionKind, Range
from uas_coverage_env.env.actions.landing import (
    asks_to_land,
    refuse_landing_unless_departed,
)
from uas_coverage_env.scenario import Scenario
from uas_coverage_env.vehicle import VehicleParams
from uas_coverage_env.vehicle.scale import length_scale

ALTITUDE_MARGIN_M = 1.0
"""Altitudes of the velocity action keep this much more than the fence's margin, at scale 1 [m]."""

SLOPE_AT_REST = 0.1
"""Of v1: a share s of the limit is s · (this + (1 - this) · s²). Noise of an action near 0 is ten
times smaller in velocity than on a straight line, and a step there still changes something; the
ends of the range are where they were. `benchmarks/learner_actions.py` shows who lands with it."""

_LOW_SHARE = 1.0 / 6.0
"""Of v1: how much of the altitudes lies between -1 and 0, for the same reason."""


def _altitude_range(scenario: Scenario) -> Range:
    """Lowest, middle and highest altitude of the velocity action [m]."""
    altitudes_m = -scenario.fence.vertices_m[:, 2]
    lowest, highest = float(altitudes_m.min()), float(altitudes_m.max())
    middle = (lowest + highest) / 2
    inside_m = ALTITUDE_MARGIN_M * length_scale(scenario.vehicles, scenario.dt_s)
    keep_m = min(scenario.geofence.margin_m + inside_m, (highest - lowest) / 2)
    return lowest + keep_m, middle, highest - keep_m


def level_ranges(vehicle: VehicleParams) -> tuple[Range, Range]:
    """Of the velocities north and east [m/s]."""
    speed_mps = vehicle.limits.v_xy_max_mps
    return ((-speed_mps, 0.0, speed_mps),) * 2


def _ranges(vehicle: VehicleParams, scenario: Scenario) -> tuple[Range, ...]:
    return *level_ranges(vehicle), _altitude_range(scenario)


def _ranges_v1(vehicle: VehicleParams, scenario: Scenario) -> tuple[Range, ...]:
    lowest, _, highest = _altitude_range(scenario)
    low = lowest + _LOW_SHARE * (highest - lowest)
    return *level_ranges(vehicle), (lowest, low, highest)


@inlined_kernel
def write(arena, state, tables, learners, i, parameters, values, command):
    """Write the command, see `ActionKind`."""
    write_command(command, COMMAND, values[0], values[1], values[2])


@inlined_kernel
def finely(value, limit, slope):
    """A velocity of v1 [m/s] for that on a straight line; the same at 0 and at the limits."""
    share = value / limit
    return value * (slope + (1.0 - slope) * share * share)


@inlined_kernel
def write_finely(arena, state, tables, learners, i, parameters, values, command):
    """Write the command, see `ActionKind`; one that holds still at the bottom may land."""
    highest = tables.ranges[i, 0, 2]
    north_mps = finely(values[0], highest, parameters[0])
    east_mps = finely(values[1], highest, parameters[0])
    write_command(command, COMMAND, north_mps, east_mps, values[2])
    lowest_m = tables.ranges[i, 2, 0]
    command.returning = asks_to_land(arena, state, i, north_mps, east_mps, values[2], lowest_m)


def _on_straight_line(velocity_mps: float, limit_mps: float, slope: float) -> float:
    """The inverse of `finely`: the one root of a cubic that rises everywhere."""
    share, rest = velocity_mps / limit_mps, 1.0 - slope
    angle = math.asinh(1.5 * share / slope * math.sqrt(3.0 * rest / slope)) / 3.0
    return limit_mps * 2.0 * math.sqrt(slope / (3.0 * rest)) * math.sinh(angle)


def _level_mps(arena, i, command):
    """North and east velocity [m/s], as the inner loop shortens it."""
    if not isinstance(command, Velocity):
        raise ValueError("it flies a Velocity, or a GoTo as guidance flies it now")
    speed_mps = math.hypot(command.north_mps, command.east_mps)
    limit_mps = float(arena.uas["speed_mps"][i])
    shorten = limit_mps / speed_mps if speed_mps > limit_mps else 1.0
    return shorten * command.north_mps, shorten * command.east_mps


def _express(arena, state, tables, learners, i, parameters, command):
    north_mps, east_mps = _level_mps(arena, i, command)
    refuse_landing_unless_departed(state, i, command)
    return north_mps, east_mps, command.altitude_m


def express_landing(arena, state, i, ranges, parameters, command, altitude_m, lowest_m):
    """Numbers of v1 for the level part of a command that lands exactly where the action does.

    Raises:
        ValueError: It would land where the command does not, or not where it does.
    """
    level_mps = _level_mps(arena, i, command)
    lands = asks_to_land(arena, state, i, *level_mps, altitude_m, lowest_m)
    if lands != (command_mode(command) == "return") and not state.uas[i].departed:
        raise ValueError(
            "it has not left its start, and lands there if it asks to hold still at the bottom, "
            "and only then"
        )
    limit_mps, (slope,) = float(ranges[0, 2]), parameters
    return tuple(_on_straight_line(each, limit_mps, slope) for each in level_mps)


def _express_finely(arena, state, tables, learners, i, parameters, command):
    ranges = tables.ranges[i]
    lowest_m = float(ranges[2, 0])
    altitude_m = max(command.altitude_m, lowest_m) if isinstance(command, Velocity) else lowest_m
    level = express_landing(arena, state, i, ranges, parameters, command, altitude_m, lowest_m)
    return *level, command.altitude_m


VELOCITY = ActionKind(
    name="velocity",
    meaning=(
        "North and east velocity in units of the vehicle's limit, and an altitude to hold, from "
        "the lowest (-1) to the highest (1) that lies 1 m inside of the fence's margin. A "
        "horizontal velocity longer than the limit is shortened by the inner loop."
    ),
    write=write,
    numbers=("north_mps", "east_mps", "altitude_m"),
    ranges=_ranges,
    express=_express,
)

VELOCITY_V1 = ActionKind(
    name="velocity",
    meaning=(
        "North and east velocity, finely near 0: a number s is s · (0.1 + 0.9 s²) of the vehicle's "
        "limit. And an altitude to hold, from the lowest (-1) to the highest (1) that lies 1 m "
        "inside of the fence's margin; 0 is a sixth of the way up. A horizontal velocity longer "
        "than the limit is shortened by the inner loop. One that asks to hold still (slower than "
        "the speed of landing) at the lowest altitude lands at its landing place, even if it has "
        "not left it."
    ),
    write=write_finely,
    numbers=("north_mps", "east_mps", "altitude_m"),
    ranges=_ranges_v1,
    express=_express_finely,
    parameters=(SLOPE_AT_REST,),
)
