"""`uas-coverage run`: fly one mission and keep it."""

import json
import re
from contextlib import ExitStack
from dataclasses import dataclass, field
from itertools import count
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from uas_coverage_env.cli.compilation import compiling_for_flight
from uas_coverage_env.cli.figures_of_flight import data
from uas_coverage_env.cli.flights import keep_flight, report_flight
from uas_coverage_env.cli.options import (
    DynamicsOption,
    FilterOption,
    PlannerOption,
    PlannerOptions,
    ReplaceFlightOption,
    ScenarioArgument,
    SeedOption,
    declared,
    typed_options,
)
from uas_coverage_env.cli.output import DONE, FAILED, console, loaded
from uas_coverage_env.cli.progress import shown
from uas_coverage_env.cli.settings import from_settings
from uas_coverage_env.cli.sorties import SUMMARY, keep_sorties
from uas_coverage_env.files.errors import InputError, PlannerError
from uas_coverage_env.flight import Flight, Planner, load_planner, rollout
from uas_coverage_env.flight.directory import check_directory
from uas_coverage_env.flight.metrics import accomplished
from uas_coverage_env.flight.sorties import fly_sorties
from uas_coverage_env.interruptions import STOPPED
from uas_coverage_env.scenario import Scenario


@dataclass(frozen=True, kw_only=True)
class Asked:
    """What is asked of `run`; each field is a parameter of the command."""

    scenario: ScenarioArgument
    planner: PlannerOption = "milp-mpc"
    option: PlannerOptions = None
    seed: SeedOption = 0
    steps: Annotated[
        int | None, typer.Option(min=1, help="Stop after this many steps (exit code 0).")
    ] = None
    dynamics: DynamicsOption = "lpv"
    sorties: Annotated[
        int | None,
        typer.Option(
            min=1,
            help="Fly up to this many sorties, each from home with fresh packs on what is left; "
            "`[sorties]` of the scenario has packs and swap time. DIR holds a flight for each.",
        ),
    ] = None
    safety_filter: FilterOption = False
    watch: Annotated[
        bool,
        typer.Option(
            "--watch",
            help="Show it in a window as it is planned (extra `human`); without a display, as a "
            "map of letters.",
        ),
    ] = False
    live: Annotated[
        bool,
        typer.Option(
            "--live",
            help="Serve the replay page while it is planned, on this machine alone (127.0.0.1).",
        ),
    ] = False
    settings: Annotated[
        Path | None,
        typer.Option(
            help="TOML file with any of these options, and `scenario`; typed ones win.",
            callback=from_settings,
            is_eager=True,
        ),
    ] = None
    out: Annotated[
        Path | None,
        typer.Option(help="Flight directory; default: flights/SCENARIO-PLANNER-SEED, numbered."),
    ] = None
    overwrite: ReplaceFlightOption = False
    quiet: Annotated[
        bool, typer.Option("--quiet", help="Print nothing but warnings and errors.")
    ] = False
    as_json: Annotated[
        bool, typer.Option("--json", help="Print the result as JSON, and nothing else.")
    ] = False


@declared
def run(asked: Asked) -> None:
    """Fly one mission and write a flight directory.

    Ctrl-C, SIGTERM or a lost terminal ends the flight after the step that is being flown, a second
    one at once, and what was flown is kept. Exits 0 where everything is covered, all UAS home, no
    contact and no limit exceeded (also where --steps ended the run), 1 otherwise, 2 where the input
    is bad or the planner raised an exception (what was flown before that is kept, too), 130 after
    Ctrl-C and 143 after SIGTERM.
    """
    mission = loaded(asked.scenario)
    _check_sorties(asked, mission)
    planner = load_planner(asked.planner, typed_options(asked.option or ()))
    # KIND:ARGUMENT may hold a path
    planner_name = re.sub(r"[^\w.-]+", "-", asked.planner).strip("-.")
    directory = asked.out or free_directory(f"{mission.name}-{planner_name}-{asked.seed}")
    check_directory(directory, overwrite=asked.overwrite)
    screen = console(quiet=asked.quiet or asked.as_json)
    command = _Run(asked, planner, directory, screen)
    try:
        with compiling_for_flight(planner, quiet=screen.quiet):
            if asked.sorties is None:
                code = command.fly_one(mission)
            else:
                code = command.fly_sorties(mission, asked.sorties)
    finally:
        if not any(directory.iterdir()):
            directory.rmdir()
    command.end(stopped=code == STOPPED)
    raise typer.Exit(code)


