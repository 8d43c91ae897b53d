"""`uas-coverage compare`: the benchmark, every pair flown, a table with intervals."""

import shlex
import sys
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, TextColumn, TimeRemainingColumn
from rich.progress import Progress as ProgressBar

from uas_coverage_env.cli.compilation import compilation_shown, compile_flight
from uas_coverage_env.cli.output import DONE, FAILED, console, one_line
from uas_coverage_env.compiled.purpose import compiling_for
from uas_coverage_env.files.strict_toml import InputError
from uas_coverage_env.leaderboard import (
    FLOWN,
    Backend,
    Bounds,
    Comparison,
    Entry,
    Row,
    StoppedError,
    Store,
    Sweep,
    WorkerLostError,
    bounds_of,
    failures,
    flights_in,
    fly_all,
    jobs_of,
    opened,
    planner_specs_of,
    scenarios_of,
    seed_range,
    source_of,
    write,
)
from uas_coverage_env.leaderboard import table as tables
from uas_coverage_env.scenario import Scenario, warnings
from uas_coverage_env.simulation import Dynamics

_REFERENCE = "nearest-waypoint"
_MOST_FLIGHTS = 1_000_000
_SECONDS_BETWEEN_LINES = 5.0
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
    backend: Annotated[
        Backend, typer.Option(help="Processes here, or a Ray cluster (RAY_ADDRESS, else local).")
    ] = "process",
    jobs: Annotated[
        int | None,
        typer.Option(min=1, help="Flights in parallel; default: one per core.", show_default=False),
    ] = None,
    reuse: Annotated[
        list[Path] | None,
        typer.Option(metavar="DIR", help="Reuse the flights that another sweep has in common."),
    ] = None,
    overwrite: Annotated[
        bool, typer.Option("--overwrite", help="Delete the flights in --out.")
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
    side_by_side = jobs_of(jobs, backend)
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
        *("--out", str(out)),
    )
    screen = console()
    entries = list(sweep.entries())
    others = [row for directory in reuse or () for row in flights_in(directory)]
    with opened(out, sweep.description(), overwrite=overwrite) as store:
        _take(others, entries, store)
        _warn(sweep)
        source = source_of(sweep.planners.values())
        trouble = fly_sweep(entries, store, screen, side_by_side, backend, source)
        rows = store.rows()
    if not rows:
        sys.stderr.write(f"error: nothing was flown: {one_line(trouble)}\n")
        raise typer.Exit(FAILED)
    how = f"{_all_or(side_by_side)} side by side"
    bounds = {} if no_bounds else bounds_shown(rows, sweep.scenarios, screen, side_by_side)
    comparison = Comparison.of(rows, len(entries), reference, command, how, bounds)
    names = write(comparison, out)
    _report(screen, comparison, out, names)
    failed = [row for row in rows if row.status != FLOWN]
    for line in [*failures(failed), *([trouble] if trouble else [])]:
        sys.stderr.write(f"error: {one_line(line)}\n")
    raise typer.Exit(FAILED if failed or trouble else DONE)


def _reference(asked: str | None, labels: Sequence[str]) -> str:
    if asked is None:
        return _REFERENCE if _REFERENCE in labels else labels[0]
    if asked not in labels:
        raise InputError(f"--reference {asked!r}: is none of --planners {','.join(labels)}")
    return asked


def _take(rows: Sequence[Row], entries: Sequence[Entry], store: Store) -> None:
    """Keep the flights of other sweeps that belong to this one, too."""
    lacking = {entry.key for entry in entries} - store.keys()
    for row in rows:
        if row.key in lacking and row.status == FLOWN:
            store.add(row)
            lacking.remove(row.key)


