"""What the commands that fly many missions share: the flights, what is shown, how they end."""

import sys
from collections.abc import Sequence, Set
from contextlib import closing
from functools import partial

import typer
from rich.console import Console

from uas_coverage_env.cli.compilation import compilation_shown, compile_flight
from uas_coverage_env.cli.output import FAILED, one_line
from uas_coverage_env.cli.progress import missions_shown
from uas_coverage_env.compiled.purpose import compiling_for
from uas_coverage_env.files.strict_toml import InputError
from uas_coverage_env.leaderboard import Row
from uas_coverage_env.leaderboard.flying import Kept, fly
from uas_coverage_env.leaderboard.publish import failures
from uas_coverage_env.leaderboard.row import FLOWN
from uas_coverage_env.leaderboard.sweep import Entry, source_of
from uas_coverage_env.runner.jobs import Job
from uas_coverage_env.runner.store import Store
from uas_coverage_env.runner.workers import WorkerLostError, Workers


def fly_and_keep(
    entries: Sequence[Entry],
    store: Store[Row],
    workers: Workers,
    screen: Console,
    kept: Kept = "row",
    again: Set[str] = frozenset(),
    *,
    check: bool = False,
) -> Exception | KeyboardInterrupt | None:
    """Fly what the store lacks; returns what ended it before its end, see `end_with`.

    Args:
        entries: All that are to be flown.
        store: Where the rows go; files go beside it.
        workers: Who flies.
        screen: Where it shows how far it is.
        kept: What is kept of each flight.
        again: Keys of flights that are flown anew where the store holds them.
        check: Whether the independent checker judges each; those that it has not are flown anew.
    """
    if check:
        again |= {row.key for row in store.rows() if row.status == FLOWN and row.verdict is None}
    there = store.keys() - again
    todo = [entry for entry in entries if entry.key not in there]
    if todo and workers.backend == "process":
        # here and once, not in every process that flies
        first = todo[0]
        with compilation_shown(), compiling_for("flights"):
            compile_flight(
                first.scenario, return_mode=True, safety_filter=bool(first.safety_filter)
            )
    source, call = source_of(entries), partial(fly, check=check)
    jobs = [Job(entry.key, call, (entry, source, kept)) for entry in todo]
    try:
        with (
            missions_shown(screen, len(entries), len(entries) - len(todo)) as told,
            closing(workers.run(jobs)) as results,
        ):
            for _, flown in results:
                flown.write(store.path.parent)
                store.add(flown.row, replace=flown.row.key in again)
                told(f"{flown.row.scenario} {flown.row.label} {flown.row.seed}")
    except (KeyboardInterrupt, WorkerLostError) as error:
        return error
    return None


def refuse_others(store: Store[Row], entries: Sequence[Entry]) -> None:
    """See that a store holds no other flights than those of a sweep.

    Raises:
        InputError: It holds some.
    """
    if store.keys() - {entry.key for entry in entries}:
        raise InputError(
            f"{store.path}: was damaged (it holds flights of no sweep, or of another); "
            "give another --out, or add --overwrite to begin anew"
        )


def refuse_former(store: Store[Row], entries: Sequence[Entry]) -> None:
    """See that what a store holds of these missions and planners was flown as is asked for now.

    Raises:
        InputError: One was not.
    """
    asked = {(e.level, e.scenario.name, e.spec.label, e.seed): e.key for e in entries}
    for row in store.rows():
        if asked.get((row.level, row.scenario, row.label, row.seed), row.key) != row.key:
            raise InputError(
                f"{store.path}: holds {row.scenario} {row.label} {row.seed}, flown with another "
                "scenario, options, weights or version; give another --out or add --overwrite"
            )


def end_with(rows: Sequence[Row], trouble: BaseException | None) -> None:
    """Say what is wrong with the flights, see `failures`, and end a command; they are kept.

    Raises:
        KeyboardInterrupt: It was stopped by hand.
        typer.Exit: Something is wrong with one, or it was not flown.
    """
    wrong = failures(rows)
    for line in wrong:
        sys.stderr.write(f"error: {one_line(line)}\n")
    if isinstance(trouble, KeyboardInterrupt):
        raise trouble
    if trouble is not None:
        sys.stderr.write(f"error: {one_line(str(trouble))}; the same command goes on\n")
    if wrong or trouble:
        raise typer.Exit(FAILED)
