"""Waypoints that keep a UAS from flying its route: without them it flies the rest."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from uas_coverage_baselines.trajectory.first_guess import first_flight
from uas_coverage_baselines.trajectory.fleet import Fleet
from uas_coverage_baselines.trajectory.flight_model import reduced_state
from uas_coverage_baselines.trajectory.work import done

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

_MOST = 4
"""Found one by one in a route; where there are more, what comes after the last one is left, too."""


def closed_off(fleet: Fleet, uas: int, x: FloatArray, route: IntArray) -> IntArray:
    """Waypoints of a route without which a UAS has a flight along it, whatever moves.

    At first those without a way to them. Where there is no flight along the others either, the
    shortest part of the route that has none is found by halving, and its end is left.

    Args:
        fleet: The mission.
        uas: Index of the UAS.
        x: (14,) its state.
        route: (K,) waypoints along which it has no flight.

    Returns:
        Some of them; none where the whole route can be flown once nothing moves, or not even the
        way home can be flown from here.
    """
    program, start = fleet.program(uas, {}, ()), reduced_state(x)

    def flies(part: IntArray) -> bool:
        return done(first_flight(program, fleet.terrain, uas, start, part)).is_clear

    if flies(route) or not flies(route[:0]):
        return route[:0]
    rest, low = route[fleet.access.has_way[uas, route]], 0
    for _ in range(_MOST):
        if not len(rest) or (len(rest) < len(route) and flies(rest)):
            break
        low, high = 0, len(rest)
        while high - low > 1:
            middle = (low + high) // 2
            low, high = (middle, high) if flies(rest[:middle]) else (low, middle)
        rest = np.delete(rest, high - 1)
    else:
        rest = rest[:low]
    return route[~np.isin(route, rest)]
