"""Whole missions: the village and generated scenarios, planner against planner.

    python benchmarks/missions.py --out missions
    python benchmarks/missions.py --planners milp-mpc,lawnmower --seeds 1000:1100 --no-village

Every flight is judged twice: by the world that flew it and by `independent_check`. The generated
scenario of a seed has 1 to 4 UAS, 20 to 60 waypoints and 5 to 20 blocks, drawn from the seed; the
default seeds were used for no tuning. Flights that `--out` holds are not flown again. Decision
times are comparable only where `--jobs` leaves each flight the cores it asks for.

Exits 0 where nothing was touched, nothing came too near and both judges agree; 1 otherwise; 2
where the input is bad.
"""

from __future__ import annotations

import csv
import json
import os
import shutil
import sys
import tempfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import typer
from mission_statistics import COLUMNS, Row, flights_table, planners_table
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

from uas_coverage_env import Scenario, load_planner, load_scenario, rollout
from uas_coverage_env.files.strict_toml import InputError
from uas_coverage_env.flight import describe_planners
from uas_coverage_env.flight.flight import unless_stopped
from uas_coverage_env.flight.registry import options_of
from uas_coverage_env.independent_check import BadFlightError, check
from uas_coverage_env.leaderboard import seed_range
from uas_coverage_env.runner.jobs import Job
from uas_coverage_env.runner.workers import Workers
from uas_coverage_env.scenario import sample_scenario

PLANNERS = "milp-mpc,lawnmower,nearest-waypoint"
SEEDS = "1000:1020"
CLEAN, TOUCHED, BAD_INPUT, STOPPED = 0, 1, 2, 130
_TABLE_WIDTH = 190


@dataclass(frozen=True)
class Mission:
    """One planner on one scenario, and where the flight is kept."""

    scenario: Scenario
    planner: str
    options: dict[str, str]
    seed: int
    directory: Path

    @property
    def name(self) -> str:
        """For people."""
        return f"{self.scenario.name} {self.planner}"


def fly(mission: Mission) -> Row:
    """Fly a mission unless its directory holds it, and judge it.

    The directory appears whole or not at all.

    Raises:
        InputError: The directory holds another flight, or cannot be written.
        KeyboardInterrupt: Ctrl-C ended the flight.
    """
    if mission.directory.exists():
        _make_sure_it_is(mission)
    else:
        _fly_and_keep(mission)
    summary = json.loads((mission.directory / "summary.json").read_text(encoding="utf-8"))
    try:
        report = check(mission.directory)
    except BadFlightError as error:
        raise InputError(str(error)) from error
    n_uas = len(mission.scenario.uas)
    return Row.of(mission.scenario.name, mission.planner, n_uas, summary, report)


def _fly_and_keep(mission: Mission) -> None:
    planner = load_planner(mission.planner, mission.options)
    flight = unless_stopped(rollout(mission.scenario, planner, seed=mission.seed))
    folder = mission.directory.parent
    folder.mkdir(parents=True, exist_ok=True)
    half_done = folder / f".{mission.directory.name}.{os.getpid()}"
    try:
        flight.save(half_done, overwrite=True)
        half_done.rename(mission.directory)
    finally:
        shutil.rmtree(half_done, ignore_errors=True)


def _make_sure_it_is(mission: Mission) -> None:
    """What is kept was flown with the same scenario, planner, options and seed."""
    try:
        summary = json.loads((mission.directory / "summary.json").read_text(encoding="utf-8"))
        scenario = json.loads((mission.directory / "scenario.json").read_text(encoding="utf-8"))
        kept = {"scenario": scenario, "seed": summary["seed"], **summary["planner"]}
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise InputError(f"{mission.directory}: holds no whole flight; remove it") from error
    asked = {
        "scenario": mission.scenario.model_dump(mode="json", by_alias=True),
        "seed": mission.seed,
        "name": mission.planner,
        "options": options_of(load_planner(mission.planner, mission.options)),
    }
    for key, value in asked.items():
        if kept[key] != value:
            raise InputError(
                f"{mission.directory}: holds a flight with another {key}; "
                "give another --out, or remove it"
            )


