"""`uas-coverage run`: fly one mission and keep it."""

import re
from collections.abc import Sequence
from itertools import count
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.table import Table

from uas_coverage_env.cli.output import DONE, FAILED, console, loaded
from uas_coverage_env.cli.progress import shown
from uas_coverage_env.files.strict_toml import InputError
from uas_coverage_env.flight import (
    MODES,
    Flight,
    accomplished,
    check_directory,
    draw_flight,
    energy_Wh,
    fallback_reasons,
    filtered_share,
    load_planner,
    rollout,
    summary,
)
from uas_coverage_env.simulation import Dynamics


def run(
    scenario: Annotated[
        str,
        typer.Argument(
            metavar="SCENARIO", help="Name of a shipped scenario (`scenarios`), or a scenario file."
        ),
    ],
    planner: Annotated[str, typer.Option(help="Name of the planner, see `planners`.")] = "milp-mpc",
    option: Annotated[
        list[str] | None,
        typer.Option(metavar="KEY=VALUE", help="Option of the planner; may be repeated."),
    ] = None,
    seed: Annotated[int, typer.Option(min=0, help="Seed of the planner.")] = 0,
    steps: Annotated[
        int | None, typer.Option(min=1, help="Stop after this many steps (exit code 0).")
    ] = None,
    dynamics: Annotated[
        Dynamics, typer.Option(help="The paper's linear model, or 6-DOF with exact power.")
    ] = "lpv",
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
    out: Annotated[
        Path | None,
        typer.Option(help="Flight directory; default: flights/SCENARIO-PLANNER-SEED, numbered."),
    ] = None,
    overwrite: Annotated[
        bool, typer.Option("--overwrite", help="Replace the flight in --out.")
    ] = False,
) -> None:
    """Fly one mission and write a flight directory.

    Ctrl-C or SIGTERM ends the flight early and keeps what was flown. Exits 0 where everything is
    covered, all UAS home, no contact and no limit exceeded (also where --steps ended the run), 1
    otherwise.
    """
    mission = loaded(scenario)
    player = load_planner(planner, _options(option or ()))
    # KIND:ARGUMENT may hold a path
    player_name = re.sub(r"[^\w.-]+", "-", planner).strip("-.")
    directory = out or _free_directory(f"{mission.name}-{player_name}-{seed}")
    check_directory(directory, overwrite=overwrite)

    screen = console()
    try:
        with shown(screen, mission, watch=player if watch else None) as on_step:
            flight = rollout(
                mission,
                player,
                seed,
                dynamics=dynamics,
                safety_filter=True if safety_filter else None,
                max_steps=steps,
                on_step=on_step,
            )
        flight.save(directory, overwrite=overwrite)
        draw_flight(flight, directory / "map.png")
    finally:
        if not any(directory.iterdir()):
            directory.rmdir()
    report_flight(screen, flight, directory)
    raise typer.Exit(_exit_code(flight, steps))


def _options(pairs: Sequence[str]) -> dict[str, str]:
    options: dict[str, str] = {}
    for pair in pairs:
        key, separator, value = (part.strip() for part in pair.partition("="))
        if not key or not separator:
            raise InputError(f"--option {pair!r}: should be KEY=VALUE, as in horizon=12")
        if key in options:
            raise InputError(f"--option {key} is given twice; give it once")
        options[key] = value
    return options


def _free_directory(name: str) -> Path:
    """flights/NAME, or NAME-2, NAME-3, ... where that is taken."""
    first = Path("flights") / name
    candidates = (first if n == 1 else first.with_name(f"{name}-{n}") for n in count(1))
    return next(path for path in candidates if not path.exists())


def _exit_code(flight: Flight, steps: int | None) -> int:
    ended_by_person = flight.ended == "steps" and flight.steps == steps
    return DONE if accomplished(flight) or ended_by_person else FAILED


def report_flight(screen: Console, flight: Flight, directory: Path) -> None:
    """Print what came of a flight, and where it is."""
    result = summary(flight)
    table = Table("UAS", "end", "steps", "energy, Wh", "charge left", box=None)
    for i, name in enumerate(flight.names):
        end = MODES[flight.mode[-1, i]]
        table.add_row(
            name,
            end if end in ("landed", "lost") else "in the air",
            str(flight.last_sample[i]),
            f"{energy_Wh(flight)[i]:.2f}",
            f"{flight.soc[-1, i]:.1%}",
        )
    screen.print(table)
    for violation in flight.violations:
        screen.print(f"violation: {violation}", markup=False)
    low = f", {flight.height_breaches} of them too low" if flight.height_breaches else ""
    ended = {"complete": "", "steps": ", limit of steps reached", "stopped": ", stopped by hand"}
    screen.print(
        f"covered {result['coverage']:.0%} in {flight.steps} steps{ended[flight.ended]}; "
        f"{'all home' if result['all_home'] else 'not all home'}; "
        f"{result['energy_Wh']:.2f} Wh; {len(flight.violations)} violations, "
        f"{flight.breaches} breaches{low}",
        markup=False,
    )
    if any(decision.duration_s for decision in flight.decisions):  # none in a log
        times = ", ".join(
            f"{1e3 * t:.2f} ms {name}" for name, t in result["decision_time_s"].items()
        )
        counts = fallback_reasons(flight).items()
        why = f" ({', '.join(f'{n} {reason}' for reason, n in counts)})" if counts else ""
        screen.print(f"decisions: {times}; {result['fallbacks']} fallbacks{why}", markup=False)
    if flight.safety_filter:
        share = filtered_share(flight)
        screen.print(f"the safety filter replaced {share:.1%} of the commands", markup=False)
    screen.print(f"flight in {directory}", markup=False)
    screen.print(f"to watch it: uas-coverage replay {directory}", markup=False)
