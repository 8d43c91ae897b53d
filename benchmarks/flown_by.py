"""Times that flights promise and times of the files made of them, with and without `--flown-by`.

    python benchmarks/flown_by.py
    python benchmarks/flown_by.py --missions 3 --planners tour

`karhula` with its buildings at several heights, in turns with areas of four corners drawn at
random, is imported for one to three UAS, flown and exported; a file's time is that of the leg
model. Deviations are those of single UAS that fly, (file - flight) / flight, as median and range.

Exits 0 where all files planned with `--flown-by autopilot` are within 15 %, 1 otherwise. Needs the
extra `ops`.
"""

from __future__ import annotations

import json
import sys
import tempfile
from pathlib import Path
from typing import Annotated

import numpy as np
import typer

from uas_coverage_env import load_planner, rollout
from uas_coverage_env.files.errors import InputError
from uas_coverage_env.operations import (
    ExportOptions,
    ImportOptions,
    make_export,
    make_scenario,
    read_drawings,
)
from uas_coverage_env.scenario import Scenario

ALLOWED = 0.15


def area(number: int, folder: Path) -> Path:
    """A quadrangle of up to 400 m, as a file."""
    rng = np.random.default_rng(number)
    latitude, longitude = rng.uniform(-60.0, 60.0), rng.uniform(-170.0, 170.0)
    half_m = rng.uniform(80.0, 200.0, (4, 2)) * [(-1, -1), (-1, 1), (1, 1), (1, -1)]
    degrees = half_m / 111_000.0 / [1.0, np.cos(np.radians(latitude))]
    ring = [[longitude + east, latitude + north] for north, east in degrees]
    shape = {"type": "Polygon", "coordinates": [[*ring, ring[0]]]}
    home = {"type": "Point", "coordinates": ring[0]}
    features = [
        {"type": "Feature", "properties": {"role": role}, "geometry": geometry}
        for role, geometry in (("search", shape), ("home", home))
    ]
    path = folder / f"area_{number}.geojson"
    path.write_text(json.dumps({"type": "FeatureCollection", "features": features}))
    return path


def mission(number: int, folder: Path, flown_by: str | None) -> Scenario:
    """An area as a mission of one to three UAS."""
    fleet, name = f"s500_v2:{1 + number % 3}", f"area_{number}"
    if number % 2:
        options = ImportOptions(fleet=fleet, height_m=50.0, flown_by=flown_by)
        return make_scenario(read_drawings([area(number, folder)]), name, options).scenario
    height_m, town = 60.0 + 5.0 * number, Path("karhula")
    options = ImportOptions(fleet=fleet, height_m=height_m, town=town, flown_by=flown_by)
    return make_scenario(read_drawings([town]), name, options).scenario


def deviations(scenario: Scenario, planner: str) -> tuple[list[float], float] | str:
    """Of each UAS's file from its flight, and the time of the longest file [s]; or why none."""
    try:
        made = make_export(rollout(scenario, load_planner(planner)), ExportOptions("qgc"))
    except InputError as error:
        return str(error)
    uas = made.data["uas"]
    off = [one["duration_s"] / one["planned_s"] - 1.0 for one in uas]
    return off, max(one["duration_s"] for one in uas)


def main(
    missions: Annotated[int, typer.Option(help="How many areas.")] = 6,
    planners: Annotated[str, typer.Option(help="Planners.")] = "lawnmower,trajectory,tour",
) -> None:
    """Print the table."""
    print("| planner | --flown-by | files | off the promise, median (range), % | longest file, s |")
    print("|---|---|---|---|---|")
    kept = True
    for planner in planners.split(","):
        for flown_by in (None, "autopilot"):
            off: list[float] = []
            longest_s: list[float] = []
            refused: list[str] = []
            with tempfile.TemporaryDirectory() as folder:
                for number in range(missions):
                    found = deviations(mission(number, Path(folder), flown_by), planner)
                    if isinstance(found, str):
                        refused.append(f"area {number}: {found}")
                    else:
                        off += found[0]
                        longest_s.append(found[1])
            percent = 100.0 * np.array(off)
            spread = f"{np.median(percent):.0f} ({percent.min():.0f} to {percent.max():.0f})"
            print(
                f"| `{planner}` | {flown_by or '-'} | {len(off)} | {spread} | "
                f"{np.median(longest_s):.0f} |",
                flush=True,
            )
            for line in refused:
                print(f"  refused: {line}", file=sys.stderr)
            kept &= flown_by is None or bool((np.abs(percent) <= 100.0 * ALLOWED).all())
    sys.exit(0 if kept else 1)


if __name__ == "__main__":
    typer.run(main)
