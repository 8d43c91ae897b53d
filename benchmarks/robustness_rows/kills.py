"""R8: what is left of a flight whose process is ended at any moment."""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
from collections import Counter
from collections.abc import Mapping
from pathlib import Path

from robustness_rows.row import Finding, Result, Row, Trial, errors, markdown
from uas_coverage_env.files.strict_toml import InputError
from uas_coverage_env.flight import Flight
from uas_coverage_env.independent_check import BadFlightError, check

FIRST_SEED = 11_000
KILLS_OF_A_TRIAL = 10
_LONGEST_S = 600.0
_FLIGHTS = Path(__file__).with_name("ended_flights.py")


def killed(how: str, first: int) -> Result:
    """Some flights that are ended: what is left of each.

    Args:
        how: `SIGKILL`, `SIGTERM` or `SIGINT`.
        first: Seed of the first.
    """
    seeds = range(first, first + KILLS_OF_A_TRIAL)
    with tempfile.TemporaryDirectory() as place:
        folders = [Path(place) / str(seed) for seed in seeds]
        for folder in folders:
            folder.mkdir()
        command = [sys.executable, str(_FLIGHTS), place, how, *(str(seed) for seed in seeds)]
        made = subprocess.run(command, capture_output=True, timeout=_LONGEST_S, check=False)
        if made.returncode:
            raise RuntimeError(made.stderr.decode(errors="replace")[-400:])
        found = [json.loads(line) for line in made.stdout.splitlines()]
        for folder, one in zip(folders, found, strict=True):
            one["left"] = _left(folder / "flight")
            if one.pop("ended"):
                one["left"] = "ended before" if one["left"] == "a whole flight" else one["left"]
    return {"how": how, "kills": found}


def _left(out: Path) -> str:
    """What is in the folder: nothing, a whole flight, or something that is neither."""
    if not out.exists() or not any(out.iterdir()):
        return "nothing"
    try:
        Flight.load(out)
    except InputError:
        return "nothing" if not (out / "summary.json").exists() else "damaged"
    try:
        problems = check(out).problems
    except BadFlightError:
        return "damaged"
    return "disagrees" if problems else "a whole flight"


def trials(quick: bool) -> list[Trial]:
    """Some kills of each kind."""
    last = FIRST_SEED + KILLS_OF_A_TRIAL * (2 if quick else 7)
    return [
        Trial(f"{how} {first}", killed, (how, first))
        for first in range(FIRST_SEED, last, KILLS_OF_A_TRIAL)
        for how in ("SIGKILL", "SIGTERM", "SIGINT")
    ]


def finding(results: Mapping[str, Result]) -> Finding:
    """A kill fails where it leaves what is no flight, or ends in a traceback or a crash."""
    cells: dict[str, Counter[str]] = {}
    broken = KILLS_OF_A_TRIAL * len(errors(results))
    for result in results.values():
        tally = cells.setdefault(result["how"], Counter()) if "error" not in result else Counter()
        for one in result.get("kills", ()):
            tally[one["left"]] += 1
            tally["crashed"] += one["crashed"]
            tally["failed"] += one["crashed"] or one["left"] in ("damaged", "disagrees")
    names = ("nothing", "a whole flight", "ended before", "damaged", "disagrees", "crashed")
    rows = [
        (how, sum(tally[n] for n in names[:5]), *(tally[n] for n in names))
        for how, tally in cells.items()
    ]
    tried = sum(tally[n] for tally in cells.values() for n in names[:5]) + broken
    failed = sum(tally["failed"] for tally in cells.values()) + broken
    table = markdown(("ended by", "flights", *names), rows)
    crashes = [
        f"- {key}, flight {number}: code {one['code']}, `{one['said'].strip()[-200:]!r}`"
        for key, result in results.items()
        for number, one in enumerate(result.get("kills", ()))
        if one["crashed"]
    ]
    if crashes:
        table += "\n\nCrashes:\n\n" + "\n".join(crashes)
    return Finding(tried, failed, table)


ROW = Row(
    "R8",
    "Kills",
    "kills",
    "nothing is left of the flight, or a whole flight up to that moment with which the "
    "independent checker agrees; no traceback, no crash",
    trials,
    finding,
    lambda quick: (
        f"from {FIRST_SEED} on; the seed draws the town and the moment, from the start of the "
        "flight to its last file; every second flight overwrites one that is there"
    ),
    "Kills while a process starts, of `compare` and of `train`, and a full disk.",
)
