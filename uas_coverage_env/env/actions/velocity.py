"""A velocity: what most learners fly."""

import math

from uas_coverage_env.autopilot.control import write_command
from uas_coverage_env.compiled.kernels import inlined_kernel
from uas_coverage_env.entities.commands import VELOCITY as COMMAND
from uas_coverage_env.entities.commands import Velocity
from uas_coverage_env.env.actions.kind import ActionKind, Range
from uas_coverage_env.env.actions.landing import refuse_landing_unless_departed
from uas_coverage_env.scenario import Scenario
from uas_coverage_env.vehicle import VehicleParams

ALTITUDE_MARGIN_M = 1.0
"""Altitudes of the velocity action keep this much more than the fence's margin [m]."""


def _altitude_range(scenario: Scenario) -> Range:
    """Lowest, middle and highest altitude of the velocity action [m]."""
    altitudes_m = -scenario.fence.vertices_m[:, 2]
    lowest, highest = float(altitudes_m.min()), float(altitudes_m.max())
    middle = (lowest + highest) / 2
    keep_m = min(scenario.geofence.margin_m + ALTITUDE_MARGIN_M, (highest - lowest) / 2)
    return lowest + keep_m, middle, highest - keep_m


def _ranges(vehicle: VehicleParams, scenario: Scenario) -> tuple[Range, ...]:
    speed_mps = vehicle.limits.v_xy_max_mps
    level = (-speed_mps, 0.0, speed_mps)
    return level, level, _altitude_range(scenario)


@inlined_kernel
def write(arena, state, tables, learners, i, parameters, values, command):
    """Write the command, see `ActionKind`."""
    write_command(command, COMMAND, values[0], values[1], values[2])


def _express(arena, state, tables, learners, i, parameters, command):
    if not isinstance(command, Velocity):
        raise ValueError("it flies a Velocity, or a GoTo as guidance flies it now")
    refuse_landing_unless_departed(state, i, command)
    # as the inner loop shortens it
    speed_mps = math.hypot(command.north_mps, command.east_mps)
    limit_mps = float(arena.uas["speed_mps"][i])
    shorten = limit_mps / speed_mps if speed_mps > limit_mps else 1.0
    return shorten * command.north_mps, shorten * command.east_mps, command.altitude_m


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
