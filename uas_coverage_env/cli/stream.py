"""`uas-coverage stream`: a plan flown in time by real or simulated autopilots."""

from pathlib import Path
from typing import Annotated

import typer

from uas_coverage_env.cli.operations import asked_place, extra
from uas_coverage_env.cli.output import FAILED, console
from uas_coverage_env.cli.replay import check_file
from uas_coverage_env.files.errors import InputError
from uas_coverage_env.files.plain_files import write_atomically
from uas_coverage_env.flight import Flight


def stream(
    directory: Annotated[Path, typer.Argument(metavar="DIR", help="Flight directory.")],
    connect: Annotated[
        list[str],
        typer.Option(
            metavar="UAS=ADDRESS",
            help="Where each UAS is, such as uas_1=udp:127.0.0.1:14550 (udp and udpin listen, "
            "udpout and tcp connect).",
        ),
    ],
    lag: Annotated[
        float,
        typer.Option(
            help="Behind, or off its path, by so much, m, a UAS lets all come to a stand."
        ),
    ] = 5.0,
    patience: Annotated[
        float, typer.Option(help="Seconds that all may stand before the stream is given up.")
    ] = 60.0,
    on_abort: Annotated[
        str,
        typer.Option(
            help="What UAS do then, and on Ctrl-C: home (the way they came), rtl (straight home), "
            "land or hold; where that is not clear, the next best."
        ),
    ] = "home",
    late: Annotated[
        float,
        typer.Option(help="Percent that streaming may take longer than planned, or it is refused."),
    ] = 5.0,
    track: Annotated[
        Path | None, typer.Option(help="Table of what was flown (.csv), for `import-log`.")
    ] = None,
    place: Annotated[
        str | None,
        typer.Option(metavar="LAT,LON", help="Of the origin, for a scenario without [place]."),
    ] = None,
    yes: Annotated[bool, typer.Option("--yes", help="Do not ask before vehicles arm.")] = False,
    overwrite: Annotated[
        bool, typer.Option("--overwrite", help="Replace --track where it exists.")
    ] = False,
) -> None:
    """Fly a plan in time on ArduPilot or PX4, by MAVLink position targets (extra `ops`).

    Ctrl-C gives all vehicles the mode of --on-abort and waits for them to land; a second one ends
    at once.
    """
    with extra():
        from uas_coverage_env.operations.flight_checks import place_of_flight
        from uas_coverage_env.operations.stream import RealClock, StreamOptions, stream_flight
    if track is not None:
        check_file(track, (".csv",), overwrite=overwrite)
    connections = _connections(connect)
    flight = Flight.load(directory)
    where = place_of_flight(flight, asked_place(place))
    if not yes and not _agrees(len(connections)):
        raise InputError("vehicles would arm and take off; say yes, or add --yes")
    screen = console()
    ended, table = stream_flight(
        flight,
        where,
        connections,
        StreamOptions(lag_m=lag, patience_s=patience, reaction=on_abort, late=0.01 * late),
        RealClock(),
        lambda line: screen.print(line, markup=False),
    )
    if track is not None:
        write_atomically(track, table.encode())
        screen.print(f"what was flown is in {track}", markup=False)
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
