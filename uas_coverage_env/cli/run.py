"""`uas-coverage run`: fly one mission and keep it."""

import json
import re
from collections.abc import Sequence
from contextlib import ExitStack
from itertools import count
from pathlib import Path
from typing import Annotated

import typer

from uas_coverage_env.cli import completion
from uas_coverage_env.cli.compilation import compiling_for_flight
from uas_coverage_env.cli.figures_of_flight import data
from uas_coverage_env.cli.flights import keep_flight, report_flight
from uas_coverage_env.cli.options import LAST_SEED, options_of
from uas_coverage_env.cli.output import DONE, FAILED, console, loaded
from uas_coverage_env.cli.progress import shown
from uas_coverage_env.cli.settings import from_settings
from uas_coverage_env.cli.sorties import SUMMARY, keep_sorties
from uas_coverage_env.files.strict_toml import InputError
from uas_coverage_env.flight import Flight, PlannerError, fly_sorties, load_planner, rollout
from uas_coverage_env.flight.directory import check_directory
from uas_coverage_env.flight.metrics import accomplished
from uas_coverage_env.scenario import Scenario
from uas_coverage_env.simulation import Dynamics


def run(
    scenario: Annotated[
        str,
        typer.Argument(
            metavar="SCENARIO",
            help="Name of a shipped scenario (see `scenarios`), `generated:SEED` or another that "
            "`compare` takes, or a scenario file.",
            autocompletion=completion.scenarios,
        ),
    ],
    planner: Annotated[
        str,
        typer.Option(
            help="Name (see `planners`), or MODULE:CLASS of your own.",
            autocompletion=completion.planners,
        ),
    ] = "milp-mpc",
    option: Annotated[
        list[str] | None,
        typer.Option(metavar="KEY=VALUE", help="Option of the planner; may be repeated."),
    ] = None,
    seed: Annotated[int, typer.Option(min=0, max=LAST_SEED, help="Seed of the planner.")] = 0,
    steps: Annotated[
        int | None, typer.Option(min=1, help="Stop after this many steps (exit code 0).")
    ] = None,
    dynamics: Annotated[
        Dynamics, typer.Option(help="The paper's linear model, or 6-DOF with exact power.")
    ] = "lpv",
    sorties: Annotated[
        int | None,
        typer.Option(
            min=1,
            help="Fly up to this many sorties, each from home with fresh packs on what is left; "
            "`[sorties]` of the scenario has packs and swap time. DIR holds a flight for each.",
        ),
    ] = None,
    safety_filter: Annotated[
        bool, typer.Option("--filter", help="Switch the safety filter on.")
    ] = False,
    watch: Annotated[
        bool,
        typer.Option(
            "--watch",
            help="Show it in a window as it is planned (extra `human`); without a display, as a "
            "map of letters.",
        ),
    ] = False,
    live: Annotated[
        bool,
        typer.Option(
            "--live",
            help="Serve the replay page while it is planned, on this machine alone (127.0.0.1).",
        ),
    ] = False,
    settings: Annotated[
        Path | None,
        typer.Option(
            help="TOML file with any of these options, and `scenario`; typed ones win.",
            callback=from_settings,
            is_eager=True,
        ),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(help="Flight directory; default: flights/SCENARIO-PLANNER-SEED, numbered."),
    ] = None,
    overwrite: Annotated[
        bool, typer.Option("--overwrite", help="Replace the flight in --out.")
    ] = False,
    quiet: Annotated[
        bool, typer.Option("--quiet", help="Print nothing but warnings and errors.")
    ] = False,
    as_json: Annotated[
        bool, typer.Option("--json", help="Print the result as JSON, and nothing else.")
    ] = False,
) -> None:
    """Fly one mission and write a flight directory.

    Ctrl-C, SIGTERM or a lost terminal ends the flight after the step that is being flown, a second
    one at once, and what was flown is kept. Exits 0 where everything is covered, all UAS home, no
    contact and no limit exceeded (also where --steps ended the run), 1 otherwise, 2 where the input
    is bad or the planner raised an exception; what was flown before that is kept, too.
    """
    if sorties is not None and steps is not None:
        raise InputError("--steps ends a flight in the air: give either --steps or --sorties")
    if sorties is not None and live:
        raise InputError("--live shows one flight: give either --live or --sorties")
    mission = loaded(scenario)
    if sorties is not None and mission.sorties is not None and not mission.sorties.together:
        raise InputError(
            f"--sorties flies sorties one after the other, and in {mission.name!r} each UAS swaps "
            f"packs on its own (sorties.together = false): leave --sorties out"
        )
    if sorties is not None and mission.asks_again:
        raise InputError(
            f"--sorties begins each sortie anew, and waypoints of {mission.name!r} are asked for "
            f"again some time after they were covered (again_after_s): leave --sorties out; "
            f"[sorties] with together = false gives UAS packs"
        )
    flies = load_planner(planner, options_of(option or ()))
    # KIND:ARGUMENT may hold a path
    planner_name = re.sub(r"[^\w.-]+", "-", planner).strip("-.")
    directory = out or free_directory(f"{mission.name}-{planner_name}-{seed}")
    check_directory(directory, overwrite=overwrite)

    screen = console(quiet=quiet or as_json)
    window = ExitStack()
    trouble: list[PlannerError] = []

    def fly(what: Scenario) -> Flight:
        watched, after = flies if watch else None, window if sorties is None else None
        with shown(screen, what, watch=watched, live=live, after=after) as on_step:
            try:
                return rollout(
                    what,
                    flies,
                    seed,
                    dynamics=dynamics,
                    safety_filter=True if safety_filter else None,
                    max_steps=steps,
                    on_step=on_step,
                )
            except PlannerError as error:
                if error.flight is None:
                    raise
                trouble.append(error)
                return error.flight

    try:
        with compiling_for_flight(flies, quiet=screen.quiet):
            if sorties is not None:
                chain = fly_sorties(mission, fly, sorties)
                code = keep_sorties(screen, chain, directory, overwrite=overwrite)
                if as_json:
                    typer.echo((directory / SUMMARY).read_text(), nl=False)
                _refuse(trouble, directory)
                raise typer.Exit(code)
            flight = fly(mission)
            keep_flight(flight, directory, overwrite=overwrite)
    finally:
        if not any(directory.iterdir()):
            directory.rmdir()
    report_flight(screen, flight, directory)
    if as_json:
        typer.echo(json.dumps(data(flight, str(directory)), indent=2))
    _refuse(trouble, directory)
    if flight.ended != "stopped":
        window.close()
    raise typer.Exit(_exit_code(flight, steps))


def free_directory(name: str) -> Path:
    """flights/NAME, or NAME-2, NAME-3, ... where that is taken."""
    first = Path("flights") / name
    candidates = (first if n == 1 else first.with_name(f"{name}-{n}") for n in count(1))
    return next(path for path in candidates if not path.exists())


def _refuse(trouble: Sequence[PlannerError], directory: Path) -> None:
    """End the command where the planner has failed, once its flight is kept."""
    if trouble:
        reason = f"{trouble[0]}; what was flown before is in {directory}"
        raise PlannerError(reason) from trouble[0].__cause__


def _exit_code(flight: Flight, steps: int | None) -> int:
    ended_by_person = flight.ended == "steps" and flight.steps == steps
    return DONE if accomplished(flight) or ended_by_person else FAILED
