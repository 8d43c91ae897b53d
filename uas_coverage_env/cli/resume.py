"""`uas-coverage scenario resume`: the rest of a mission that was broken off."""

from pathlib import Path
from typing import Annotated

import typer

from uas_coverage_env.cli.options import ReplaceFileOption, check_new_toml
from uas_coverage_env.cli.output import console
from uas_coverage_env.files.plain_files import write_atomically
from uas_coverage_env.flight import Flight, rest_of
from uas_coverage_env.flight.record import LANDED, LOST


def resume(
    directory: Annotated[
        Path,
        typer.Argument(metavar="DIR", help="Flight directory, of `run` or of `log`."),
    ],
    out: Annotated[Path, typer.Option(help="Scenario file to write.")],
    from_here: Annotated[
        bool,
        typer.Option(
            "--from-here",
            help="UAS go on from where they were, with the charge that they had; default: all "
            "start at home with fresh packs.",
        ),
    ] = False,
    overwrite: ReplaceFileOption = False,
) -> None:
    """Write the scenario of what a flight has left to cover."""
    check_new_toml(out, overwrite=overwrite)
    flight = Flight.load(directory)
    rest = rest_of(flight, from_here=from_here)
    write_atomically(out, rest.file_text().encode())
    screen = console()
    modes = flight.mode[-1]
    for i, name in enumerate(flight.names):
        if modes[i] == LOST:
            screen.print(f"{name} was lost and is left out", markup=False)
        elif from_here and modes[i] != LANDED:
            screen.print(f"{name} goes on with {flight.soc[-1, i]:.1%} of charge", markup=False)
    left = len(rest.waypoints)
    asked = left + int(flight.covered[-1])
    screen.print(f"{left} of {asked} waypoints are left; scenario in {out}", markup=False)
