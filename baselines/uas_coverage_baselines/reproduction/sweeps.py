"""The numbers that the paper trades against each other: N, H_O, H_WP, H_P and N_dis."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from uas_coverage_baselines.reproduction.decisions import decision
from uas_coverage_baselines.reproduction.sizes import Timing, open_cost, timed
from uas_coverage_env.flight import Flight
from uas_coverage_env.geometry.round_shapes import inner_factor
from uas_coverage_env.vehicle import linear_model
from uas_coverage_env.vehicle.layout import DOD

_EXACT_ORDER = 16
_HORIZON_STEPS = 18

QUICK: Mapping[str, tuple[int, ...]] = {"N": (12, 18), "H_O": (8,), "H_WP": (4, 8), "H_P": (8, 16)}
FULL: Mapping[str, tuple[int, ...]] = {
    "N": (8, 12, 18, 24, 30),
    "H_O": (4, 8, 16),
    "H_WP": (4, 8, 12),
    "H_P": (8, 16, 32),
}
"""Parameter -> the values that it is given, the others as the paper has them."""

ORDERS = (2, 3, 4, 5, 6)
"""Values of N_dis; no row or column depends on it."""

_OPTIONS = {"N": "horizon", "H_O": "obstacle_sides", "H_WP": "waypoint_sides", "H_P": "limit_sides"}


@dataclass(frozen=True)
class Trade:
    """One value of one parameter: what it costs and what it gives.

    Attributes:
        parameter: Its symbol.
        value: The value.
        timing: How the program was solved; None: it is the same program.
        accuracy: What it gives, in words.
    """

    parameter: str
    value: int
    timing: Timing | None
    accuracy: str


def trades(
    flight: Flight, step: int, cap_s: float, values: Mapping[str, tuple[int, ...]] = FULL
) -> Iterator[Trade]:
    """The decision at a sample of a flight under other parameters, one after the other.

    Args:
        flight: Of the mission.
        step: Number of the sample.
        cap_s: Longest time of a solve [s].
        values: Which to try.
    """
    scale = open_cost(decision(flight, step))
    for parameter, tried in values.items():
        for value in tried:
            problem = decision(flight, step, {_OPTIONS[parameter]: value})
            label, given = f"{parameter} = {value}", _given(parameter, value)
            yield Trade(parameter, value, timed(label, problem, cap_s, scale), given)
    for order in ORDERS:
        error_m = discretisation_error_m(flight, step, order)
        yield Trade("N_dis", order, None, f"off by {error_m:.2g} m after {_HORIZON_STEPS} steps")


def discretisation_error_m(flight: Flight, step: int, order: int) -> float:
    """How far a model of an order ends from an exact one, under inputs that were flown [m].

    Args:
        flight: Whose inputs from a sample on, over the paper's horizon.
        step: Number of the sample.
        order: N_dis.
    """
    uas = int(np.argmax(flight.last_sample))
    vehicle, dt_s = flight.scenario.vehicles[uas], flight.scenario.dt_s
    inputs = flight.u[step : step + _HORIZON_STEPS, uas]
    ends = []
    for tried in (order, _EXACT_ORDER):
        x = flight.x[step, uas].copy()
        model = linear_model(vehicle, float(x[DOD]), dt_s, order=tried)
        for u in inputs:
            x = model.A @ x + model.B @ u + model.E
        ends.append(x[:3])
    return float(np.linalg.norm(ends[0] - ends[1]))


def _given(parameter: str, value: int) -> str:
    if parameter == "N":
        return f"looks {value} steps ahead"
    dimensions = 3 if parameter == "H_WP" else 2
    factor = inner_factor(value, dimensions)
    what = {"H_O": "polygon", "H_WP": "sphere", "H_P": "circle of limits"}[parameter]
    return f"{factor:.1%} of the radius of the {what} is inside"
