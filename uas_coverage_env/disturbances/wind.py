"""Wind that is the same everywhere and at all times.

What it does follows from the vehicle: it flies in moving air, with the drag, the trim tilt and the
power of its velocity relative to the air (see `vehicle.air`).
"""

import math

from uas_coverage_env.compiled.kernels import kernel
from uas_coverage_env.world.disturbance import Disturbance


@kernel
def blow(arena, state, outcome, i, parameters, memory, random):
    """Add the wind; parameters: its velocity, NED [m/s]."""
    event = outcome[i]
    for axis in range(3):
        event.wind_mps[axis] += parameters[axis]


def wind_velocity_mps(
    mean_mps: float, from_deg: float, up_mps: float = 0.0
) -> tuple[float, float, float]:
    """The velocity of the air, NED [m/s].

    Args:
        mean_mps: Horizontal speed.
        from_deg: Where the wind comes from, clockwise from north [degrees]: 270 is a west wind,
            which blows towards the east.
        up_mps: Vertical speed, upward.
    """
    towards_rad = math.radians(from_deg + 180.0)
    return (mean_mps * math.cos(towards_rad), mean_mps * math.sin(towards_rad), -up_mps)


def constant_wind(mean_mps: float, from_deg: float, up_mps: float = 0.0) -> Disturbance:
    """Constant wind; arguments as for `wind_velocity_mps`, and as in the table `[wind]`."""
    return Disturbance("wind", blow, wind_velocity_mps(mean_mps, from_deg, up_mps))
