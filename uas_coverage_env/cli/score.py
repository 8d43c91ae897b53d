"""`uas-coverage score`: planners and policies on the levels, with scores that can be compared."""

import sys
from pathlib import Path
from typing import Annotated

import typer

from uas_coverage_env.cli.output import console
from uas_coverage_env.files.strict_toml import InputError
from uas_coverage_env.files.suggestions import check_choice
from uas_coverage_env.flight import load_planner
from uas_coverage_env.tasks.levels import LEVELS
from uas_coverage_env.tasks.scoring import RANDOM, MissionScore, Score, score
from uas_coverage_env.tasks.store import ScoreStore
from uas_coverage_env.tasks.table import markdown
from uas_coverage_env.tasks.task import SPLITS

_PLANNERS = "random,nearest-waypoint,lawnmower,tour,trajectory"
_SPLITS = tuple(split for split in SPLITS if split != "training")


def score_command(
    level: Annotated[
        str, typer.Option(metavar="NAME,...", help=f"Of {', '.join(LEVELS)}.")
    ] = "easy",
    planners: Annotated[
        str,
        typer.Option(
            metavar="NAME,...", help="`random`, names of planners, `policy:DIR` of a training."
        ),
    ] = _PLANNERS,
    missions: Annotated[int, typer.Option(min=1, help="How many of the split.")] = 20,
    split: Annotated[str, typer.Option(help=f"{' or '.join(_SPLITS)}.")] = "test",
    out: Annotated[Path, typer.Option(help="Folder of the scores; resumed if it exists.")] = Path(
        "scores"
    ),
) -> None:
    """Fly the missions of a level and print the scores (docs/levels.md).

    Ctrl-C or a kill loses no mission that was flown: the same command goes on. Planners fly with
    the assistants of the level.
    """
    levels = _named("--level", level)
    for name in levels:
        check_choice("--level", name, tuple(LEVELS))
    check_choice("--split", split, _SPLITS)
    names = _named("--planners", planners)
    if missions > len(SPLITS[split]):
        raise InputError(f"--missions {missions}: --split {split} has {len(SPLITS[split])}")
    for name in names:
        if name != RANDOM:
            load_planner(name)  # a name that is wrong is refused before anything is flown
    store, screen = ScoreStore(out / split), console()
    for name in levels:
        scores: dict[str, Score] = {}
        for planner in names:
            scores[planner] = _scored(store, planner, name, missions, split)
        screen.print(f"{LEVELS[name].id}, {split} missions", markup=False)
        # a table in a file is not to be wrapped
        sys.stdout.write(f"\n{markdown(scores)}\n\n")


def _scored(store: ScoreStore, planner: str, level: str, missions: int, split: str) -> Score:
    def keep(mission: MissionScore) -> None:
        store.add(level, planner, mission)

    known = store.missions(level, planner)
    return score(planner, level, missions=missions, split=split, known=known, on_mission=keep)


def _named(option: str, text: str) -> list[str]:
    names = [name for name in text.split(",") if name]
    if not names:
        raise InputError(f"{option} {text!r}: names none; give some, with commas between them")
    return names
