"""By how much a mission's clearances are tightened: tubes around what UAS are predicted to fly."""

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.scenario import Scenario
from uas_coverage_env.vehicle.tube import tube_of

UNKNOWN = 0.7
"""Where disturbances act, at least this share of what routes keep is kept more from everything:
less than all of it, so that no route is closed [-]."""


def tubes_m(
    scenario: Scenario, steps: int, disturbed: bool, route_margin_m: float
) -> NDArray[np.float64]:
    """How far each UAS may be from where it is predicted to be.

    For the wind that the scenario's conditions state: the exact bound of every wind that departs by
    no more than stated from what is believed when the prediction begins. Where something acts of
    which nothing is stated, UNKNOWN of what routes keep at all times; where nothing acts, nothing.

    Args:
        scenario: The scenario.
        steps: How far predictions go.
        disturbed: Whether anything acts that the scenario does not say.
        route_margin_m: What routes keep in still air [m].

    Returns:
        (U, steps + 1) [m] horizontally, after each step; it does not shrink.
    """
    unknown_m = UNKNOWN * route_margin_m
    result = np.full((len(scenario.uas), steps + 1), unknown_m if disturbed else 0.0)
    conditions = scenario.conditions
    if conditions is None:
        return result
    for tube_m, vehicle in zip(result, scenario.vehicles, strict=True):
        tube = tube_of(vehicle, scenario.dt_s, steps, learns=True)
        tube_m[:] = np.maximum(unknown_m, conditions.unknown_mps * tube.position)
    return result


def route_tube_m(tubes: NDArray[np.float64], route_margin_m: float) -> float:
    """What routes keep more than in still air: the largest horizontal tube beyond what is unknown.

    What is unknown is less than what routes keep in still air [m].
    """
    return max(float(tubes[:, -1].max()) - UNKNOWN * route_margin_m, 0.0)
