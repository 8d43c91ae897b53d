"""The paper's table of parameters, read back from a flight."""

import inspect
from collections.abc import Callable, Mapping

from uas_coverage_env.flight import Flight
from uas_coverage_env.vehicle import linear_model
from uas_coverage_env.vehicle.layout import DOD

_ORDER = inspect.signature(linear_model).parameters["order"].default


def _start(uas: int) -> Callable[[Flight], tuple[float, ...]]:
    return lambda flight: tuple(float(value) for value in flight.x[0, uas, :3])


def _dod(uas: int) -> Callable[[Flight], tuple[float, ...]]:
    return lambda flight: (float(flight.x[0, uas, DOD]),)


def _option(name: str, default: float | None = None) -> Callable[[Flight], tuple[float, ...]]:
    def read(flight: Flight) -> tuple[float, ...]:
        value = flight.planner_options.get(name, default)
        return () if value is None else (float(value),)

    return read


FLOWN: Mapping[str, Callable[[Flight], tuple[float, ...]]] = {
    "N": _option("horizon"),
    "dt": lambda flight: (flight.scenario.dt_s,),
    "N_dis": _option("taylor_order", _ORDER),
    "N_step,max": lambda flight: (float(flight.scenario.max_steps),),
    "N_UAS": lambda flight: (float(len(flight.scenario.uas)),),
    # the paper counts what moves among the obstacles
    "N_O": lambda flight: (
        float(len(flight.scenario.obstacles) + len(flight.scenario.moving_obstacles)),
    ),
    "N_MO": lambda flight: (float(len(flight.scenario.moving_obstacles)),),
    "N_WP": lambda flight: (float(len(flight.scenario.waypoints)),),
    "H_O": _option("obstacle_sides"),
    "H_P": _option("limit_sides"),
    "H_WP": _option("waypoint_sides"),
    "p_0^1": _start(0),
    "p_0^2": _start(1),
    "DoD_0^1": _dod(0),
    "DoD_0^2": _dod(1),
    "DoD_max": lambda flight: tuple({uas.dod_max for uas in flight.scenario.uas}),
}
"""The paper's symbol -> how it is read; empty where a flight does not tell."""


def flown_setting(symbol: str, flight: Flight) -> tuple[float, ...]:
    """What a flight was flown with."""
    return FLOWN[symbol](flight)
