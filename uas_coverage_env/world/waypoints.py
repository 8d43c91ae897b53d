"""The waypoints of a scenario as arrays, for the kernels."""

import math

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.compiled.memory import record_dtype
from uas_coverage_env.scenario import Scenario, Uas
from uas_coverage_env.scenario.payload import asks
from uas_coverage_env.world.events import steps_until

ALL_SHARES = 2.0**30
"""The weight of all waypoints, as a whole number. With it and positions of at most 2²², every sum
of `Arena.waypoint_columns` stays below 2⁵³, up to where floats hold all whole numbers."""

NORTH_M, EAST_M, DOWN_M, REACH_M2, WEIGHT, SHARE, SHARE_NORTH, SHARE_EAST = range(8)
"""Rows of `Arena.waypoint_columns`, whole numbers from SHARE on."""

N_WAYPOINT_COLUMNS = SHARE_EAST + 1

_NOT_CARRIED = 1 << 62

WAYPOINT_DTYPE = record_dtype(
    [
        ("position_m", "f8", (3,)),
        ("radius_m", "f8"),
        ("weight", "f8"),
        # whether more is asked than to come near, and what: the bit of a sensor, or none;
        # heights above the ground, and a speed
        ("asks", "?"),
        ("sensor", "i8"),
        ("lowest_m", "f8"),
        ("highest_m", "f8"),
        ("max_speed_mps", "f8"),
    ]
)


def waypoint_records(scenario: Scenario) -> NDArray[np.void]:
    """(W,) of WAYPOINT_DTYPE."""
    bits = _sensor_bits(scenario)
    rows = [
        (
            *(w.position_m, w.radius_m, w.weight, asks(w)),
            0 if w.sensor is None else bits.get(w.sensor, _NOT_CARRIED),
            *(w.heights_m or (-math.inf, math.inf)),
            math.inf if w.max_speed_mps is None else w.max_speed_mps,
        )
        for w in scenario.waypoints
    ]
    return np.array(rows, dtype=WAYPOINT_DTYPE)


def again_steps(scenario: Scenario) -> NDArray[np.int64]:
    """See `Arena.again_steps`."""
    if not scenario.asks_again:
        return np.zeros(0, dtype=np.int64)
    gaps_s = (w.again_after_s for w in scenario.waypoints)
    return np.array([steps_until(each[0], scenario.dt_s) if each else 0 for each in gaps_s])


def sensors_of(scenario: Scenario, uas: Uas) -> int:
    """The bits of the sensors that a UAS carries and a waypoint asks for."""
    bits = _sensor_bits(scenario)
    return sum(bits.get(sensor.name, 0) for sensor in uas.sensors)


def _sensor_bits(scenario: Scenario) -> dict[str, int]:
    """A bit for each sensor that is asked for and carried."""
    carried = {sensor.name for uas in scenario.uas for sensor in uas.sensors}
    asked = {waypoint.sensor for waypoint in scenario.waypoints}
    return {name: 1 << n for n, name in enumerate(sorted(carried & asked))}


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
