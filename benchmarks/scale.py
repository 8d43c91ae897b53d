"""`trajectory` on larger and larger missions: the first plan, the decisions, and the memory.

    python benchmarks/scale.py                                  generated towns up to 32 UAS
    python benchmarks/scale.py --sizes 2x50,32x256 --no-fly     first plans only
    python benchmarks/scale.py --figure scale.png
    python benchmarks/scale.py --sizes 100x5000 --side-m 2600   of a denser town

All UAS start in the west: with 5000 waypoints as far apart as usual, no battery lasts to the east.

A size is UAS x waypoints; there is one obstacle for every six waypoints, 60 at most, and the area
grows with the waypoints. The first plan is made in a process of its own, which has compiled
everything before; wall seconds are those of a machine with nothing else to do, processor seconds
are much the same on a busy one.
"""

from __future__ import annotations

import resource
import sys
import time
from collections.abc import Mapping
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import matplotlib.pyplot as plt
import numpy as np
import typer
from rich.console import Console
from rich.table import Table

from uas_coverage_env import MissionBrief, Scenario, load_planner, rollout
from uas_coverage_env.files.strict_toml import InputError
from uas_coverage_env.flight.figures import summary
from uas_coverage_env.scenario import generate_scenario

console = Console(width=150)
_SIZES = "2x25,2x50,4x100,8x100,8x250,16x256,32x256,16x1000,32x1000"
_MOST_OBSTACLES = 60


@dataclass(frozen=True)
class Measured:
    """One size.

    Attributes:
        scenario: Its name.
        n_uas: U.
        n_waypoints: W.
        cpu_s: Processor seconds of the first plan.
        wall_s: Likewise, wall clock.
        n_flying: UAS that fly.
        n_left_out: Waypoints that no plan visits.
        n_without: UAS with waypoints but without a verified flight.
        longest_s: Flight time of the UAS that lands last.
        peak_MB: Of memory, of the process.
        flown: Summary of the flight, where it was flown.
    """

    scenario: str
    n_uas: int
    n_waypoints: int
    cpu_s: float
    wall_s: float
    n_flying: int
    n_left_out: int
    n_without: int
    longest_s: float
    peak_MB: float  # noqa: N815
    flown: dict[str, Any] | None


