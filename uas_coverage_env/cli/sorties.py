"""Sorties of `uas-coverage run`: a flight directory for each, and one summary."""

import dataclasses
import json
import shutil
import sys
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.table import Table

from uas_coverage_env.cli.flights import keep_flight
from uas_coverage_env.cli.output import DONE, FAILED
from uas_coverage_env.files.errors import InputError
from uas_coverage_env.files.output_dir import write_files
from uas_coverage_env.files.plain_files import read_text
from uas_coverage_env.flight import Flight, sorties_summary
from uas_coverage_env.interruptions import STOPPED
from uas_coverage_env.scenario import Place

SUMMARY = "sorties.json"
_MOST_BYTES = 10_000_000
_PLANNED = "planned"
"""The flight of an export, beside its files; with a number, a sortie."""


def keep_sorties(
    screen: Console, sorties: Iterable[Flight], directory: Path, *, overwrite: bool
) -> int:
    """Write each sortie as soon as it has been flown, and print what came of all.

    Returns:
        The exit code.
    """
    (directory / SUMMARY).unlink(missing_ok=True)
    flights: list[Flight] = []
    stopped = False
    for number, flight in enumerate(sorties, start=1):
        stopped = keep_flight(flight, directory / f"sortie_{number}", overwrite=overwrite)
        flights.append(flight)
        if stopped:
            break
    result = sorties_summary(flights, stopped=stopped)
    text = json.dumps(result, indent=2, allow_nan=False) + "\n"
    write_files(directory, {SUMMARY: text.encode()})
    _report(screen, result, directory)
    for path in sorted(directory.glob("sortie_*")):
        number = path.name.removeprefix("sortie_")
        if number.isdigit() and int(number) > len(flights):
            sys.stderr.write(f"warning: {path}: is of an earlier run\n")
    if stopped or result["ended"] == "stopped":
        return STOPPED
    done = result["left"] == 0 and result["all_home"] and not result["violations"]
    return DONE if done else FAILED


def load_flights(directory: Path) -> list[Flight]:
    """The flight of a directory, or all sorties of one that `keep_sorties` has written.

    Raises:
        InputError: It is neither, or was damaged.
    """
    path = directory / SUMMARY
    if not path.is_file():
        return [Flight.load(directory)]
    try:
        count = len(json.loads(read_text(path, _MOST_BYTES))["sorties"])
    except (ValueError, KeyError, TypeError):
        count = 0
    if not count:
        raise InputError(f"{path}: holds no list of sorties; fly the mission again")
    return [Flight.load(directory / f"sortie_{number}") for number in range(1, count + 1)]


def keep_planned(flights: Sequence[Flight], out: Path, place: Place | None) -> None:
    """Keep the flights whose files a directory holds beside these, for `log`.

    Args:
        flights: Of the export.
        out: Its directory.
        place: Of the origin, where the scenario does not say.
    """
    for path in out.glob(f"{_PLANNED}*"):
        if path.is_dir():
            shutil.rmtree(path)
    for number, flight in enumerate(flights, start=1):
        if place is not None:
            there = flight.scenario.model_copy(update={"place": place})
            flight = dataclasses.replace(flight, scenario=there)
        flight.save(out / (_PLANNED if len(flights) == 1 else f"{_PLANNED}_{number}"))


def planned_directory(directory: Path) -> Path:
    """Where the flight is whose files were flown.

    Args:
        directory: That of the export, or the flight directory itself.

    Raises:
        InputError: It holds several sorties.
    """
    several = sorted(directory.glob(f"{_PLANNED}_*"))
    if several:
        raise InputError(
            f"{directory}: holds {len(several)} sorties; give the one that was flown, as in "
            f"--plan {several[0]}"
        )
    inside = directory / _PLANNED
    return inside if inside.is_dir() else directory


def _report(screen: Console, result: dict[str, Any], directory: Path) -> None:
    head = ("sortie", "begins, s", "lasts, s", "covered", "left", "energy, Wh", "charge landed")
    table = Table(*head, box=None)
    for number, entry in enumerate(result["sorties"], start=1):
        table.add_row(
            str(number),
            f"{entry['begins_s']:.0f}",
            f"{entry['time_s']:.0f}",
            str(entry["covered"]),
            str(entry["left"]),
            f"{entry['energy_Wh']:.2f}",
            ", ".join(f"{soc:.0%}" for soc in entry["soc_landed"].values()),
        )
    screen.print(table)
    packs = ", ".join(f"{name} {used}" for name, used in result["packs"].items())
    ended = "" if result["ended"] == "complete" else f" ({result['ended']})"
    screen.print(
        f"covered {result['coverage']:.0%} in {len(result['sorties'])} sorties{ended}; "
        f"{result['time_s'] / 60.0:.1f} min with swaps of {result['swap_s']:g} s; "
        f"{result['energy_Wh']:.2f} Wh; packs used: {packs}; {result['violations']} violations, "
        f"{result['breaches']} breaches",
        markup=False,
    )
    screen.print(f"flights and {SUMMARY} in {directory}", markup=False)
    screen.print(f"to watch one: uas-coverage replay {directory / 'sortie_1'}", markup=False)
