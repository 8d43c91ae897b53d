"""How reliable it all is: missions in wind, faults, hostile calls, fuzzed files, kills; one page.

    python benchmarks/robustness.py --quick
    python benchmarks/robustness.py --rows R1,R6 --out reliability

Tries what the rows of the page say and writes `RELIABILITY.md`: numbers, seeds, dates and exact
binomial bounds. Every result is kept in `--out` (JSON lines, a file per row), and what is there is
not tried again: a run that was stopped, or that `--minutes` ended, goes on where it was. Results of
other source code are used, and the page says so; remove the file of a row to make it anew. A row of
which `--out` has nothing keeps what the page says of it.

`--quick` takes about ten minutes on two quiet cores; R13 (mutants) is made only with `--rows R13`.
Exits 0 where nothing failed its claim, 1
otherwise, 2 where the input is bad, 130 where it was stopped by hand.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Iterator, Sequence
from datetime import UTC, datetime
from itertools import takewhile
from pathlib import Path
from typing import Annotated

import typer
from return_mode import chosen
from robustness_rows import ON_DEMAND, ROWS
from robustness_rows.page import page
from robustness_rows.row import Result, Row, Trial
from robustness_rows.store import Store

from uas_coverage_env.files.strict_toml import InputError
from uas_coverage_env.leaderboard.hashing import source_hash
from uas_coverage_env.runner.jobs import Job
from uas_coverage_env.runner.workers import Workers

ROOT = Path(__file__).parents[1]
STOPPED = 130
_PACKAGES = ("uas_coverage_env", "uas_coverage_baselines", "uas_coverage_agents")


def tried(trial: Trial) -> Result:
    """The result of a trial; an exception is one, too."""
    try:
        return trial.run(*trial.arguments)
    except Exception as error:  # whatever breaks is what is looked for
        return {"error": f"{type(error).__name__}: {error}"[:500]}


def try_all(
    work: Sequence[tuple[Store, Trial]], jobs: int, until: float
) -> Iterator[tuple[Store, Trial, Result]]:
    """Results as they come, from processes side by side.

    Args:
        work: Trials, and where their results go.
        jobs: Processes.
        until: `time.monotonic` after which no trial begins.
    """
    places = {f"{n}": one for n, one in enumerate(work)}
    trials = (Job(key, tried, (trial,)) for key, (_, trial) in places.items())
    with Workers(jobs) as workers:
        for job, result in workers.run(takewhile(lambda _: time.monotonic() < until, trials)):
            yield *places[job.key], result


def make(
    rows: Sequence[Row], quick: bool, jobs: int, minutes: float | None, out: Path
) -> dict[str, Store]:
    """Make what is missing of some rows; returns what there is of each."""
    stores = {row.name: Store(out, row.name) for row in rows}
    shares = []  # of each row the same share, wherever `minutes` end it
    for row in rows:
        trials = row.trials(quick)
        shares += [(n / len(trials), stores[row.name], one) for n, one in enumerate(trials)]
    shares.sort(key=lambda one: one[0])
    work = [(store, one) for _, store, one in shares if one.key not in store.entries]
    until = float("inf") if minutes is None else time.monotonic() + 60.0 * minutes
    source = source_hash(_PACKAGES)[:12]
    for made, (store, trial, result) in enumerate(try_all(work, jobs, until), start=1):
        store.add(trial.key, result, source, datetime.now(UTC).date().isoformat())
        text = result.get("error", "done")
        sys.stderr.write(f"{made}/{len(work)} {trial.key}: {text}\n")
    return stores


def main(
    quick: Annotated[bool, typer.Option("--quick", help="Few trials of each row.")] = False,
    rows: Annotated[str, typer.Option(help="Which rows.")] = ",".join(
        name for name in ROWS if name not in ON_DEMAND
    ),
    jobs: Annotated[int, typer.Option(min=1, help="Processes side by side.")] = 2,
    minutes: Annotated[
        float | None, typer.Option(min=0.0, help="Begin no trial after so long.")
    ] = None,
    out: Annotated[Path, typer.Option(help="Keeps the results.")] = Path("reliability"),
    page_file: Annotated[Path, typer.Option("--page", help="Written in the end.")] = ROOT
    / "RELIABILITY.md",
) -> None:
    """Try what the rows say, and write the page."""
    asked = [ROWS[name] for name in chosen(rows, ROWS, "row")]
    stores = make(asked, quick, jobs, minutes, out)
    # rows that were not asked for stand on the page with what there is of them, or was
    stores |= {name: Store(out, name) for name in ROWS if name not in stores}
    try:
        before = page_file.read_text(encoding="utf-8") if page_file.exists() else ""
        text, failed = page(stores, quick, before)
        page_file.write_text(text, encoding="utf-8")
    except OSError as error:
        raise InputError(f"{page_file}: cannot be written: {error.strerror}") from error
    sys.stdout.write(f"{page_file}\n")
    raise typer.Exit(int(failed))


if __name__ == "__main__":
    app = typer.Typer(add_completion=False, pretty_exceptions_enable=False)
    app.command()(main)
    try:
        app(standalone_mode=True)
    except InputError as error:
        sys.stderr.write(f"error: {error}\n")
        sys.exit(2)
    except KeyboardInterrupt:
        sys.stderr.write("stopped by hand; results are kept, run again to go on\n")
        sys.exit(STOPPED)
