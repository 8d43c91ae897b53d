"""A sensor and a reward term as a user writes them: outside of the package, in one file."""

import math

from uas_coverage_env.compiled.kernels import kernel
from uas_coverage_env.env import Feature, ObservationBlock, RewardTerm
from uas_coverage_env.vehicle.layout import VX, VY, X, Y


@kernel
def write_beacon(arena, state, tables, learners, i, parameters, row):
    north_m = parameters[0] - state.x[i, X]
    east_m = parameters[1] - state.x[i, Y]
    strength = 1.0 / (1.0 + math.hypot(north_m, east_m) / 100.0)
    row[0] = strength
    row[1] = 1.0 if strength > parameters[2] else 0.0


def beacon(north_m, east_m, threshold=0.5):
    return ObservationBlock(
        name="beacon",
        repeats=1,
        features=(
            Feature("strength", 1, 0, 1, "1/(1 + distance / 100 m)"),
            Feature("heard", 1, 0, 1, "1 where the strength is above the threshold"),
        ),
        write=write_beacon,
        parameters=(north_m, east_m, threshold),
    )


@kernel
def slow_flight(arena, state, tables, learners, scratch, i, parameters):
    speed_mps = math.hypot(state.x[i, VX], state.x[i, VY])
    return -max(0.0, speed_mps - parameters[0])


SLOW = RewardTerm("slow", 0.5, "minus the speed above 2 m/s", slow_flight, parameters=(2.0,))
