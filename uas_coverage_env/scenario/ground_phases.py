"""Take-off from the ground before the first sample, and landing on it after the last.

The paper's missions begin and end in the air. With `from_ground` a UAS stands on the ground with
its `soc_0`, climbs to its start before t = 0, and descends from where it has landed in the air;
then the motors are off.
"""

from collections.abc import Sequence

import numpy as np

from uas_coverage_env.scenario.unchecked import UncheckedScenario
from uas_coverage_env.vehicle.battery import BatteryState, further_settled_V
from uas_coverage_env.vehicle.vertical_flight import VerticalFlight, vertical_flight


def height_above_ground_m(scenario: UncheckedScenario, position_m: Sequence[float]) -> float:
    """How far a place is above the ground (z = 0), or above the roof that is below it [m]."""
    height_m = max(-position_m[2], 0.0)
    for hull in scenario.hulls:
        upper = hull.normals[:, 2] < -1e-9
        over_m = hull.face_distances(position_m)[upper] / -hull.normals[upper, 2]
        roof_m = float(over_m.max())
        below = np.add(position_m, (0.0, 0.0, roof_m))
        if roof_m >= 0.0 and hull.signed_distance(below) < 1e-6:
            height_m = min(height_m, roof_m)
    return height_m


def take_off(
    scenario: UncheckedScenario, i: int, position_m: Sequence[float] | None = None
) -> VerticalFlight:
    """From the ground to the start of UAS i, or to another place."""
    uas, vehicle = scenario.uas[i], scenario.vehicles[i]
    height_m = height_above_ground_m(scenario, uas.start_m if position_m is None else position_m)
    climb_mps = -vehicle.limits.v_up_max_mps
    rested = BatteryState.rested(vehicle.battery, 1.0 - uas.soc_0)
    return vertical_flight(vehicle, height_m, climb_mps, rested)


def landing(
    scenario: UncheckedScenario, i: int, position_m: Sequence[float], dod: float, u_th_V: float
) -> VerticalFlight:
    """From where UAS i has landed in the air to the ground; further RC pairs as in a hover."""
    vehicle = scenario.vehicles[i]
    height_m = height_above_ground_m(scenario, position_m)
    battery = BatteryState(dod, (u_th_V, *further_settled_V(vehicle)))
    return vertical_flight(vehicle, height_m, vehicle.limits.v_down_max_mps, battery)
