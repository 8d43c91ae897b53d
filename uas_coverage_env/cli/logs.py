"""`uas-coverage log`: what was flown comes back in."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import numpy as np
import typer
from rich.table import Table

from uas_coverage_env.cli.flights import keep_flight, report_flight
from uas_coverage_env.cli.operations import asked_place, ops
from uas_coverage_env.cli.options import PlaceOption, ReplaceFlightOption
from uas_coverage_env.cli.output import console, warn
from uas_coverage_env.cli.sorties import planned_directory
from uas_coverage_env.files.errors import InputError
from uas_coverage_env.flight import Flight
from uas_coverage_env.flight.directory import check_directory

if TYPE_CHECKING:
    from uas_coverage_env.operations.logs.import_log import Flown


def log(
    logs: Annotated[
        list[str],
        typer.Argument(
            metavar="[UAS=]LOG[:SYSTEM]...",
            help="One file per UAS, named like it, or a table of several: .csv, .bin and .tlog of "
            "ArduPilot, .ulg of PX4. SYSTEM chooses a vehicle of a .tlog that holds several.",
        ),
    ],
    plan: Annotated[
        Path,
        typer.Option(
            metavar="EXPORT", help="Directory of the files that were flown, or of their flight."
        ),
    ],
    out: Annotated[Path, typer.Option(help="Flight directory to write.")],
    place: PlaceOption = None,
    flight: Annotated[
        list[str] | None,
        typer.Option(
            metavar="[UAS=]N",
            help="Which flight of a log that holds several, from 1 on; of one UAS, or of all.",
        ),
    ] = None,
    battery: Annotated[
        list[str] | None,
        typer.Option(
            metavar="[UAS=]N",
            help="Which battery monitor, from 1 on, of one UAS, or of all; otherwise the first.",
        ),
    ] = None,
    overwrite: ReplaceFlightOption = False,
) -> None:
    """Make a flight directory from logs of UAS that flew, judged by the rules (extra `ops`)."""
    with ops():
        from uas_coverage_env.operations import LocalFrame, flown_flight
        from uas_coverage_env.operations.flight_checks import place_of_flight
        from uas_coverage_env.operations.logs.fleet_logs import read_fleet_logs
    check_directory(out, overwrite=overwrite)
    plan = planned_directory(plan)
    planned = Flight.load(plan)
    there = place_of_flight(planned, asked_place(place))
    numbers = _chosen("--flight", flight, planned.names)
    batteries = _chosen("--battery", battery, planned.names)
    with ops():
        found = read_fleet_logs(logs, planned.names, batteries)
        made = flown_flight(planned, found, LocalFrame(there), numbers)
    keep_flight(made.flight, out, overwrite=overwrite)
    screen = console()
    report_flight(screen, made.flight, out)
    screen.print(_off_path(planned, made))
    screen.print(f"beside its plan: uas-coverage replay {plan} {out}", markup=False)
    warn(made.notes)


def _off_path(planned: Flight, made: "Flown") -> Table:
    """How long each UAS flew, and how far from its planned path."""
    table = Table("UAS", "flown, s", "planned, s", "off the path, p95, m", "largest, m", box=None)
    for i, name in enumerate(planned.names):
        if name in made.off_path_m:
            off_m = made.off_path_m[name]
            table.add_row(
                name,
                f"{made.flight.last_sample[i] * planned.scenario.dt_s:.0f}",
                f"{planned.last_sample[i] * planned.scenario.dt_s:.0f}",
                f"{np.percentile(off_m, 95):.1f}",
                f"{off_m.max():.1f}",
            )
    return table


def _chosen(option: str, texts: Sequence[str] | None, names: Sequence[str]) -> dict[str, int]:
    """UAS -> the number that an option gives it; one without a UAS is that of all."""
    found: dict[str, int] = {}
    for text in texts or ():
        name, equals, number = text.rpartition("=")
        if equals and name not in names:
            raise InputError(
                f"{option} {text}: there is no UAS {name!r}; the plan has {', '.join(names)}"
            )
        if not (number.isascii() and number.isdecimal() and int(number) >= 1):
            raise InputError(f"{option} {text}: give a number from 1 on, or UAS=NUMBER")
        for of in [name] if equals else names:
            if found.setdefault(of, int(number)) != int(number):
                raise InputError(f"{option} {text}: {of} is given another one, too; give one")
    return found
