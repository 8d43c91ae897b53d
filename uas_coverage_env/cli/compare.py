"""`uas-coverage compare`: the benchmark, every pair flown, a table with intervals."""

import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, TextColumn
from rich.progress import Progress as ProgressBar

from uas_coverage_env.cli.options import (
    BackendOption,
    DynamicsOption,
    JobsOption,
    OverwriteOption,
    command_line,
    declared,
)
from uas_coverage_env.cli.output import console, warn
from uas_coverage_env.cli.sweeps import end_with, fly_and_keep, refuse_others
from uas_coverage_env.files.output_dir import write_files
from uas_coverage_env.files.strict_toml import InputError
from uas_coverage_env.leaderboard import (
    Comparison,
    Row,
    Sweep,
    bounds_of,
    planner_specs_of,
    scenarios_of,
    seed_range,
)
from uas_coverage_env.leaderboard import table as tables
from uas_coverage_env.leaderboard.bounds import Bounds
from uas_coverage_env.leaderboard.front import Choice, choices_of, front_cells
from uas_coverage_env.leaderboard.planner_specs import varied_keys
from uas_coverage_env.leaderboard.publish import FLIGHTS, FRONT, parquet
from uas_coverage_env.leaderboard.row import FLOWN
from uas_coverage_env.leaderboard.sweep import Entry
from uas_coverage_env.runner.store import STORE, Store, opened, rows_in
from uas_coverage_env.runner.workers import WorkerLostError, Workers
from uas_coverage_env.scenario import Scenario, warnings

_REFERENCE = "nearest-waypoint"
_MOST_FLIGHTS = 1_000_000
_WIDEST_TABLE = 1000


Scenarios = Annotated[
    list[str],
    typer.Option(
        metavar="WHAT,...",
        help="`village` or another shipped scenario, scenario files, the sets `dev` and `test` "
        "(20 generated scenarios each), `generated:SEED`, `generated:FIRST:END`, "
        "`flood-village:FIRST:END` (maps drawn from the paper's description).",
    ),
]
Planners = Annotated[
    list[str],
    typer.Option(
        metavar="NAME,...",
        help="Names (see `planner list`) or MODULE:CLASS; LABEL=NAME adds one with other options.",
    ),
]
Out = Annotated[Path, typer.Option(help="Directory of the sweep; resumed if it exists.")]
Seeds = Annotated[str, typer.Option(metavar="FIRST:END", help="Seeds of the planners.")]
Options = Annotated[
    list[str] | None,
    typer.Option(metavar="PLANNER:KEY=VALUE", help="Option of a planner; may be repeated."),
]
Vary = Annotated[
    list[str] | None,
    typer.Option(
        metavar="KEY=A,B,...",
        help="Fly the planners with each value of an option, and draw time against energy "
        f"({FRONT}); may be repeated: all combinations. PLANNER:KEY=... varies that of one. "
        "Each flight is kept in OUT/flights.",
    ),
]
Reference = Annotated[
    str | None,
    typer.Option(
        help=f"The planner that the others are compared with; {_REFERENCE}, or the first.",
        show_default=False,
    ),
]
Filter = Annotated[
    bool, typer.Option("--filter", help="Switch the safety filter on for all planners.")
]
Check = Annotated[
    bool,
    typer.Option(
        "--check",
        help="Have each flight judged by the independent checker; what it disagrees with is kept "
        "in OUT/flights.",
    ),
]
Reuse = Annotated[
    list[Path] | None,
    typer.Option(metavar="DIR", help="Reuse the flights that another sweep has in common."),
]
Parquet = Annotated[
    bool, typer.Option("--parquet", help=f"Write {FLIGHTS}, too: the flights (extra `parquet`).")
]
NoBounds = Annotated[
    bool,
    typer.Option(
        "--no-bounds", help="Leave out the lower bounds: up to a minute for each mission."
    ),
]


@dataclass(frozen=True, kw_only=True)
class Asked:
    """What is asked of `compare`; each field is a parameter of the command."""

    context: typer.Context
    scenarios: Scenarios
    planners: Planners
    out: Out
    seeds: Seeds = "0:20"
    option: Options = None
    vary: Vary = None
    reference: Reference = None
    safety_filter: Filter = False
    dynamics: DynamicsOption = "lpv"
    check: Check = False
    backend: BackendOption = "process"
    jobs: JobsOption = None
    reuse: Reuse = None
    overwrite: OverwriteOption = False
    with_parquet: Parquet = False
    no_bounds: NoBounds = False


