"""The picture of a flight: the map at a sample, with everything flown until then."""

from collections.abc import Iterable, Iterator
from io import BytesIO
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.draw import Picture
from uas_coverage_env.draw.signs import legend
from uas_coverage_env.entities.state import FLYING
from uas_coverage_env.entities.state import LANDED as HAS_LANDED
from uas_coverage_env.entities.state import LOST as IS_LOST
from uas_coverage_env.files.plain_files import write_atomically
from uas_coverage_env.flight.flight import Flight
from uas_coverage_env.flight.record import LANDED, LOST
from uas_coverage_env.flight.scene_history import SceneHistory
from uas_coverage_env.world import SwarmState

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
    return next(flight_pictures(flight, [now], size_px))


def flight_pictures(
    flight: Flight, steps: Iterable[int], size_px: int = _SIZE_PX
) -> Iterator[NDArray[np.uint8]]:
    """The maps at several samples, as `flight_picture`; the background is drawn only once.

    Args:
        flight: the flight.
        steps: numbers of the samples, each from 0 to `flight.steps`.
        size_px: side of the square pictures.

    Yields:
        (size_px, size_px, 3) red, green, blue.
    """
    history = SceneHistory.of(flight)
    scenario, _ = history.scene_at(0)
    pictures = Picture(scenario, size_px=size_px)
    for now in steps:
        present, there = history.scene_at(now)
        if present is not scenario:
            scenario, pictures = present, Picture(present, size_px=size_px)
        moving_m = history.moving_m(now)
        yield pictures.draw(
            _swarm(flight, now, history.covered_at[there] > now, history.home_m[now], moving_m[-1]),
            paths_m=flight.x[: now + 1, :, 0:3],
            planned_m=_planned(flight, now),
            moving_paths_m=moving_m,
        )


def draw_flight(flight: Flight, path: str | Path, step: int | None = None) -> None:
    """Write `flight_picture` with a legend under it as a PNG."""
    from PIL import Image

    now = flight.steps if step is None else step
    history = SceneHistory.of(flight)
    scenario, there = history.scene_at(now)
    signs = _signs(flight, now, history.covered_at[there] <= now, history.moving_m(now))
    pixels = np.vstack([flight_picture(flight, step), legend(scenario, signs, _SIZE_PX)])
    content = BytesIO()
    Image.fromarray(pixels).save(content, format="png")
    write_atomically(Path(path), content.getvalue())


def _signs(
    flight: Flight, now: int, covered: NDArray[np.bool_], moving_m: NDArray[np.float64]
) -> set[str]:
    """Which signs of the legend are on the picture of a sample."""
    weights = {point.weight for point in flight.scenario.waypoints}
    mode = flight.mode[now]
    there = {
        "open": not covered.all(),
        "covered": covered.any(),
        "heavy": len(weights) > 1,
        "home": True,
        "flying": not np.isin(mode, (LANDED, LOST)).all(),
        "landed": (mode == LANDED).any(),
        "lost": (mode == LOST).any(),
        "flown": now > 0,
        "planned": bool(_planned(flight, now)),
        "moving": bool(moving_m.size),
        "kept_off": bool(moving_m.size),
        "moved": bool((moving_m != moving_m[:1]).any()),
    }
    return {sign for sign, is_there in there.items() if is_there}


def _swarm(
    flight: Flight,
    now: int,
    uncovered: NDArray[np.bool_],
    home_m: NDArray[np.float64],
    moving_m: NDArray[np.float64],
) -> SwarmState:
    status = np.full(len(flight.names), FLYING)
    status[flight.mode[now] == LANDED] = HAS_LANDED
    status[flight.mode[now] == LOST] = IS_LOST
    return SwarmState(
        time_s=now * flight.scenario.dt_s,
        step=now,
        names=flight.names,
        x=flight.x[now],
        reference_mps=np.zeros((len(flight.names), 2)),
        status=status,
        departed=np.zeros(len(status), dtype=np.bool_),
        returning=np.zeros(len(status), dtype=np.bool_),
        uncovered=uncovered,
        home_m=home_m,
        moving_position_m=moving_m,
        moving_velocity_mps=np.zeros_like(moving_m),
        responds=np.ones(len(status), dtype=np.bool_),
    )


def _planned(flight: Flight, now: int) -> dict[str, NDArray[np.float64]]:
    rows = flight.plan[flight.plan["step"] == now]
    return {
        name: rows["position_m"][rows["uas"] == i]
        for i, name in enumerate(flight.names)
        if (rows["uas"] == i).any()
    }
