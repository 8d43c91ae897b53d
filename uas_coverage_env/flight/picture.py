"""The picture of a flight: the map at a sample, with everything flown until then."""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.draw import picture
from uas_coverage_env.flight.record import LANDED, LOST, Flight
from uas_coverage_env.world import FLYING, SwarmState
from uas_coverage_env.world import LANDED as HAS_LANDED
from uas_coverage_env.world import LOST as IS_LOST

_SIZE_PX = 900


def flight_picture(
    flight: Flight, step: int | None = None, size_px: int = _SIZE_PX
) -> NDArray[np.uint8]:
    """The map at a sample, with the paths flown and planned.

    Args:
        flight: the flight.
        step: number of the sample; the last by default.
        size_px: side of the square picture.

    Returns:
        (size_px, size_px, 3) red, green, blue.

    Raises:
        ValueError: the flight has no such sample.
    """
    last = flight.steps
    now = last if step is None else step
    if not 0 <= now <= last:
        raise ValueError(f"step is {step}; the flight has samples 0 to {last}")
    status = np.full(len(flight.names), FLYING)
    status[flight.mode[now] == LANDED] = HAS_LANDED
    status[flight.mode[now] == LOST] = IS_LOST
    swarm = SwarmState(
        time_s=now * flight.scenario.dt_s,
        step=now,
        names=flight.names,
        x=flight.x[now],
        status=status,
        uncovered=_uncovered(flight, now),
        home_m=flight.x[0, :, 0:3],
        moving_position_m=flight.moving_position_m[now],
        moving_velocity_mps=np.zeros_like(flight.moving_position_m[now]),
    )
    paths = flight.x[: now + 1, :, 0:3]
    return picture(
        flight.scenario, swarm, paths_m=paths, planned_m=_planned(flight, now), size_px=size_px
    )


def draw_flight(flight: Flight, path: str | Path, step: int | None = None) -> None:
    """Write `flight_picture` as a PNG."""
    from PIL import Image

    Image.fromarray(flight_picture(flight, step)).save(path)


def _uncovered(flight: Flight, now: int) -> NDArray[np.bool_]:
    """(W,) waypoints that no flying UAS has been within reach of until then."""
    positions = flight.x[: now + 1, :, 0:3]
    alive = flight.mode[: now + 1] < LOST
    result = []
    for waypoint in flight.scenario.waypoints:
        away = np.linalg.norm(positions - np.array(waypoint.position_m), axis=2)
        result.append(not bool(((away <= waypoint.radius_m) & alive).any()))
    return np.array(result)


def _planned(flight: Flight, now: int) -> dict[str, NDArray[np.float64]]:
    rows = flight.plan[flight.plan["step"] == now]
    return {
        name: rows["position_m"][rows["uas"] == i]
        for i, name in enumerate(flight.names)
        if (rows["uas"] == i).any()
    }