def fly_sweep(
    entries: Sequence[Entry],
    store: Store,
    screen: Console,
    jobs: int,
    backend: Backend,
    source_sha256: str,
    keep: Path | None = None,
) -> str:
    """Fly what the store lacks; returns why it did not come to the end, empty where it did.

    Args:
        entries: All that the sweep flies.
        store: Where the rows go.
        screen: Where it shows how far it is.
        jobs: Flights side by side.
        backend: Processes here, or Ray.
        source_sha256: Hash of the source code that flies.
        keep: Folder that gets each flight's directory; None: none is kept.
    """
    kept = store.keys()
    if kept - {entry.key for entry in entries}:
        raise InputError(
            f"{store.path}: was damaged (it holds flights of no sweep, or of another); "
            "give another --out, or add --overwrite to begin anew"
        )
    todo = [entry for entry in entries if entry.key not in kept]
    if todo and backend == "process":
        # here and once, not in every process that flies
        first = todo[0]
        with compilation_shown(), compiling_for("flights"):
            compile_flight(first.scenario, return_mode=True, safety_filter=first.safety_filter)
    try:
        with _shown(screen, len(entries), len(entries) - len(todo)) as told:
            for row in fly_all(todo, jobs, backend, source_sha256, keep):
                store.add(row)
                told(row)
    except (KeyboardInterrupt, StoppedError):
        return "stopped by hand; the same command goes on"
    except WorkerLostError as error:
        return f"{error}; the same command goes on"
    return ""


def bounds_shown(
    rows: Sequence[Row], scenarios: Mapping[str, Scenario], screen: Console, jobs: int
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
            return bounds_of(rows, scenarios, jobs=jobs, told=told)
        except KeyboardInterrupt:
            sys.stderr.write("warning: lower bounds: stopped by hand; the same command goes on\n")
            return {}


@contextmanager
def _shown(screen: Console, total: int, kept: int) -> Iterator[Callable[[Row], object]]:
    """Show how far the sweep is: gives the function to call with each row."""
    if not screen.is_terminal:
        yield _PlainLines(screen, total, kept)
        return
    columns = (
        *(TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn()),
        TimeRemainingColumn(),
    )
    # long flights and short ones take turns: only a long look back tells the speed
    with ProgressBar(*columns, console=screen, speed_estimate_period=3600.0) as bar:
        task = bar.add_task("flying", total=total, completed=kept)

        def told(row: Row) -> None:
            bar.update(task, description=f"{row.scenario} {row.label} {row.seed}", advance=1)

        yield told


class _PlainLines:
    """One line every few seconds, for logs."""

    def __init__(self, out: Console, total: int, kept: int) -> None:
        self._out, self._total, self._kept, self._done = out, total, kept, kept
        self._began = self._last = time.monotonic()
        out.print(f"{kept} of {total} flights are there" if kept else f"{total} flights to fly")

    def __call__(self, row: Row) -> None:
        self._done += 1
        now = time.monotonic()
        if now - self._last >= _SECONDS_BETWEEN_LINES:
            self._last = now
            each_s = (now - self._began) / (self._done - self._kept)
            left_min = each_s * (self._total - self._done) / 60.0
            self._out.print(f"{self._done} of {self._total} flights, {left_min:.1f} min left")


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
    for name in ("outcome", "effort"):
        wide.print(tables.rich_table(tables.cells(scores, name), f"\n{name.capitalize()}"))
    if len(scores) > 1 and reference in {one.label for one in scores}:
        cells = tables.cells(scores, "reference", reference)
        wide.print(tables.rich_table(cells, f"\nAgainst {reference}"))
    for line in tables.notes(rows, reference):
        screen.print(f"\n{line}", markup=False)
    screen.print(f"\n{', '.join(names)} in {out}", markup=False)
    if not any(name.endswith(".png") for name in names):
        screen.print("no picture: python -m pip install 'uas-coverage-env[view]'", markup=False)


def _command(*arguments: str) -> str:
    return shlex.join(["uas-coverage", "compare", *arguments])


def _all_or(jobs: int) -> str:
    return "as many flights as the cluster has cores" if jobs < 0 else f"{jobs} flights"
