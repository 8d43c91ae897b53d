"""What it takes to land where a UAS has not left: home as a waypoint action, or the wish of v1."""

import math

from uas_coverage_env.compiled.kernels import inlined_kernel
from uas_coverage_env.entities.commands import command_mode
from uas_coverage_env.world import Command, WorldState
from uas_coverage_env.world.coverage import away_from_home_m

_AT_BOTTOM_M = 0.1
"""An altitude no more than this above the lowest that is asked for is the lowest [m]."""


@inlined_kernel
def asks_to_land(arena, state, i, north_mps, east_mps, altitude_m, lowest_m):
    """Whether a velocity is the wish to land: to hold still, at the bottom, near its landing place.

    The bottom is the lowest altitude that can be asked for, or the landing place where that is
    higher. Where a UAS has left its start no wish is needed.
    """
    rules, uas = arena.rules[0], arena.uas[i]
    bottom_m = max(lowest_m, -uas.home_m[2]) + _AT_BOTTOM_M
    slow = math.hypot(north_mps, east_mps) < rules.landing_speed_mps
    near = away_from_home_m(uas, state.x[i]) <= rules.landing_distance_m
    return slow and altitude_m <= bottom_m and near


def refuse_landing_unless_departed(state: WorldState, i: int, command: Command) -> None:
    """Refuse a command that lands a UAS at its start before it has left.

    Raises:
        ValueError: It would.
    """
    if command_mode(command) == "return" and not state.uas[i].departed:
        raise ValueError(
            "it has not left its start, and only home as a waypoint action lands it there"
        )
