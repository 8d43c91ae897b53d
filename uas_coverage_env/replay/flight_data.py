"""What a replay page knows of a flight: its series as whole numbers, which are short in JSON."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.draw import colours
from uas_coverage_env.files.strict_toml import InputError
from uas_coverage_env.flight import MODES, Flight
from uas_coverage_env.flight.figure import NOTHING
from uas_coverage_env.flight.figures import printed
from uas_coverage_env.flight.metrics import energy_until_Wh
from uas_coverage_env.flight.scene_history import SceneHistory
from uas_coverage_env.flight.seen import seen_pictures
from uas_coverage_env.replay.home_data import way_home
from uas_coverage_env.replay.mark_data import marks
from uas_coverage_env.replay.reach_data import reach
from uas_coverage_env.replay.runs import mode_runs
from uas_coverage_env.replay.safety_data import floors_m, rooms
from uas_coverage_env.replay.scene_data import scene_data
from uas_coverage_env.scenario import Scenario
from uas_coverage_env.vehicle.layout import DOD

POSITION_M = 0.01
PLAN_M = 0.1
ANGLE_RAD = 0.001
SOC = 0.0001
ENERGY_Wh = 0.001
VOLTAGE_V = 0.001
CURRENT_A = 0.01
DURATION_S = 0.00001
ROOM_M = 0.01
FLOOR_M = 0.1
SEEN_M = 0.1
SHARE = 0.0001

_OUTCOME = ("steps", "energy_Wh", "all_home", "breaches")
"""Figures of the line below the title; all of them are in a table that opens."""


def flight_data(flight: Flight, source: str) -> dict[str, Any]:
    """A flight as plain data for the viewer (`viewer/src/flight_data.ts` has its types).

    A series is `{"unit": u, "values": [whole numbers]}`, the value being their product; its axes
    are, slowest first, time T, UAS U (or moving obstacles M), and components.

    Args:
        flight: The flight.
        source: What mistakes call it: its directory.

    Raises:
        InputError: A value of the flight is not finite, so that it has no place in a picture.
    """
    durations_s = np.array([decision.duration_s for decision in flight.decisions])
    series = {
        "position": (flight.x[..., 0:3], POSITION_M),
        "attitude": (flight.attitude_rad, ANGLE_RAD),
        "soc": (1.0 - flight.x[..., DOD], SOC),
        "energy": (energy_until_Wh(flight), ENERGY_Wh),
        "voltage": (flight.voltage_V, VOLTAGE_V),
        "current": (flight.current_A, CURRENT_A),
        "duration": (durations_s, DURATION_S),
    }
    flown = {name: _series(values, unit, name, source) for name, (values, unit) in series.items()}
    # of values that are finite, as is known now
    history = SceneHistory.of(flight)
    flown["moving"] = _series(history.moving_position_m, POSITION_M, "moving", source)
    home, room = way_home(flight, history), rooms(flight, history)
    return {
        "planner": flight.planner,
        "seed": flight.seed,
        "dynamics": flight.dynamics,
        "dt_s": flight.scenario.dt_s,
        "samples": len(flight.x),
        "scene": scene_data(history),
        **flown,
        "needed": _series(home.needed_soc, SOC, "charge for the way home", source),
        "floor": _series(floors_m(flight, history), FLOOR_M, "roofs", source),
        "modes": list(MODES),
        "mode_runs": [list(mode_runs(flight, i)) for i in range(len(flight.names))],
        "last": flight.last_sample.tolist(),
        "covered": flight.covered.tolist(),
        "covered_at": history.covered_at.tolist(),
        "fallbacks": [k for k, decision in enumerate(flight.decisions) if decision.fallback],
        "plan": {"unit": PLAN_M, "steps": _plan(flight, source)},
        "reach": _reaches(history, source),
        "seen": _seen(flight, source),
        "room": {kind: _series(room_m, ROOM_M, kind, source) for kind, (room_m, _) in room.items()},
        "min_height_m": flight.scenario.min_height_m,
        "no_return": list(home.no_return),
        "least_spare": [[sample, round(spare, 4)] for sample, spare in home.least_spare],
        "marks": marks(flight, history, room, home),
        "violations": flight.figures["violations"],
        "summary": {name: flight.figures[name] for name in _OUTCOME},
        "figures": [[name, text] for name, text in printed(flight).items() if text != NOTHING],
    }


def _reaches(history: SceneHistory, source: str) -> list[dict[str, Any]]:
    """One for each scene with other obstacles or homes, with the sample from which it holds."""
    found: list[dict[str, Any]] = []
    before = None
    for since, scenario in history.changes:
        what_matters = (scenario.obstacles, scenario.uas)
        if what_matters != before:
            before = what_matters
            found.append({"from": since, **_reach(scenario, source)})
    return found


def _reach(scenario: Scenario, source: str) -> dict[str, Any]:
    found = reach(scenario)
    axes = {
        name: [round(float(values[0]), 2), round(float(values[1] - values[0]), 4), len(values)]
        for name, values in (("north", found.north_m), ("east", found.east_m))
    }
    return {
        **axes,
        "height": found.height_m,
        "needed": _series(found.needed_soc, SOC, "charge for the way home", source),
        "per_m": found.per_m.tolist(),
        "fixed": found.fixed.tolist(),
    }


def _seen(flight: Flight, source: str) -> list[dict[str, Any]]:
    """By camera, the pictures with new ground: corners as north, east, north, east, ..."""
    return [
        {
            "sensor": seen.sensor,
            "colour": colours.hex_of(colours.SEEN[n % len(colours.SEEN)]),
            "sample": seen.sample.tolist(),
            "corners": _series(seen.corners_m, SEEN_M, "ground seen", source),
            "share": _series(seen.share, SHARE, "ground seen", source),
        }
        for n, seen in enumerate(seen_pictures(flight))
    ]


def _series(values: NDArray[np.float64], unit: float, name: str, source: str) -> dict[str, Any]:
    return {"unit": unit, "values": _whole(values, unit, name, source).ravel().tolist()}


def _whole(values: NDArray[np.float64], unit: float, name: str, source: str) -> NDArray[np.int64]:
    # far beyond what a scenario can hold, and well within what a browser counts exactly
    if not (np.abs(values) < 1e9).all():
        raise InputError(f"{source}: {name} holds a value that is not finite; fly it again")
    return np.rint(values / unit).astype(np.int64)


def _plan(flight: Flight, source: str) -> list[list[list[int]]]:
    """[step][uas] -> x, y, z, x, y, z, ... of the predicted positions; a step without: []."""
    plan = flight.plan
    whole = _whole(plan["position_m"], PLAN_M, "plan.csv", source)
    flown, uas = len(flight.x), len(flight.names)
    if len(plan) and not (plan["step"].min() >= 0 and plan["step"].max() < flown):
        raise InputError(f"{source}: plan.csv predicts at a time that was not flown")
    steps: list[list[list[int]]] = [[] for _ in range(flown)]
    order = np.lexsort((plan["n"], plan["uas"], plan["step"]))
    of_step = plan["step"][order]
    for rows in np.split(order, np.flatnonzero(np.diff(of_step)) + 1) if len(plan) else ():
        k = plan["step"][rows[0]]
        steps[k] = [whole[rows[plan["uas"][rows] == i]].ravel().tolist() for i in range(uas)]
    return steps
