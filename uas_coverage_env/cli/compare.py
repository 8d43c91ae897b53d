"""`uas-coverage compare`: the benchmark, every pair flown, a table with intervals."""

import shlex
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, TextColumn
from rich.progress import Progress as ProgressBar

from uas_coverage_env.cli.options import BackendOption, JobsOption, OverwriteOption
from uas_coverage_env.cli.output import console, one_line
from uas_coverage_env.cli.sweeps import end_with, fly_and_keep, refuse_others
from uas_coverage_env.files.output_dir import write_files
from uas_coverage_env.files.strict_toml import InputError
from uas_coverage_env.leaderboard import (
    FLIGHTS,
    FLOWN,
    Bounds,
    Comparison,
    Entry,
    Row,
    Sweep,
    bounds_of,
    parquet,
    planner_specs_of,
    scenarios_of,
    seed_range,
    write,
)
from uas_coverage_env.leaderboard import table as tables
from uas_coverage_env.runner.jobs import WorkerLostError, Workers
from uas_coverage_env.runner.store import STORE, Store, opened, rows_in
from uas_coverage_env.scenario import Scenario, warnings
from uas_coverage_env.simulation import Dynamics

_REFERENCE = "nearest-waypoint"
_MOST_FLIGHTS = 1_000_000
_NARROWEST_TABLE = 160


def compare(
    scenarios: Annotated[
        list[str],
        typer.Option(
            metavar="WHAT,...",
            help="`village` or another shipped scenario, scenario files, the sets `dev` and "
            "`test` (20 generated scenarios each), `generated:SEED`, `generated:FIRST:END`, "
            "`flood-village:FIRST:END` (maps drawn from the paper's description).",
        ),
    ],
    planners: Annotated[
        list[str],
        typer.Option(
            metavar="NAME,...",
            help="Names (see `planners`) or MODULE:CLASS; LABEL=NAME adds one with other options.",
        ),
    ],
    out: Annotated[Path, typer.Option(help="Directory of the sweep; resumed if it exists.")],
    seeds: Annotated[
        str, typer.Option(metavar="FIRST:END", help="Seeds of the planners.")
    ] = "0:20",
    option: Annotated[
        list[str] | None,
        typer.Option(metavar="PLANNER:KEY=VALUE", help="Option of a planner; may be repeated."),
    ] = None,
    reference: Annotated[
        str | None,
        typer.Option(
            help=f"The planner that the others are compared with; {_REFERENCE}, or the first.",
            show_default=False,
        ),
    ] = None,
    safety_filter: Annotated[
        bool, typer.Option("--filter", help="Switch the safety filter on for all planners.")
    ] = False,
    dynamics: Annotated[
        Dynamics, typer.Option(help="The paper's linear model, or 6-DOF with exact power.")
    ] = "lpv",
    backend: BackendOption = "process",
    jobs: JobsOption = None,
    reuse: Annotated[
        list[Path] | None,
        typer.Option(metavar="DIR", help="Reuse the flights that another sweep has in common."),
    ] = None,
    overwrite: OverwriteOption = False,
    with_parquet: Annotated[
        bool,
        typer.Option("--parquet", help=f"Write {FLIGHTS}, too: the flights (extra `parquet`)."),
    ] = False,
    no_bounds: Annotated[
        bool,
        typer.Option(
            "--no-bounds", help="Leave out the lower bounds: up to a minute for each mission."
        ),
    ] = False,
) -> None:
    """Fly every planner on every scenario with every seed, and compare them.

    Ctrl-C or a kill loses no finished flight: the same command goes on. Decision times are those
    of a machine as busy as `--jobs` makes it. Exits 0 where all flights were flown, 1 where one
    failed (a planner refused the scenario or crashed) or the sweep was stopped.
    """
    sweep = Sweep(
        scenarios_of(scenarios),
        planner_specs_of(planners, option or ()),
        seed_range("--seeds", seeds),
        dynamics,
        safety_filter,
    )
    if sweep.size > _MOST_FLIGHTS:
        raise InputError(
            f"--scenarios, --planners and --seeds ask for {sweep.size} flights; "
            f"give fewer, at most {_MOST_FLIGHTS}"
        )
    reference = _reference(reference, list(sweep.planners))
    if with_parquet:
        parquet(())  # what is not installed is said before anything is flown
    command = _command(
        *("--scenarios", ",".join(scenarios), "--planners", ",".join(planners)),
        *("--seeds", seeds),
        *(part for text in option or () for part in ("--option", text)),
        *(() if reference == _REFERENCE else ("--reference", reference)),
        *(("--filter",) if safety_filter else ()),
        *(() if dynamics == "lpv" else ("--dynamics", dynamics)),
        *(() if backend == "process" else ("--backend", backend)),
        *(() if jobs is None else ("--jobs", str(jobs))),
        *(("--no-bounds",) if no_bounds else ()),
        *(("--parquet",) if with_parquet else ()),
        *("--out", str(out)),
    )
    screen = console()
    entries = list(sweep.entries())
    others = [row for directory in reuse or () for row in rows_in(directory, Row)]
    asked = {"command": "compare", **sweep.description()}
    with (
        Workers(jobs, backend) as workers,
        opened(out, asked, Row, overwrite=overwrite) as store,
    ):
        refuse_others(store, entries)
        _take(others, entries, store)
        _warn(sweep)
        trouble = fly_and_keep(entries, store, workers, screen)
        rows = store.rows()
        if not rows:
            sys.stderr.write("error: nothing was flown\n")
            end_with(rows, trouble)
        skipped = no_bounds or trouble is not None
        bounds = {} if skipped else bounds_shown(rows, sweep.scenarios, screen, workers)
    comparison = Comparison.of(rows, len(entries), reference, command, str(workers), bounds)
    names = [STORE, *write(comparison, out)]
    if with_parquet:
        write_files(out, {FLIGHTS: parquet(rows)})
        names.append(FLIGHTS)
    _report(screen, comparison, out, names)
    end_with(rows, trouble)


