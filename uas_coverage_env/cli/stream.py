"""`uas-coverage stream`: a plan flown in time by real or simulated autopilots."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import typer

from uas_coverage_env.cli.operations import asked_place, ops
from uas_coverage_env.cli.options import FlightDirectory, PlaceOption, check_file, declared, taken
from uas_coverage_env.cli.output import FAILED, console
from uas_coverage_env.files.errors import InputError
from uas_coverage_env.files.plain_files import write_atomically
from uas_coverage_env.flight import Flight


@dataclass(frozen=True, kw_only=True)
class Asked:
    """What is asked of `stream`; named as in `StreamOptions` where it is one of these."""

    directory: FlightDirectory
    connect: Annotated[
        list[str],
        typer.Option(
            metavar="UAS=ADDRESS",
            help="Where each UAS is, such as uas_1=udp:127.0.0.1:14550 (udp and udpin listen, "
            "udpout and tcp connect).",
        ),
    ]
    lag_m: Annotated[
        float,
        typer.Option(
            "--lag", help="Behind, or off its path, by so much, m, a UAS lets all come to a stand."
        ),
    ] = 5.0
    patience_s: Annotated[
        float,
        typer.Option(
            "--patience", help="Seconds that all may stand before the stream is given up."
        ),
    ] = 60.0
    reaction: Annotated[
        str,
        typer.Option(
            "--on-abort",
            help="What UAS do then, and on Ctrl-C: home (the way they came), rtl (straight home), "
            "land or hold; where that is not clear, the next best.",
        ),
    ] = "home"
    late: Annotated[
        float,
        typer.Option(help="Percent that streaming may take longer than planned, or it is refused."),
    ] = 5.0
    track: Annotated[
        Path | None, typer.Option(help="Table of what was flown (.csv), for `log`.")
    ] = None
    place: PlaceOption = None
    yes: Annotated[bool, typer.Option("--yes", help="Do not ask before vehicles arm.")] = False
    overwrite: Annotated[
        bool, typer.Option("--overwrite", help="Replace --track where it exists.")
    ] = False


@declared
def stream(asked: Asked) -> None:
    """Fly a plan in time on ArduPilot or PX4, by MAVLink position targets (extra `ops`).

    Ctrl-C gives all vehicles the mode of --on-abort and waits for them to land; a second one ends
    at once.
    """
    with ops():
        from uas_coverage_env.operations.flight_checks import place_of_flight
        from uas_coverage_env.operations.stream import RealClock, StreamOptions, stream_flight
    if asked.track is not None:
        check_file(asked.track, (".csv",), overwrite=asked.overwrite)
    connections = _connections(asked.connect)
    flight = Flight.load(asked.directory)
    where = place_of_flight(flight, asked_place(asked.place))
    if not asked.yes and not _agrees(len(connections)):
        raise InputError("vehicles would arm and take off; say yes, or add --yes")
    screen = console()
    ended, table = stream_flight(
        flight,
        where,
        connections,
        taken(StreamOptions, asked, late=0.01 * asked.late),
        RealClock(),
        lambda line: screen.print(line, markup=False),
    )
    if asked.track is not None:
        write_atomically(asked.track, table.encode())
        screen.print(f"what was flown is in {asked.track}", markup=False)
    if ended.reason:
        screen.print(f"given up: {ended.reason}", markup=False)
        screen.print(ended.done, markup=False)
        raise typer.Exit(FAILED)
    screen.print(f"all have landed, {ended.late_s:.0f} s later than planned")


def _connections(connect: list[str]) -> dict[str, str]:
    result: dict[str, str] = {}
    for text in connect:
        name, equals, address = text.partition("=")
        if not name or not equals or not address:
            raise InputError(
                f"--connect {text[:60]!r}: should be UAS=ADDRESS, as in uas_1=udp:127.0.0.1:14550"
            )
        for what, known in ((name, result), (address, result.values())):
            if what in known:
                raise InputError(f"--connect {text[:60]!r}: {what[:40]} is connected already")
        result[name] = address
    return result


def _agrees(count: int) -> bool:
    try:
        return typer.confirm(f"{count} vehicles will arm and take off now. Go on?")
    except typer.Abort:
        return False
