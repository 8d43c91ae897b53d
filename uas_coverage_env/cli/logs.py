"""`uas-coverage import-log`: what was flown comes back in."""

import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import numpy as np
import typer
from rich.table import Table

from uas_coverage_env.cli.flights import keep_flight, report_flight
from uas_coverage_env.cli.operations import asked_place, extra
from uas_coverage_env.cli.output import console, one_line
from uas_coverage_env.files.errors import InputError
from uas_coverage_env.flight import Flight, check_directory

if TYPE_CHECKING:
    from uas_coverage_env.operations.logs import Logged


def import_log(
    logs: Annotated[
        list[str],
        typer.Argument(
            metavar="[UAS=]LOG...",
            help="One file per UAS, named like it, or a table of several: .csv, or .bin and .tlog "
            "of ArduPilot.",
        ),
    ],
    plan: Annotated[Path, typer.Option(help="Flight directory whose files were flown.")],
    out: Annotated[Path, typer.Option(help="Flight directory to write.")],
    place: Annotated[
        str | None,
        typer.Option(metavar="LAT,LON", help="Of the origin, for a scenario without [place]."),
    ] = None,
    overwrite: Annotated[
        bool, typer.Option("--overwrite", help="Replace the flight in --out.")
    ] = False,
) -> None:
    """Make a flight directory from logs of UAS that flew, judged by the rules (extra `ops`)."""
    with extra():
        from uas_coverage_env.operations import LocalFrame, flown_flight
        from uas_coverage_env.operations.export import place_of_flight
    check_directory(out, overwrite=overwrite)
    planned = Flight.load(plan)
    scenario = planned.scenario
    there = place_of_flight(planned, asked_place(place))
    with extra():
        made = flown_flight(planned, _by_uas(logs, planned.names), LocalFrame(there))
    keep_flight(made.flight, out, overwrite=overwrite)
    screen = console()
    report_flight(screen, made.flight, out)
    table = Table("UAS", "flown, s", "planned, s", "off the path, p95, m", "largest, m", box=None)
    for i, name in enumerate(planned.names):
        if name in made.off_path_m:
            off_m = made.off_path_m[name]
            table.add_row(
                name,
                f"{made.flight.last_sample[i] * scenario.dt_s:.0f}",
                f"{planned.last_sample[i] * scenario.dt_s:.0f}",
                f"{np.percentile(off_m, 95):.1f}",
                f"{off_m.max():.1f}",
            )
    screen.print(table)
    screen.print(f"beside its plan: uas-coverage replay {plan} {out}", markup=False)
    for note in made.notes:
        sys.stderr.write(f"warning: {one_line(note)}\n")


def _by_uas(logs: Sequence[str], names: Sequence[str]) -> "dict[str, Logged]":
    """The logs by the UAS that they are of."""
    from uas_coverage_env.operations.logs import read_log

    found: dict[str, Logged] = {}
    for text in logs:
        given, equals, rest = text.partition("=")
        told = given if equals and given in names else ""
        path = Path(rest if told else text)
        for logged in read_log(path):
            name = told or logged.uas or _named_like(path, names)
            if name not in names:
                what = f"is of {name[:40]!r}" if name else "does not say of which UAS it is"
                raise InputError(
                    f"{path}: {what}; give UAS={path.name}, where the plan has {', '.join(names)}"
                )
            if name in found:
                raise InputError(f"{path}: is a second log of {name}; give one")
            found[name] = logged
    return found


def _named_like(path: Path, names: Sequence[str]) -> str:
    """The UAS whose name a file has, or begins with."""
    if len(names) == 1:
        return names[0]
    like = [
        name
        for name in names
        if path.stem == name or path.stem.startswith((f"{name}.", f"{name}_", f"{name}-"))
    ]
    return max(like, key=len, default="")
