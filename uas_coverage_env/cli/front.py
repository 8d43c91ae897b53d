"""`uas-coverage front`: what less energy costs in time, mission by mission."""

import contextlib
import shlex
import sys
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Annotated

import numpy as np
import typer
from rich.console import Console

from uas_coverage_env.cli.compare import bounds_shown
from uas_coverage_env.cli.options import (
    LAST_KEPT_SEED,
    BackendOption,
    JobsOption,
    OverwriteOption,
)
from uas_coverage_env.cli.output import FAILED, console
from uas_coverage_env.cli.sweeps import end_with, fly_and_keep, refuse_others
from uas_coverage_env.files.output_dir import write_files
from uas_coverage_env.files.strict_toml import InputError
from uas_coverage_env.flight import Flight
from uas_coverage_env.leaderboard import FLOWN, Row, Sweep, scenarios_of
from uas_coverage_env.leaderboard import front as fronts
from uas_coverage_env.leaderboard import table as tables
from uas_coverage_env.leaderboard.flying import kept_as
from uas_coverage_env.runner.jobs import Workers
from uas_coverage_env.runner.store import opened

_WEIGHTS = "weight_energy=0,0.02,0.05,0.1,0.2,0.4,0.6,1,2,5,20"
_NARROWEST_TABLE = 100
_MOVED_M = 1.0  # what flies moves farther
TABLE, PICTURE = "front.md", "front.png"


def front(
    scenarios: Annotated[
        list[str],
        typer.Argument(
            metavar="SCENARIO...",
            help="As `--scenarios` of `compare`: names, files, sets, `generated:SEED`.",
        ),
    ],
    out: Annotated[Path, typer.Option(help="Directory of the flights; resumed if it exists.")],
    planner: Annotated[
        str, typer.Option(metavar="NAME", help="Whose options are varied.")
    ] = "trajectory",
    vary: Annotated[
        list[str] | None,
        typer.Option(
            metavar="KEY=VALUE,...",
            help="An option and its values; may be repeated, then all combinations are flown. "
            f"Of `trajectory` without it: {_WEIGHTS}.",
            show_default=False,
        ),
    ] = None,
    seed: Annotated[int, typer.Option(help="Of the planner.", min=0, max=LAST_KEPT_SEED)] = 0,
    backend: BackendOption = "process",
    jobs: JobsOption = None,
    overwrite: OverwriteOption = False,
) -> None:
    """Fly a planner with different options, and draw time against energy.

    Writes a table and a picture of each mission's Pareto front: the flights that no other one beats
    in one of the two without losing in the other. Each flight is kept in OUT/flights, for `show`
    and `replay`. Ctrl-C or a kill loses no finished flight: the same command goes on.
    """
    if vary is None and planner != "trajectory":
        raise InputError("--vary: name an option of the planner, as in --vary horizon=8,12,16")
    asked = vary if vary is not None else [_WEIGHTS]
    sweep = Sweep(
        scenarios_of(scenarios), fronts.varied_specs(planner, asked), range(seed, seed + 1)
    )
    entries, screen = list(sweep.entries()), console()
    described = {"command": "front", **sweep.description()}
    with (
        Workers(jobs, backend) as workers,
        opened(out, described, Row, overwrite=overwrite) as store,
    ):
        refuse_others(store, entries)
        trouble = fly_and_keep(entries, store, workers, screen, "flight")
        rows = store.rows()
        bounds = {} if trouble else bounds_shown(rows, sweep.scenarios, screen, workers)
    keys = [text.partition("=")[0].strip() for text in asked]
    found = {}
    for name, scenario in sweep.scenarios.items():
        mine = [row for row in rows if row.scenario == name]
        flying = _flying(mine, out)
        choices = fronts.choices_of(mine, keys, scenario.dt_s, flying, bounds)
        if choices:
            found[name] = choices
    if not found:
        sys.stderr.write("error: no flight accomplished its mission\n")
        end_with(rows, trouble)
        raise typer.Exit(FAILED)
    _write(found, out, _command(scenarios, planner, asked, seed, out))
    _report(screen, found, rows, out)
    end_with(rows, trouble)


def _flying(rows: Iterable[Row], out: Path) -> dict[str, int]:
    """Label -> UAS that took off, of the flights that are kept."""
    result = {}
    for row in rows:
        if row.status == FLOWN:
            with contextlib.suppress(InputError):
                flight = Flight.load(out / kept_as(row))
                moved_m = np.abs(flight.x[:, :, :3] - flight.x[0, :, :3]).max(axis=(0, 2))
                result[row.label] = int((moved_m > _MOVED_M).sum())
    return result


def _write(found: dict[str, list[fronts.Choice]], out: Path, command: str) -> None:
    parts = [f"`{command}`\n"]
    for name, choices in found.items():
        parts += [f"{name}:\n", tables.markdown(fronts.front_cells(choices))]
    files = {TABLE: "\n".join(parts).encode()}
    try:
        from uas_coverage_env.replay.figures import png_of
    except ImportError:
        pass
    else:
        files = {PICTURE: png_of(fronts.front_figure(found)), **files}
    write_files(out, files)


def _report(
    screen: Console, found: dict[str, list[fronts.Choice]], rows: Sequence[Row], out: Path
) -> None:
    wide = Console(width=max(screen.width, _NARROWEST_TABLE), highlight=False)
    for name, choices in found.items():
        wide.print(tables.rich_table(fronts.front_cells(choices), f"\n{name}"))
    lost = sum(row.status == FLOWN and not row.accomplished for row in rows)
    if lost:
        screen.print(f"\n{lost} flights did not accomplish the mission and are not shown")
    names = [name for name in (PICTURE, TABLE) if (out / name).exists()]
    screen.print(f"\n{', '.join(names)} in {out}", markup=False)


def _command(
    scenarios: Sequence[str], planner: str, asked: Sequence[str], seed: int, out: Path
) -> str:
    words = [*scenarios, *(() if planner == "trajectory" else ("--planner", planner))]
    words += [part for text in asked if text != _WEIGHTS for part in ("--vary", text)]
    words += [*(() if not seed else ("--seed", str(seed))), "--out", str(out)]
    return shlex.join(["uas-coverage", "front", *words])
