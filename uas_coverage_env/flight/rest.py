"""What a flight has left to do, as a mission of its own."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.files.errors import InputError
from uas_coverage_env.files.strict_toml import parse
from uas_coverage_env.flight.record import LANDED, LOST, FlightRecord
from uas_coverage_env.scenario import MovingObstacle, NoFlyZone, Scenario
from uas_coverage_env.world.coverage import covering_samples

_LONGEST_NAME = 64


def rest_of(flight: FlightRecord, *, from_here: bool = False, name: str | None = None) -> Scenario:
    """The scenario of the waypoints that a flight has not covered, with their weights.

    The scene is that at the end of the flight, whatever events have changed it; events themselves
    are not in it. UAS that were lost are left out.

    Args:
        flight: The flight, simulated or from a log, whole or broken off.
        from_here: UAS in the air go on from where they were, with the charge that they had, and
            land where they had started: their homes move there in the first step (`home_closed`).
            Otherwise all are at home with fresh packs, and moving obstacles begin anew.
        name: Of the scenario; None: that of the flight with `-rest`.

    Raises:
        InputError: Nothing is left to cover, no UAS is left, or the rest cannot be flown.
    """
    began = flight.scenario
    known, open_ = _scene(flight)
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
    if from_here:
        data["events"] = []
        for entry, i in zip(data["uas"], alive.tolist(), strict=True):
            data["events"] += _moved_here(entry, flight, i)
        data.pop("from_ground", None)  # the start of one that flies is not above its ground
        time_s = float(flight.time_s[-1])
        data["moving_obstacles"] = [
            _from_then(obstacle, position_m, time_s)
            for obstacle, position_m in zip(
                known.moving_obstacles, known.moving_positions(time_s), strict=True
            )
        ]
    return parse(data, Scenario, f"the rest of {began.name!r}")


def _moved_here(entry: dict[str, Any], flight: FlightRecord, i: int) -> list[dict[str, Any]]:
    """Put a UAS where it was with what it had; the event that gives it its home back, if any."""
    entry["soc_0"] = float(flight.soc[-1, i])
    if flight.mode[-1, i] == LANDED:
        return []
    home_m = entry["start_m"]
    entry["start_m"] = flight.x[-1, i, :3].tolist()
    return [
        {
            "kind": "home_closed",
            "at_s": flight.scenario.dt_s,
            "uas": entry["name"],
            "alternative_m": home_m,
        }
    ]


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


def _scene(flight: FlightRecord) -> tuple[Scenario, NDArray[np.bool_]]:
    """The scenario as events have left it, and (W,) which of its waypoints are open."""
    known = flight.scenario
    since = [0] * len(known.waypoints)
    dropped: set[int] = set()
    names = flight.names
    for record in flight.events:
        event = flight.scenario.events[record.event]
        effect = event.effect()
        if effect.name == "drop":
            dropped.add(int(effect.values[0]))
        if event.changes_scene:
            uas = names.index(record.uas) if record.uas in names else 0
            known = known.after(event, record.time_s, uas)
            sample = round(record.time_s / known.dt_s)
            since += [sample] * (len(known.waypoints) - len(since))
    centres_m = np.array([waypoint.position_m for waypoint in known.waypoints])
    open_ = np.array(
        [
            w not in dropped and not _covered(flight, known, w, since[w])
            for w in range(len(known.waypoints))
        ]
    )
    for obstacle, hull in zip(known.obstacles, known.hulls, strict=True):
        if isinstance(obstacle, NoFlyZone):  # what lies in it is not asked for any more
            open_ &= hull.signed_distance(centres_m) >= 0.0
    return known, open_


def _covered(flight: FlightRecord, known: Scenario, w: int, since: int) -> bool:
    covers = covering_samples(known, w, flight.x[since:])
    return bool((covers & (flight.mode[since:] < LOST)).any())