def _reference(asked: str | None, labels: Sequence[str]) -> str:
    if asked is None:
        return _REFERENCE if _REFERENCE in labels else labels[0]
    if asked not in labels:
        raise InputError(f"--reference {asked!r}: is none of --planners {','.join(labels)}")
    return asked


def _take(rows: Sequence[Row], entries: Sequence[Entry], store: Store[Row]) -> None:
    """Keep the flights of other sweeps that belong to this one, too."""
    lacking = {entry.key for entry in entries} - store.keys()
    for row in rows:
        if row.key in lacking and row.status == FLOWN:
            store.add(row)
            lacking.remove(row.key)


def bounds_shown(
    rows: Sequence[Row], scenarios: Mapping[str, Scenario], screen: Console, workers: Workers
) -> Bounds:
    """The lower bounds of a sweep, up to a minute each; shows how far they are.

    Ctrl-C leaves them out: what was flown is told of without them.
    """
    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn())
    shown = screen.is_terminal
    with ProgressBar(*columns, console=screen, disable=not shown, transient=True) as bar:
        task = bar.add_task("lower bounds", total=None)

        def told(done: int, total: int) -> None:
            bar.update(task, completed=done, total=total)
            if not shown and done == 0 and total > 1:
                screen.print(f"lower bounds of {total} scenarios")

        try:
            return bounds_of(rows, scenarios, workers, told)
        except (KeyboardInterrupt, WorkerLostError) as error:
            why = "stopped by hand" if isinstance(error, KeyboardInterrupt) else str(error)
            sys.stderr.write(f"warning: lower bounds: {why}; the same command goes on\n")
            return {}


def _warn(sweep: Sweep) -> None:
    for name, scenario in sweep.scenarios.items():
        for warning in warnings(scenario):
            sys.stderr.write(f"warning: {name}: {one_line(warning)}\n")


def _report(screen: Console, comparison: Comparison, out: Path, names: Sequence[str]) -> None:
    rows, scores, reference = comparison.rows, comparison.scores, comparison.reference
    # a truncated table is useless; in a log it is as wide as necessary
    wide = Console(width=max(screen.width, _NARROWEST_TABLE), highlight=False)
    for line in comparison.circumstances():
        screen.print(line, markup=False)
    wide.print(tables.rich_table(tables.outcome_cells(scores), "\nOutcome"))
    wide.print(tables.rich_table(tables.effort_cells(scores), "\nEffort"))
    if len(scores) > 1 and reference in {one.label for one in scores}:
        cells = tables.reference_cells(scores, reference)
        wide.print(tables.rich_table(cells, f"\nAgainst {reference}"))
    for line in tables.notes(rows, reference):
        screen.print(f"\n{line}", markup=False)
    screen.print(f"\n{', '.join(names)} in {out}", markup=False)
    if not any(name.endswith(".png") for name in names):
        screen.print("no picture: python -m pip install 'uas-coverage-env[view]'", markup=False)


def _command(*arguments: str) -> str:
    return shlex.join(["uas-coverage", "compare", *arguments])
