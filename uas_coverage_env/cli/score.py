"""`uas-coverage score`: planners and policies on the levels, with scores that can be compared."""

import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import typer

from uas_coverage_env.cli.options import BackendOption, JobsOption, OverwriteOption
from uas_coverage_env.cli.output import console
from uas_coverage_env.cli.sweeps import end_with, fly_and_keep, refuse_former
from uas_coverage_env.files.strict_toml import InputError
from uas_coverage_env.files.suggestions import check_choice
from uas_coverage_env.leaderboard import Row
from uas_coverage_env.leaderboard.sweep import Entry
from uas_coverage_env.runner.store import opened
from uas_coverage_env.runner.workers import Workers
from uas_coverage_env.tasks.levels import level_named, level_names
from uas_coverage_env.tasks.scoring import (
    DESCRIPTION,
    MissionScore,
    batched,
    entry_of,
    score,
    scored,
    spec_of,
)
from uas_coverage_env.tasks.table import markdown
from uas_coverage_env.tasks.task import SPLITS, Task

_PLANNERS = "random,hover,nearest-waypoint,lawnmower,tour,trajectory"
_SPLITS = tuple(split for split in SPLITS if split != "training")


def score_command(
    level: Annotated[
        str, typer.Option(metavar="NAME,...", help=f"Of {', '.join(level_names())}.")
    ] = "easy",
    planners: Annotated[
        str,
        typer.Option(
            metavar="NAME,...", help="`random`, names of planners, `policy:DIR` of a training."
        ),
    ] = _PLANNERS,
    missions: Annotated[int, typer.Option(min=1, help="How many of the split.")] = 20,
    split: Annotated[str, typer.Option(help=f"{' or '.join(_SPLITS)}.")] = "test",
    out: Annotated[
        Path, typer.Option(help="Folder of the scores; resumed, and added to, if it exists.")
    ] = Path("scores"),
    backend: BackendOption = "process",
    jobs: JobsOption = None,
    one_by_one: Annotated[
        bool,
        typer.Option("--one-by-one", help="Fly and keep the missions of policies one by one, too."),
    ] = False,
    overwrite: OverwriteOption = False,
) -> None:
    """Fly the missions of a level and print the scores (docs/levels.md).

    Ctrl-C or a kill loses no mission that was flown: the same command goes on. Planners fly with
    the assistants of the level. Exits 1 where a mission could not be flown; it is worth nothing.

    The missions of `policy:DIR`, where a library has learned it and it remembers nothing, are flown
    side by side, in seconds, and not kept.
    """
    levels, names = _named("--level", level), _named("--planners", planners)
    for name in levels:
        check_choice("--level", name, level_names())
    check_choice("--split", split, _SPLITS)
    if missions > len(SPLITS[split]):
        raise InputError(f"--missions {missions}: --split {split} has {len(SPLITS[split])}")
    alone: dict[str, list[str]] = {}
    together: dict[str, list[str]] = {}
    for name in levels:
        for planner in names:
            offers = not one_by_one and ":" in planner and batched(planner, level_named(name))
            (together if offers else alone).setdefault(name, []).append(planner)
    entries = {
        name: _entries(level_named(name), alone.get(name, []), split, missions) for name in levels
    }
    every, screen = [entry for some in entries.values() for entry in some], console()
    with (
        Workers(jobs, backend) as workers,
        opened(out, DESCRIPTION, Row, overwrite=overwrite) as store,
    ):
        refuse_former(store, every)
        trouble = fly_and_keep(every, store, workers, screen) if every else None
        found = {row.key: row for row in store.rows()}
    for name, some in entries.items():
        flown: dict[str, list[MissionScore]] = {}
        for planner in () if trouble else together.get(name, []):
            whole = score(planner, name, missions=missions, split=split, batch=missions)
            flown[planner] = list(whole.missions)
        for entry in some:
            if entry.key in found:
                mission = MissionScore.of(found[entry.key])
                flown.setdefault(entry.spec.label, []).append(mission)
        if not flown:  # stopped before
            continue
        screen.print(f"{level_named(name).id}, {split} missions", markup=False)
        # a table in a file is not to be wrapped
        scores = {planner: scored(name, each) for planner, each in flown.items()}
        sys.stdout.write(f"\n{markdown(scores)}\n\n")
    end_with([found[entry.key] for entry in every if entry.key in found], trouble)


def _entries(task: Task, planners: Sequence[str], split: str, missions: int) -> list[Entry]:
    """The flights of a level, mission by mission: a score under way compares like with like."""
    specs = [spec_of(planner, task) for planner in planners]
    return [
        entry_of(spec, task, seed, scenario)
        for seed, scenario in task.scenarios(split, missions).items()
        for spec in specs
    ]


def _named(option: str, text: str) -> list[str]:
    names = list(dict.fromkeys(name for name in text.split(",") if name))
    if not names:
        raise InputError(f"{option} {text!r}: names none; give some, with commas between them")
    return names
