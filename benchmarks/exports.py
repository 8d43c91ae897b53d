"""Exports of random missions at random places on the Earth, read back by programs not ours.

    python benchmarks/exports.py
    python benchmarks/exports.py --missions 20

Each mission is a generated scenario, flown by `nearest-waypoint`; every tenth lies on the date line
and every tenth at a pole. MAVSDK (C++) reads the .plan, pymavlink the .waypoints, geographiclib
turns degrees into metres again (the export uses PROJ). Every corner has to be where the legs have
it within 1 cm.

Exits 0 where it is, 1 otherwise. Needs the extras `ops` and `test`.
"""

from __future__ import annotations

import json
import math
import sys
import tempfile
import warnings
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer
from geographiclib.geodesic import Geodesic
from mavlink_vehicle import Bench
from numpy.typing import NDArray
from pymavlink import mavwp

from uas_coverage_env import generate_scenario, load_planner, rollout
from uas_coverage_env.operations import ExportOptions, make_export
from uas_coverage_env.operations.mission_export.lay_tracks import make_tracks
from uas_coverage_env.operations.mission_export.tracks import Tolerances
from uas_coverage_env.scenario import Place

WITH_PLACE = (16, 21, 22)
MOST_OFF_M = 0.01
_RELATIVE = 3


def place_of(number: int, rng: np.random.Generator) -> Place:
    """Somewhere on the Earth."""
    latitude, longitude = rng.uniform(-90.0, 90.0), rng.uniform(-180.0, 180.0)
    if number % 10 == 0:
        longitude = 179.999 * (1 if number % 20 else -1)
    elif number % 10 == 5:
        latitude = 90.0 if number % 20 == 5 else -89.999
    return Place(
        latitude_deg=round(latitude, 7),
        longitude_deg=round(longitude, 7),
        height_m=round(rng.uniform(0.0, 3_000.0), 2),
    )


def metres(latitude: float, longitude: float, height: float, place: Place) -> NDArray[np.float64]:
    """North, east, down [m] by geodesics."""
    line = Geodesic.WGS84.Inverse(place.latitude_deg, place.longitude_deg, latitude, longitude)
    azimuth = math.radians(line["azi1"])
    return np.array([line["s12"] * math.cos(azimuth), line["s12"] * math.sin(azimuth), -height])


def waypoints_of(path: Path) -> list[Any]:
    """The items of a .waypoints file as pymavlink reads them; the first is home."""
    loader: Any = mavwp.MAVWPLoader()
    with warnings.catch_warnings():  # it leaves the file open
        warnings.simplefilter("ignore", ResourceWarning)
        loader.load(str(path))
    return [loader.wp(n) for n in range(loader.count())]


def off_m(found: list[tuple[float, float, float]], wanted: Any, place: Place) -> float:
    """Largest distance of places from where they should be [m]; infinite where some are missing."""
    if len(found) != len(wanted):
        return math.inf
    pairs = zip(found, wanted, strict=True)
    return max(float(np.linalg.norm(metres(*one, place) - other)) for one, other in pairs)


def check(
    number: int, bench: Bench, folder: Path, rng: np.random.Generator
) -> tuple[int, float, float]:
    """Corners of one mission, and how far they are off in .plan and .waypoints [m]."""
    scenario = generate_scenario(
        seed=2_000_000 + number,
        n_uas=int(rng.integers(1, 4)),
        n_waypoints=int(rng.integers(4, 13)),
        n_obstacles=int(rng.integers(0, 6)),
    )
    flight = rollout(scenario, load_planner("nearest-waypoint"), 0)
    place, tolerances = place_of(number, rng), Tolerances()
    files: dict[str, str] = {}
    for kind in ("qgc", "ardupilot"):
        options = ExportOptions(kind, min_slack_s=0.0, place=place)
        files |= make_export(flight, options).files
    corners, worst_plan, worst_text = 0, 0.0, 0.0
    for i, uas in enumerate(scenario.uas):
        tracks = make_tracks(flight, i, tolerances)
        if not tracks:
            continue
        (track,) = tracks
        wanted = [*track.corners_m, np.array(track.home_m)]
        items = bench.read_plan(files[f"{uas.name}.plan"]).mission_items
        of_plan = [
            (item.x / 1e7, item.y / 1e7, item.z)
            for item in items
            if item.command in WITH_PLACE and item.frame == _RELATIVE
        ]
        path = folder / "file.waypoints"
        path.write_text(files[f"{uas.name}.waypoints"])
        entries = waypoints_of(path)[1:]
        of_text = [(e.x, e.y, e.z) for e in entries if e.command in WITH_PLACE]
        corners += len(wanted)
        worst_plan = max(worst_plan, off_m(of_plan, wanted, place))
        worst_text = max(worst_text, off_m(of_text, wanted, place))
    return corners, worst_plan, worst_text


def main(
    missions: Annotated[int, typer.Option(min=1, help="How many.")] = 500,
    out: Annotated[Path | None, typer.Option(help="JSON file for the figures.")] = None,
) -> None:
    """Read exports back and compare."""
    rng = np.random.default_rng(0)
    bench = Bench()
    try:
        with tempfile.TemporaryDirectory() as folder:
            rows = [check(n, bench, Path(folder), rng) for n in range(missions)]
    finally:
        bench.close()
    corners = sum(row[0] for row in rows)
    plan_m, text_m = (max(row[k] for row in rows) for k in (1, 2))
    print(
        f"{missions} missions, {corners} corners; farthest off: {100 * plan_m:.2f} cm (.plan by "
        f"MAVSDK), {100 * text_m:.2f} cm (.waypoints by pymavlink)"
    )
    if out:
        figures = {"missions": missions, "corners": corners, "plan_m": plan_m, "text_m": text_m}
        out.write_text(json.dumps(figures) + "\n")
    sys.exit(int(max(plan_m, text_m) > MOST_OFF_M))


if __name__ == "__main__":
    typer.run(main)