def town(n_uas: int, n_waypoints: int, seed: int, side_m: float | None = None) -> Scenario:
    """The mission of a size."""
    n_obstacles = min(n_waypoints // 6, _MOST_OBSTACLES)
    return generate_scenario(seed, n_uas, n_waypoints, n_obstacles, side_m, min_height_m=3.0)


def measure(
    n_uas: int,
    n_waypoints: int,
    seed: int,
    side_m: float | None,
    options: Mapping[str, Any],
    flies: bool,
) -> Measured:
    """Plan, and fly, one mission; for a process of its own."""
    scenario = town(n_uas, n_waypoints, seed, side_m)
    brief = MissionBrief.of(scenario)
    planner: Any = load_planner("trajectory", options)
    planner.warm_up(MissionBrief.of(town(2, 20, seed)))
    cpu_s, wall_s = time.process_time(), time.perf_counter()
    planner.reset(brief, 0)
    cpu_s, wall_s = time.process_time() - cpu_s, time.perf_counter() - wall_s
    plan = planner.mission_plan
    flown = summary(rollout(scenario, load_planner("trajectory", options))) if flies else None
    longest = max((p.flight.steps for p in plan.planned.values()), default=0)
    return Measured(
        scenario.name,
        n_uas,
        n_waypoints,
        cpu_s,
        wall_s,
        len(plan.planned),
        len(plan.order.left_out),
        len(plan.troubles),
        brief.dt_s * longest,
        resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0,
        flown,
    )


def show(rows: list[Measured]) -> None:
    """Print one line for each size."""
    table = Table(
        *("UAS", "waypoints", "first plan, s CPU", "s", "flying", "left out", "without", "longest"),
        *("MB", "accomplished", "harm", "Wh", "p50 ms", "p95 ms", "max ms"),
        title="trajectory by size",
    )
    for row in rows:
        cells = [str(row.n_uas), str(row.n_waypoints), f"{row.cpu_s:.2f}", f"{row.wall_s:.2f}"]
        cells += [str(row.n_flying), str(row.n_left_out), str(row.n_without)]
        cells += [f"{row.longest_s:.0f} s", f"{row.peak_MB:.0f}"]
        one = row.flown
        if one is not None:
            done = one["coverage"] == 1.0 and one["all_home"] and not one["violations"]
            cells += ["yes" if done else "no", f"{len(one['violations'])}, {one['breaches']}"]
            times = (1e3 * one["decision_processor_s"][name] for name in ("p50", "p95", "max"))
            cells += [f"{one['energy_Wh']:.1f}", *(f"{ms:.1f}" for ms in times)]
        table.add_row(*cells)
    console.print(table)


def draw(rows: list[Measured], path: Path) -> None:
    """The first plan's processor time over the size, both logarithmic."""
    figure, axes = plt.subplots(figsize=(5.0, 3.4), layout="constrained")
    size = np.array([row.n_waypoints for row in rows], float)
    seconds = np.array([row.cpu_s for row in rows])
    axes.loglog(size, seconds, "o")
    for row in rows:
        axes.annotate(
            f"{row.n_uas} UAS",
            (row.n_waypoints, row.cpu_s),
            textcoords="offset points",
            xytext=(5, 3),
            fontsize=8,
        )
    span = np.array([size.min(), size.max()])
    axes.loglog(span, np.median(seconds / size) * span, "--", lw=1, label="linear")
    axes.set_xlabel("waypoints")
    axes.set_ylabel("first plan, processor seconds")
    axes.legend(frameon=False)
    figure.savefig(path, dpi=150)


def _sizes(text: str) -> list[tuple[int, int]]:
    result = []
    for part in text.split(","):
        n_uas, x, n_waypoints = part.partition("x")
        if not (x and n_uas.isdecimal() and n_waypoints.isdecimal()):
            raise InputError(f"--sizes {part!r}: should be UASxWAYPOINTS, as 2x50")
        result.append((int(n_uas), int(n_waypoints)))
    return result


def main(
    sizes: Annotated[str, typer.Option(help="UASxWAYPOINTS, separated by commas.")] = _SIZES,
    seed: Annotated[int, typer.Option(help="Of the towns.", min=0)] = 1,
    flies: Annotated[bool, typer.Option("--fly/--no-fly", help="Whether to fly, too.")] = True,
    side_m: Annotated[float | None, typer.Option(help="Of the area.")] = None,
    option: Annotated[list[str] | None, typer.Option(help="NAME=VALUE of the planner.")] = None,
    figure: Annotated[Path | None, typer.Option(help="Where to draw the growth.")] = None,
) -> None:
    """Measure each size in a process of its own, and print a table."""
    options = {name: value for name, _, value in (text.partition("=") for text in option or [])}
    rows = []
    for n_uas, n_waypoints in _sizes(sizes):
        with (
            console.status(f"{n_uas} UAS, {n_waypoints} waypoints"),
            ProcessPoolExecutor(1) as alone,
        ):
            try:
                size = n_uas, n_waypoints, seed, side_m
                rows.append(alone.submit(measure, *size, options, flies).result())
            except ValueError as error:
                raise InputError(f"--sizes {n_uas}x{n_waypoints}: {error}") from error
    show(rows)
    if figure is not None:
        draw(rows, figure)


if __name__ == "__main__":
    app = typer.Typer(add_completion=False, pretty_exceptions_enable=False)
    app.command()(main)
    try:
        app()
    except InputError as error:
        sys.stderr.write(f"error: {error}\n")
        sys.exit(2)
