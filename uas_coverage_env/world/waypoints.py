"""The waypoints of a scenario as arrays, for the kernels."""

import math

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.scenario import Scenario

ALL_SHARES = 2.0**30
"""The weight of all waypoints, as a whole number. With it and positions of at most 2²², every sum
of `Arena.waypoint_columns` stays below 2⁵³, up to where floats hold all whole numbers."""

N_WAYPOINT_COLUMNS = 8

WAYPOINT_DTYPE = np.dtype(
    (
        np.record,
        np.dtype([("position_m", "f8", (3,)), ("radius_m", "f8"), ("weight", "f8")], align=True),
    )
)


def waypoint_records(scenario: Scenario) -> NDArray[np.void]:
    """(W,) of WAYPOINT_DTYPE."""
    rows = [(w.position_m, w.radius_m, w.weight) for w in scenario.waypoints]
    return np.array(rows, dtype=WAYPOINT_DTYPE)


def unit_m_of(positions_m: NDArray[np.float64]) -> float:
    """A power of two of which all horizontal positions are at most 2²² [m]."""
    farthest_m = float(np.abs(positions_m[:, :2]).max())
    return 2.0 ** (math.ceil(math.log2(max(farthest_m, 1.0))) - 22)


def waypoint_columns(waypoints: NDArray[np.void], unit_m: float) -> NDArray[np.float64]:
    """See `Arena.waypoint_columns`."""
    reach_m2 = waypoints["radius_m"] * waypoints["radius_m"]
    weight = waypoints["weight"]
    shares = np.round(weight / weight.sum() * ALL_SHARES)
    north, east = np.round(waypoints["position_m"].T[:2] / unit_m)
    rows = [*waypoints["position_m"].T, reach_m2, weight, shares, shares * north, shares * east]
    return np.array(rows, dtype=np.float64, order="C")
