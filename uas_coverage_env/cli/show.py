"""`uas-coverage show`: what a flight gave, in figures."""

import json
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import asdict
from typing import Annotated, Any

import typer
from rich.console import Console
from rich.progress import Progress, SpinnerColumn, TextColumn, TimeElapsedColumn
from rich.table import Table

from uas_coverage_env.cli.figures_of_flight import (
    beside_the_best,
    by_uas,
    data,
    failed_figures,
    figures,
    of_log,
    verdict,
)
from uas_coverage_env.cli.options import FlightDirectory, JsonOption, SecondFlight
from uas_coverage_env.cli.output import console
from uas_coverage_env.flight import Flight
from uas_coverage_env.flight.figure import NOTHING
from uas_coverage_env.flight.legs import legs_of
from uas_coverage_env.flight.metrics import accomplished


def show(
    directory: FlightDirectory,
    other: SecondFlight = None,
    bound: Annotated[
        bool,
        typer.Option(
            "--bound",
            help="Beside the least energy that the mission takes (10 to 30 s of processor time).",
        ),
    ] = False,
    legs: Annotated[
        bool,
        typer.Option(
            "--legs",
            help="With each leg from a start by the covered waypoints to the landing: time, way, "
            "energy, charge.",
        ),
    ] = False,
    as_json: JsonOption = False,
) -> None:
    """Show the figures of a flight, or of two side by side.

    What is better has no sign of its own: of flights that accomplish the same mission, the one
    with less energy, or fewer steps.
    """
    sources = [str(path) for path in (directory, other) if path is not None]
    flights = [Flight.load(source) for source in sources]
    bounds: list[dict[str, Any] | None] = [None] * len(flights)
    if bound:
        with _stages() as say:
            bounds = [_bound(flight, say) for flight in flights]
    if as_json:
        _print_json(flights, sources, bounds, legs=legs)
        return
    out = console()
    table = Table("", *sources, box=None)
    columns = [figures(flight) for flight in flights]
    for name in columns[0]:
        cells = [column[name] for column in columns]
        if any(cell != NOTHING for cell in cells):
            table.add_row(name, *cells, style="bold" if name == "accomplished" else None)
    if bound:
        for name in ("least energy, Wh", "above it", "fewest steps", "bound computed in, s"):
            table.add_row(name, *(_bound_cell(one, name) for one in bounds))
    out.print(table)
    for flight, source in zip(flights, sources, strict=True):
        if len(flights) > 1:
            out.print(f"\n{source}", markup=False)
        each = Table("UAS", "end", "steps", "energy, Wh", "charge left", box=None)
        for row in by_uas(flight):
            each.add_row(*row)
        out.print(each)
        if legs:
            out.print(_leg_table(flight))
        for violation in flight.violations:
            out.print(f"violation: {violation}", markup=False)
        for line in (*failed_figures(flight), *of_log(flight)):
            out.print(line, markup=False)
        out.print(verdict(flight), markup=False)
        if best := beside_the_best(flight):
            out.print(best, markup=False)


def _print_json(
    flights: list[Flight],
    sources: list[str],
    bounds: list[dict[str, Any] | None],
    *,
    legs: bool,
) -> None:
    entries = [
        data(flight, source)
        | ({} if least is None else {"bound": least})
        | ({"legs": [asdict(leg) for leg in legs_of(flight)]} if legs else {})
        for flight, source, least in zip(flights, sources, bounds, strict=True)
    ]
    typer.echo(json.dumps(entries[0] if len(entries) == 1 else entries, indent=2))


def _leg_table(flight: Flight) -> Table:
    headings = ("UAS", "from", "to waypoint", "s", "m", "Wh", "charge", "at its end", "spare")
    table = Table(*headings, box=None)
    for leg in legs_of(flight):
        ends = (place.removeprefix("waypoint ") for place in (leg.leaves, leg.reaches))
        table.add_row(
            *(leg.uas, *ends, f"{leg.ends_s - leg.begins_s:g}", f"{leg.way_m:.0f}"),
            *(f"{leg.energy_Wh:.2f}", f"{leg.soc_begins:.1%}", f"{leg.soc_ends:.1%}"),
            f"{leg.above_reserve:.1%}",
        )
    return table


@contextmanager
def _stages() -> Iterator[Callable[[str], object]]:
    """Say on stderr what is computed: a line with a clock; without a terminal, plain lines."""
    screen = Console(stderr=True, highlight=False)
    if not screen.is_terminal:
        yield lambda stage: screen.print(f"computing {stage} ...", markup=False)
        return
    columns = (SpinnerColumn(), TextColumn("{task.description}", markup=False), TimeElapsedColumn())
    with Progress(*columns, console=screen, transient=True) as line:
        task = line.add_task("", total=None)
        yield lambda stage: line.update(task, description=f"computing {stage}")


def _bound(flight: Flight, say: Callable[[str], object]) -> dict[str, Any]:
    """The lower bound of the mission, and how far above it the flight is, where there is one."""
    from uas_coverage_env.bound import MissionBound  # a second that other flights need not wait

    began = time.perf_counter()
    least: dict[str, Any] = {"energy_Wh": None, "steps": None, "above": None, "why_not": None}
    if flight.dynamics != "lpv":
        return least | {"why_not": "it holds for the LPV model only"}
    try:
        of_mission = MissionBound(flight.scenario)
    except ValueError as error:
        return least | {"why_not": str(error)}
    name = flight.scenario.name
    say(f"the fewest steps of {name}")
    least["steps"] = of_mission.steps
    say(f"the least energy of {name}")
    least["energy_Wh"] = of_mission.energy_Wh()
    if accomplished(flight):
        say(f"the least energy of {name} in {flight.steps} steps")
        flown_Wh = flight.figures["energy_Wh"]
        in_steps_Wh = of_mission.energy_Wh(flight.steps)
        least |= {"energy_Wh": in_steps_Wh, "above": flown_Wh / in_steps_Wh - 1.0}
    return least | {"computed_in_s": time.perf_counter() - began}


def _bound_cell(least: dict[str, Any] | None, name: str) -> str:
    if least is None or least["energy_Wh"] is None:
        return least["why_not"] if least and name.startswith("least") else NOTHING
    if name.startswith("above"):
        return "mission not accomplished" if least["above"] is None else f"{least['above']:.1%}"
    return {
        "least energy, Wh": f"{least['energy_Wh']:.2f}",
        "fewest steps": str(least["steps"]),
        "bound computed in, s": f"{least['computed_in_s']:.1f}",
    }[name]
