"""What a fleet's size makes of lengths and times: the one place from which they follow.

The lengths of guidance, routes, filter and planners were chosen, and measured, with the shipped
vehicles, which stop within 25 to 30 m at every sample time from 0.02 to 2 s. What guidance flies
beside its route, and what it needs to turn and to stop, goes with the way that the inner loop takes
to stop. So every such length is a multiple of `length_scale`: 1 for vehicles that stop in as much,
less in proportion for those that stop sooner, more for those that stop later. Which lengths these
are: docs/deviations.md.
"""

from collections.abc import Iterable

from uas_coverage_env.vehicle.params import VehicleParams
from uas_coverage_env.vehicle.stopping import stopping_of

_STOPS_WITHIN_M = 25.0, 30.0

_LOOKAHEAD_S = 14.0
"""The shipped vehicles brake within this from the highest speed, in strong wind, too [s]."""

_IN_WIND = 1.15
"""In wind a heavier or faster vehicle is taken to brake so many times as long as in still air."""

_OF_MISSION = 0.1
"""Of the time of a short mission, what is kept of the clock at most [-]."""

SLOW_SHARE = 0.25
"""Of the highest speed, what is slow [-]: 3 m/s of the shipped vehicles."""


def length_scale(vehicles: Iterable[VehicleParams], dt_s: float) -> float:
    """By what the lengths chosen for the shipped vehicles are multiplied: that of the largest.

    Args:
        vehicles: The fleet.
        dt_s: Length of a step [s].
    """
    way_m = max(stopping_of(vehicle, dt_s).way_m for vehicle in set(vehicles))
    least_m, most_m = _STOPS_WITHIN_M
    return min(way_m / least_m, max(way_m / most_m, 1.0))


def braking_s(vehicles: Iterable[VehicleParams], dt_s: float) -> float:
    """Time in which any of a fleet has braked from any speed, in wind too [s].

    Args:
        vehicles: The fleet.
        dt_s: Length of a step [s].
    """
    slowest_s = max(stopping_of(vehicle, dt_s).time_s for vehicle in set(vehicles))
    return max(_LOOKAHEAD_S, _IN_WIND * slowest_s)


def clock_reserve_s(most_s: float, mission_s: float) -> float:
    """What of the clock is kept: so many seconds, of a short mission a tenth at most [s]."""
    return min(most_s, _OF_MISSION * mission_s)