@declared
def compare(asked: Asked) -> None:
    """Fly every planner on every scenario with every seed, and compare them.

    Ctrl-C or a kill loses no finished flight: the same command goes on. Decision times are those
    of a machine as busy as `--jobs` makes it; processor times are not. Exits 0 where all flights
    were flown, 1 where one failed (a planner refused the scenario or crashed), the check disagrees
    with one, or the sweep was stopped.
    """
    specs = planner_specs_of(asked.planners, asked.option or (), asked.vary or ())
    flown = scenarios_of(asked.scenarios)
    seeds = seed_range("--seeds", asked.seeds)
    sweep = Sweep(flown, specs, seeds, asked.dynamics, asked.safety_filter)
    reference = _reference(asked.reference, list(sweep.planners))
    entries, screen = _entries(sweep), console()
    others = [row for directory in asked.reuse or () for row in rows_in(directory, Row)]
    if asked.with_parquet:
        parquet(())  # what is not installed is said before anything is flown
    described = {"command": "compare", **sweep.description()}
    with (
        Workers(asked.jobs, asked.backend) as workers,
        opened(asked.out, described, Row, overwrite=asked.overwrite) as store,
    ):
        refuse_others(store, entries)
        _take(others, entries, store)
        kept = "flight" if asked.vary else "row"
        trouble = fly_and_keep(entries, store, workers, screen, kept, check=asked.check)
        rows = store.rows()
        skipped = asked.no_bounds or trouble is not None or not rows
        bounds = {} if skipped else bounds_shown(rows, flown, screen, workers)
    if not rows:
        sys.stderr.write("error: nothing was flown\n")
        end_with(rows, trouble)
    fronts = _fronts(rows, flown, varied_keys(asked.vary or ()), bounds)
    command = command_line(asked.context, leave_out=("reuse", "overwrite"))
    comparison = Comparison.of(rows, len(entries), reference, command, str(workers), bounds, fronts)
    names = [STORE, *comparison.write(asked.out)]
    if asked.with_parquet:
        write_files(asked.out, {FLIGHTS: parquet(rows)})
        names.append(FLIGHTS)
    _report(screen, comparison, asked.out, names)
    end_with(rows, trouble)


def _entries(sweep: Sweep) -> list[Entry]:
    """All flights; says what is odd about the scenarios."""
    if sweep.size > _MOST_FLIGHTS:
        raise InputError(
            f"--scenarios, --planners and --seeds ask for {sweep.size} flights; "
            f"give fewer, at most {_MOST_FLIGHTS}"
        )
    for name, scenario in sweep.scenarios.items():
        warn(f"{name}: {warning}" for warning in warnings(scenario))
    return list(sweep.entries())


def _fronts(
    rows: Sequence[Row], scenarios: Mapping[str, Scenario], keys: Sequence[str], bounds: Bounds
) -> dict[str, list[Choice]]:
    """Time against energy of each mission that was accomplished, where options were varied."""
    found = {}
    for name, scenario in scenarios.items() if keys else ():
        mine = [row for row in rows if row.scenario == name]
        if choices := choices_of(mine, keys, scenario.dt_s, bounds):
            found[name] = choices
    return found


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


def _report(screen: Console, comparison: Comparison, out: Path, names: Sequence[str]) -> None:
    rows, scores, reference = comparison.rows, comparison.scores, comparison.reference
    # a truncated table is useless; in a log it is as wide as necessary
    wide = Console(width=_WIDEST_TABLE, highlight=False)
    for line in comparison.circumstances():
        screen.print(line, markup=False)
    for name in ("outcome", "effort"):
        wide.print(tables.rich_table(tables.cells(scores, name), f"\n{name.capitalize()}"))
    if len(scores) > 1 and reference in {one.label for one in scores}:
        cells = tables.cells(scores, "reference", reference)
        wide.print(tables.rich_table(cells, f"\nAgainst {reference}"))
    for name, choices in comparison.fronts.items():
        wide.print(tables.rich_table(front_cells(choices), f"\n{name}: time against energy"))
    for line in tables.notes(rows, reference):
        screen.print(f"\n{line}", markup=False)
    screen.print(f"\n{', '.join(names)} in {out}", markup=False)
    if not any(name.endswith(".png") for name in names):
        screen.print("no picture: python -m pip install 'uas-coverage-env[view]'", markup=False)