def planner_options(planners: Sequence[str], pairs: Sequence[str]) -> dict[str, dict[str, str]]:
    """Each planner's share of the options: those it has.

    Raises:
        InputError: An unknown planner, or an option that none of them has.
    """
    known = {planner.name: planner for planner in describe_planners()}
    for name in planners:
        if name not in known:
            raise InputError(f"unknown planner {name!r}; allowed: {', '.join(known)}")
    shares: dict[str, dict[str, str]] = {name: {} for name in planners}
    for pair in pairs:
        key, separator, value = (part.strip() for part in pair.partition("="))
        if not key or not separator:
            raise InputError(f"--option {pair!r}: should be KEY=VALUE, as in horizon=12")
        takers = [n for n in planners if key in {option.name for option in known[n].options}]
        if not takers:
            raise InputError(f"no planner of {', '.join(planners)} has an option {key!r}")
        for name in takers:
            shares[name][key] = value
    for name, options in shares.items():
        load_planner(name, options)
    return shares


def _missions(
    planners: Sequence[str], options: Mapping[str, dict[str, str]], seeds: range,
    village: bool, folder: Path,
) -> list[Mission]:  # fmt: skip
    scenarios = [(0, load_scenario("village"))] if village else []
    scenarios += [(seed, sample_scenario(seed)) for seed in seeds]
    if not scenarios or not planners:
        raise InputError("nothing to fly: give --planners, and --village or some --seeds")
    return [
        Mission(scenario, name, options[name], seed, folder / name / scenario.name)
        for seed, scenario in scenarios
        for name in planners
    ]


@contextmanager
def _folder(out: Path | None) -> Iterator[Path]:
    if out is not None:
        yield out
        return
    with tempfile.TemporaryDirectory() as folder:
        yield Path(folder)


def fly_all(missions: Sequence[Mission], jobs: int, console: Console) -> list[Row]:
    """All missions, in processes side by side, with a bar that shows how far they are."""
    rows: dict[str, Row] = {}
    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn())
    with (
        Workers(jobs) as workers,
        Progress(*columns, TimeElapsedColumn(), console=console) as progress,
    ):
        bar = progress.add_task("flying", total=len(missions))
        for job, row in workers.run(Job(one.name, fly, (one,)) for one in missions):
            rows[job.key] = row
            progress.update(bar, description=job.key, advance=1)
            if not row.clean or not console.is_terminal:
                progress.console.print(row.line(), highlight=False, markup=False, soft_wrap=True)
    return [rows[mission.name] for mission in missions]


def _write_rows(path: Path, rows: Sequence[Row]) -> None:
    temporary = path.with_name(f".{path.name}.{os.getpid()}")
    with temporary.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(COLUMNS)
        writer.writerows(row.values() for row in rows)
    temporary.replace(path)


def main(
    planners: Annotated[
        str, typer.Option(help="Planners, the first is what the others are compared with.")
    ] = PLANNERS,
    seeds: Annotated[str, typer.Option(help="FIRST:END of the generated scenarios.")] = SEEDS,
    village: Annotated[bool, typer.Option(help="Fly the village too.")] = True,
    option: Annotated[
        list[str] | None,
        typer.Option(metavar="KEY=VALUE", help="Option, for each planner that has it; repeatable."),
    ] = None,
    jobs: Annotated[int, typer.Option(min=1, help="Flights side by side.")] = 1,
    out: Annotated[
        Path | None, typer.Option(help="Keeps every finished flight; what it holds is not flown.")
    ] = None,
) -> None:
    """Fly planners on the village and on generated scenarios, and print two tables."""
    names = list(dict.fromkeys(name.strip() for name in planners.split(",") if name.strip()))
    console = Console()
    with _folder(out) as folder:
        shares = planner_options(names, option or ())
        missions = _missions(names, shares, seed_range("--seeds", seeds), village, folder)
        try:
            rows = fly_all(missions, jobs, console)
        except KeyboardInterrupt:
            sys.stderr.write("stopped by hand; finished flights are kept, run again to go on\n")
            raise typer.Exit(STOPPED) from None
        if out is not None:
            _write_rows(out / "missions.csv", rows)
    wide = Console(width=max(console.width, _TABLE_WIDTH))
    wide.print(flights_table(rows))
    wide.print(planners_table(rows, names))
    for row in rows:
        for problem in row.problems:
            wide.print(f"{row.scenario} {row.planner}: {problem}", markup=False)
    raise typer.Exit(CLEAN if all(row.clean for row in rows) else TOUCHED)


def _run(command: Callable[[], Any]) -> int:
    """The exit code of the command; a person's mistake is one line."""
    try:
        command()
    except InputError as error:
        sys.stderr.write(f"error: {error}\n")
        return BAD_INPUT
    return CLEAN


if __name__ == "__main__":
    app = typer.Typer(add_completion=False, pretty_exceptions_enable=False)
    app.command()(main)
    sys.exit(_run(app))
