"""By how much a mission's clearances are tightened: tubes around what UAS are predicted to fly."""

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.scenario import Scenario
from uas_coverage_env.vehicle.tube import tube_of

UNKNOWN_M = 0.7
"""Where disturbances act, at least this much more is kept from everything: less than the metre that
routes keep, so that no route is closed [m]."""


def tubes_m(scenario: Scenario, steps: int, disturbed: bool) -> NDArray[np.float64]:
    """How far each UAS may be from where it is predicted to be.

    For the wind that the scenario's conditions state: the exact bound of every wind that departs by
    no more than stated from what is believed when the prediction begins. Where something acts of
    which nothing is stated, UNKNOWN_M at all times; where nothing acts, nothing.

    Args:
        scenario: The scenario.
        steps: How far predictions go.
        disturbed: Whether anything acts that the scenario does not say.

    Returns:
        (U, steps + 1) [m] horizontally, after each step; it does not shrink.
    """
    result = np.full((len(scenario.uas), steps + 1), UNKNOWN_M if disturbed else 0.0)
    conditions = scenario.conditions
    if conditions is None:
        return result
    for tube_m, vehicle in zip(result, scenario.vehicles, strict=True):
        tube = tube_of(vehicle, scenario.dt_s, steps, learns=True)
        tube_m[:] = np.maximum(UNKNOWN_M, conditions.unknown_mps * tube.position)
    return result


def route_tube_m(tubes: NDArray[np.float64]) -> float:
    """What routes keep more than in still air: the largest horizontal tube, beyond UNKNOWN_M [m].

    UNKNOWN_M is less than what routes keep in still air.
    """
    return max(float(tubes[:, -1].max()) - UNKNOWN_M, 0.0)
