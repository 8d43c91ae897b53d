"""`uas-coverage planner demonstrate`: what a planner does, as data to learn from."""

from pathlib import Path
from typing import Annotated

import typer

from uas_coverage_env.cli.options import (
    LAST_KEPT_SEED,
    BackendOption,
    JobsOption,
    OverwriteOption,
    PlannerOptions,
    typed_options,
)
from uas_coverage_env.cli.output import console
from uas_coverage_env.cli.sweeps import end_with, fly_and_keep, refuse_former
from uas_coverage_env.leaderboard import PlannerSpec, Row, Sweep, scenarios_of
from uas_coverage_env.leaderboard.row import FLOWN
from uas_coverage_env.runner.store import opened
from uas_coverage_env.runner.workers import Workers


def demonstrate_command(
    scenarios: Annotated[
        list[str],
        typer.Argument(
            metavar="SCENARIO...",
            help="As `--scenarios` of `compare`: names, files, sets, `generated:FIRST:END`.",
        ),
    ],
    out: Annotated[
        Path, typer.Option(help="Folder of the missions; resumed, and added to, if it exists.")
    ],
    planner: Annotated[
        str, typer.Option(metavar="NAME", help="The planner that demonstrates; see `planner list`.")
    ] = "trajectory",
    option: PlannerOptions = None,
    seed: Annotated[int, typer.Option(help="Of the planner.", min=0, max=LAST_KEPT_SEED)] = 0,
    backend: BackendOption = "process",
    jobs: JobsOption = None,
    overwrite: OverwriteOption = False,
) -> None:
    """Fly missions and keep observations and what was done, for imitation.

    A compressed file of NumPy arrays for each mission; `Demonstrations.load` reads them all
    (docs/imitation.md). Ctrl-C or a kill loses no mission that was flown: the same command goes on.
    """
    spec = PlannerSpec.named(planner, planner, typed_options(option or ()))
    sweep = Sweep(scenarios_of(scenarios), {planner: spec}, range(seed, seed + 1))
    # of one planner; other missions of it can be added
    asked = {"command": "demonstrate", **sweep.description()}
    del asked["scenarios"]
    screen, entries = console(), list(sweep.entries())
    with (
        Workers(jobs, backend) as workers,
        opened(out, asked, Row, overwrite=overwrite) as store,
    ):
        refuse_former(store, entries)
        trouble = fly_and_keep(entries, store, workers, screen, "demonstration")
        rows = store.rows()
    flown = sum(row.status == FLOWN for row in rows)
    screen.print(f"{flown} missions in {out}", markup=False)
    end_with(rows, trouble)
