"""`uas-coverage reproduce`: a paper's result section beside ours."""

import shlex
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from uas_coverage_env.cli.options import BackendOption, JobsOption, OverwriteOption

if TYPE_CHECKING:
    from rich.console import Console

    from uas_coverage_baselines.reproduction.comparison import ReproducedPaper
    from uas_coverage_baselines.reproduction.published import Paper
    from uas_coverage_env.flight import Flight
    from uas_coverage_env.leaderboard import Row, Sweep

_PROGRAM_STEP = 60
_WIDEST_TABLE = 200
_QUICK_CAP_S, _CAP_S = 10.0, 120.0


def reproduce(
    paper: Annotated[str, typer.Argument(metavar="PAPER", help="`gasche2025`.")],
    out: Annotated[Path, typer.Option(help="Directory; resumed if it exists.")],
    seeds: Annotated[
        str, typer.Option(metavar="FIRST:END", help="Maps drawn from the paper's description.")
    ] = "0:10",
    quick: Annotated[
        bool,
        typer.Option("--quick", help="Minutes: one drawn map, short solves, fewer parameters."),
    ] = False,
    backend: BackendOption = "process",
    jobs: JobsOption = None,
    steps: Annotated[
        int | None, typer.Option(min=1, help="Stop each flight after this many steps, for a look.")
    ] = None,
    overwrite: OverwriteOption = False,
) -> None:
    """Fly a paper's mission with its settings, and set its figures beside ours.

    Leaves a page, a table (CSV, JSON), the paper's figures and the flights in --out. Ctrl-C or a
    kill loses no finished flight: the same command goes on. Exits 1 where a figure leaves its
    stated tolerance, an event that is told does not happen, or a mission is not accomplished.
    """
    # what follows is heavy, and this module is loaded whenever the command line starts
    from uas_coverage_baselines.reproduction.published import paper_named
    from uas_coverage_env.cli.output import FAILED, console, one_line
    from uas_coverage_env.cli.sweeps import end_with, fly_and_keep, refuse_others
    from uas_coverage_env.leaderboard import Row
    from uas_coverage_env.runner.store import opened
    from uas_coverage_env.runner.workers import Workers

    _need_matplotlib()
    published = paper_named(paper)
    sweep = _sweep(published, seeds, quick, steps)
    command = shlex.join(
        [
            *("uas-coverage", "reproduce", paper),
            *(("--quick",) if quick else ()),
            *(() if seeds == "0:10" else ("--seeds", seeds)),
            *(() if steps is None else ("--steps", str(steps))),
            *("--out", str(out)),
        ]
    )
    screen = console()
    described = {"command": "reproduce", "paper": paper, **sweep.description()}
    entries = list(sweep.entries())
    with (
        Workers(jobs, backend) as workers,
        opened(out, described, Row, overwrite=overwrite) as store,
    ):
        refuse_others(store, entries)
        trouble = fly_and_keep(entries, store, workers, screen, "flight")
        rows = store.rows()
    end_with(rows, trouble)
    flights = _flown(published, rows, out)
    done = _written(published, flights, quick, command, out, screen)
    failures = done.failures()
    for line in failures:
        sys.stderr.write(f"out of tolerance: {one_line(line)}\n")
    if failures:
        raise typer.Exit(FAILED)


def _need_matplotlib() -> None:
    from importlib.util import find_spec

    from uas_coverage_env.files.strict_toml import InputError

    if find_spec("matplotlib") is None:
        raise InputError(
            'the figures need matplotlib: python -m pip install "uas-coverage-env[view]"'
        )


def _sweep(paper: "Paper", seeds: str, quick: bool, steps: int | None) -> "Sweep":
    """The map that stands for the paper's and those drawn, with the paper's planner."""
    from uas_coverage_env.leaderboard import Sweep, planner_specs_of, seed_range
    from uas_coverage_env.scenario import load_scenario
    from uas_coverage_env.scenario.families.flood_village import flood_village

    drawn = seed_range("--seeds", seeds)
    maps = [load_scenario(paper.scenario), *map(flood_village, drawn[:1] if quick else drawn)]
    if steps is not None:
        maps = [one.model_copy(update={"max_steps": min(steps, one.max_steps)}) for one in maps]
    name = paper.planner.name
    options = [f"{name}:{key}={_text(value)}" for key, value in paper.planner.options.items()]
    # no seed of a planner changes anything: it draws nothing
    return Sweep({one.name: one for one in maps}, planner_specs_of([name], options), range(1))


def _text(value: object) -> str:
    return str(value).lower() if isinstance(value, bool) else str(value)


def _flown(paper: "Paper", rows: "Sequence[Row]", out: Path) -> "dict[str, Flight]":
    """The flights that are kept, the one that stands for the paper's first."""
    from uas_coverage_env.flight import Flight
    from uas_coverage_env.leaderboard.flying import kept_as

    ordered = sorted(rows, key=lambda row: (row.scenario != paper.scenario, row.scenario))
    return {row.scenario: Flight.load(out / kept_as(row)) for row in ordered}


def _written(
    paper: "Paper",
    flights: "dict[str, Flight]",
    quick: bool,
    command: str,
    out: Path,
    screen: "Console",
) -> "ReproducedPaper":
    """Solve the programs, write the files and show the tables."""
    from rich.console import Console

    from uas_coverage_baselines.reproduction import page
    from uas_coverage_baselines.reproduction.comparison import ReproducedPaper
    from uas_coverage_baselines.reproduction.decisions import decision, whole_decision
    from uas_coverage_baselines.reproduction.sizes import LEFT_OUT, class_sizes, open_cost, timed
    from uas_coverage_baselines.reproduction.sweeps import FULL, QUICK, trades
    from uas_coverage_env.leaderboard.table import rich_table

    done = ReproducedPaper.of(paper, flights)
    flight, cap_s = flights[paper.scenario], _QUICK_CAP_S if quick else _CAP_S
    step = min(_PROGRAM_STEP, int(flight.last_sample.min()) - 1)
    with screen.status("solving the paper's program with parts of it left out"):
        problem = decision(flight, step)
        scale = open_cost(problem)
        timings = [timed(name, change(problem), cap_s, scale) for name, change in LEFT_OUT.items()]
    with screen.status("solving it under other parameters"):
        tried = list(trades(flight, step, cap_s, QUICK if quick else FULL))
    sizes = class_sizes(whole_decision(flight))
    names = page.write_page(done, sizes, timings, tried, command, out)
    wide = Console(width=max(screen.width, _WIDEST_TABLE), highlight=False)
    wide.print(rich_table(page.figure_cells(done), "Figures"))
    wide.print(rich_table(page.event_cells(done), "\nWhat the text tells"))
    wide.print(rich_table(page.size_cells(sizes), "\nSize of the program"))
    screen.print(f"\n{', '.join(names)} in {out}", markup=False)
    return done
