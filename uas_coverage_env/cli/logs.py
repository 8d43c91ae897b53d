"""`uas-coverage log`: what was flown comes back in."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import numpy as np
import typer
from rich.table import Table

from uas_coverage_env.cli.flights import keep_flight, report_flight
from uas_coverage_env.cli.operations import asked_place, ops
from uas_coverage_env.cli.options import PlaceOption, ReplaceFlightOption
from uas_coverage_env.cli.output import console, warn
from uas_coverage_env.cli.sorties import load_planned
from uas_coverage_env.files.errors import InputError
from uas_coverage_env.flight.directory import check_directory

if TYPE_CHECKING:
    from uas_coverage_env.operations.logs.logged import Logged


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
    check_directory(out, overwrite=overwrite)
    planned = load_planned(plan)
    scenario = planned.scenario
    there = place_of_flight(planned, asked_place(place))
    numbers = _chosen("--flight", flight, planned.names)
    batteries = _chosen("--battery", battery, planned.names)
    with ops():
        found = _by_uas(logs, planned.names, batteries)
        made = flown_flight(planned, found, LocalFrame(there), numbers)
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
    warn(made.notes)


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


def _by_uas(
    logs: Sequence[str], names: Sequence[str], batteries: Mapping[str, int]
) -> "dict[str, Logged]":
    """The logs by the UAS that they are of."""
    from uas_coverage_env.operations.logs.read_log import read_log

    found: dict[str, Logged] = {}
    for text in logs:
        given, equals, rest = text.partition("=")
        told = given if equals and given in names else ""
        path, system = _path_and_system(rest if told else text)
        meant = told or _named_like(path, names)
        for logged in _of_system(path, read_log(path, batteries.get(meant)), system):
            name = told or logged.uas or meant
            if name not in names:
                what = f"is of {name[:40]!r}" if name else "does not say of which UAS it is"
                raise InputError(
                    f"{path}: {what}; give UAS={path.name}, where the plan has {', '.join(names)}"
                )
            if name in found:
                raise InputError(f"{path}: is a second log of {name}; give one")
            found[name] = logged
    return found


def _path_and_system(text: str) -> tuple[Path, int | None]:
    """A file, and which vehicle of it: the number behind a colon, unless a file is called so."""
    before, colon, number = text.rpartition(":")
    if colon and number.isascii() and number.isdecimal() and not Path(text).exists():
        return Path(before), int(number)
    return Path(text), None


def _of_system(path: Path, logs: "list[Logged]", system: int | None) -> "list[Logged]":
    """The log of a vehicle, all of a table; of several vehicles of a link one is to be chosen."""
    systems = [logged.system for logged in logs if logged.system is not None]
    listed = ", ".join(map(str, systems))
    if system is None:
        if len(systems) > 1:
            raise InputError(
                f"{path}: holds several vehicles (systems {listed}); choose one for each UAS, as "
                f"in UAS={path.name}:{systems[0]}"
            )
        return logs
    if system not in systems:
        raise InputError(f"{path}: has no vehicle of system {system}; it has {listed or 'none'}")
    return [logged for logged in logs if logged.system == system]


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