def _check_sorties(asked: Asked, mission: Scenario) -> None:
    """Refuse what cannot be flown sortie after sortie."""
    if asked.sorties is None:
        return
    if asked.steps is not None:
        raise InputError("--steps ends a flight in the air: give either --steps or --sorties")
    if asked.live:
        raise InputError("--live shows one flight: give either --live or --sorties")
    if mission.sorties is not None and not mission.sorties.together:
        raise InputError(
            f"--sorties flies sorties one after the other, and in {mission.name!r} each UAS swaps "
            f"packs on its own (sorties.together = false): leave --sorties out"
        )
    if mission.asks_again:
        raise InputError(
            f"--sorties begins each sortie anew, and waypoints of {mission.name!r} are asked for "
            f"again some time after they were covered (again_after_s): leave --sorties out; "
            f"[sorties] with together = false gives UAS packs"
        )


@dataclass
class _Run:
    """The flights of one command, and what went wrong in them."""

    asked: Asked
    planner: Planner
    directory: Path
    screen: Console
    window: ExitStack = field(default_factory=ExitStack)
    """Holds the window of a watched flight open."""
    trouble: list[PlannerError] = field(default_factory=list)

    def fly(self, scenario: Scenario) -> Flight:
        """Fly it, or as much of it as was flown before its planner failed."""
        asked = self.asked
        watched, after = self.planner if asked.watch else None, self.window
        if asked.sorties is not None:
            after = None
        with shown(self.screen, scenario, watch=watched, live=asked.live, after=after) as on_step:
            try:
                return rollout(
                    scenario,
                    self.planner,
                    asked.seed,
                    dynamics=asked.dynamics,
                    safety_filter=True if asked.safety_filter else None,
                    max_steps=asked.steps,
                    on_step=on_step,
                )
            except PlannerError as error:
                if error.flight is None:
                    raise
                self.trouble.append(error)
                return error.flight

    def fly_one(self, scenario: Scenario) -> int:
        """Fly one mission, and say what came of it; returns the exit code."""
        flight, steps = self.fly(scenario), self.asked.steps
        keep_flight(flight, self.directory, overwrite=self.asked.overwrite)
        report_flight(self.screen, flight, self.directory)
        if self.asked.as_json:
            typer.echo(json.dumps(data(flight, str(self.directory)), indent=2))
        if flight.ended == "stopped":
            return STOPPED
        limited = flight.ended == "steps" and flight.steps == steps
        return DONE if accomplished(flight) or limited else FAILED

    def fly_sorties(self, scenario: Scenario, most: int) -> int:
        """Fly sortie after sortie, and say what came of them; returns the exit code."""
        chain = fly_sorties(scenario, self.fly, most)
        code = keep_sorties(self.screen, chain, self.directory, overwrite=self.asked.overwrite)
        if self.asked.as_json:
            typer.echo((self.directory / SUMMARY).read_text(), nl=False)
        return code

    def end(self, *, stopped: bool) -> None:
        """Wait for the window to be closed, or end the command where the planner has failed."""
        if self.trouble:
            error = self.trouble[0]
            reason = f"{error}; what was flown before is in {self.directory}"
            raise PlannerError(reason) from error.__cause__
        if not stopped:
            self.window.close()


def free_directory(name: str) -> Path:
    """flights/NAME, or NAME-2, NAME-3, ... where that is taken."""
    first = Path("flights") / name
    candidates = (first if n == 1 else first.with_name(f"{name}-{n}") for n in count(1))
    return next(path for path in candidates if not path.exists())
