"""A horizontal velocity at a fixed height: the least that a learner can fly."""

import math

from uas_coverage_env.autopilot.control import write_command
from uas_coverage_env.compiled.kernels import inlined_kernel
from uas_coverage_env.entities.commands import VELOCITY as COMMAND
from uas_coverage_env.env.actions.kind import ActionKind, Range
from uas_coverage_env.env.actions.velocity import SLOPE_AT_REST, finely, level_ranges
from uas_coverage_env.scenario import Scenario
from uas_coverage_env.vehicle import VehicleParams
from uas_coverage_env.vehicle.layout import X, Y
from uas_coverage_env.world.waypoints import DOWN_M


def _ranges(vehicle: VehicleParams, scenario: Scenario) -> tuple[Range, ...]:
    return level_ranges(vehicle)


@inlined_kernel
def write(arena, state, tables, learners, i, parameters, values, command):
    """Write the command, see `ActionKind`."""
    highest, rules, home_m = tables.ranges[i, 0, 2], arena.rules[0], arena.uas[i].home_m
    north_mps = finely(values[0], highest, parameters[0])
    east_mps = finely(values[1], highest, parameters[0])
    down_m, n_waypoints = arena.waypoint_columns[DOWN_M], arena.waypoints.shape[0]
    sum_m = 0.0
    for w in range(n_waypoints):
        sum_m -= down_m[w]
    altitude_m = min(max(sum_m / n_waypoints, rules.floor_m), rules.ceiling_m)
    away_m = math.hypot(state.x[i, X] - home_m[0], state.x[i, Y] - home_m[1])
    slow = math.hypot(north_mps, east_mps) < rules.landing_speed_mps
    if slow and away_m <= rules.landing_distance_m:
        altitude_m = -home_m[2]
        command.returning = True
    write_command(command, COMMAND, north_mps, east_mps, altitude_m)


PLANAR = ActionKind(
    name="planar",
    meaning=(
        "North and east velocity as of `velocity`, at the mean altitude of all waypoints. One that "
        "asks to hold still (slower than the speed of landing) above its landing place sinks and "
        "lands there. What lies too high or too low for that altitude is out of its reach."
    ),
    write=write,
    numbers=("north_mps", "east_mps"),
    ranges=_ranges,
    parameters=(SLOPE_AT_REST,),
)
