"""What a flight has left to do, as a mission of its own."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.files.errors import InputError
from uas_coverage_env.files.strict_toml import parse
from uas_coverage_env.flight.record import LANDED, LOST, FlightRecord
from uas_coverage_env.flight.scene_history import SceneHistory
from uas_coverage_env.scenario import MovingObstacle, Scenario

_LONGEST_NAME = 64


def rest_of(flight: FlightRecord, *, from_here: bool = False, name: str | None = None) -> Scenario:
    """The scenario of the waypoints that a flight has not covered, with their weights.

    The scene is that at the end of the flight, whatever events have changed it; events themselves
    are not in it. What was going to be asked for again is asked for at once. UAS that were lost are
    left out.

    Args:
        flight: The flight, simulated or from a log, whole or broken off.
        from_here: UAS in the air go on from where they were, with the charge that they had, and
            land where they were to. Otherwise all are at home with fresh packs, and moving
            obstacles begin anew.
        name: Of the scenario; None: that of the flight with `-rest`.

    Raises:
        InputError: Nothing is left to cover, no UAS is left, or the rest cannot be flown.
    """
    began = flight.scenario
    history = SceneHistory.of(flight)
    known, open_ = history.scenario, history.open_at_end
    for w in np.flatnonzero(history.asked_later).tolist():
        known, open_ = known.asked_again(w), np.append(open_, True)
    if not open_.any():
        raise InputError(f"the flight of {began.name!r} has covered everything; nothing is left")
    alive = np.flatnonzero(flight.mode[-1] != LOST)
    if not len(alive):
        raise InputError(f"no UAS is left of the flight of {began.name!r}")
    data = known.model_dump(mode="json", by_alias=True)
    data["name"] = name or f"{began.name.removesuffix('-rest')[: _LONGEST_NAME - 5]}-rest"
    data["waypoints"] = [data["waypoints"][w] for w in np.flatnonzero(open_)]
    data["uas"] = [data["uas"][i] for i in alive]
    data.pop("events", None)
    for entry in data["uas"]:
        entry["start_m"] = entry.pop("land_m", entry["start_m"])
    if from_here:
        for entry, i in zip(data["uas"], alive.tolist(), strict=True):
            _move_here(entry, flight, i)
        data.pop("from_ground", None)  # the start of one that flies is not above its ground
        time_s = float(flight.time_s[-1])
        data["moving_obstacles"] = [
            _from_then(obstacle, position_m, time_s)
            for obstacle, position_m in zip(
                known.moving_obstacles, known.moving_positions(time_s), strict=True
            )
        ]
    return parse(data, Scenario, f"the rest of {began.name!r}")


def _move_here(entry: dict[str, Any], flight: FlightRecord, i: int) -> None:
    """Put a UAS where it was with what it had; it lands where it was to."""
    entry["soc_0"] = float(flight.soc[-1, i])
    if flight.mode[-1, i] != LANDED:
        entry["land_m"] = entry["start_m"]
        entry["start_m"] = flight.x[-1, i, :3].tolist()


def _from_then(
    obstacle: MovingObstacle, position_m: NDArray[np.float64], time_s: float
) -> dict[str, Any]:
    """A moving obstacle as it goes on at a time."""
    past = [piece for piece in obstacle.schedule if piece.from_s <= time_s]
    later = [piece for piece in obstacle.schedule if piece.from_s > time_s]
    data = obstacle.model_dump(mode="json")
    data["start_m"] = position_m.tolist()
    data["schedule"] = [
        {"from_s": 0.0, "velocity_mps": list(past[-1].velocity_mps)},
        *(
            {"from_s": piece.from_s - time_s, "velocity_mps": list(piece.velocity_mps)}
            for piece in later
        ),
    ]
    return data
