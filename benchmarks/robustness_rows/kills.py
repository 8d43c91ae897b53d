"""R8: what is left of a flight whose process is ended at any moment."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Mapping
from pathlib import Path

import numpy as np
from independent_check import BadFlightError, check

from robustness_rows.row import Finding, Result, Row, Trial, errors, markdown
from uas_coverage_env import generate_scenario
from uas_coverage_env.files.strict_toml import InputError
from uas_coverage_env.flight import Flight

FIRST_SEED = 11_000
_LONGEST_S = 600.0
# the time of a flight, made long enough to be hit: a planner that decides in half a second
_FLIGHT = ("--planner", "milp-mpc-guided", "--option", "time_limit_s=0.3")
_PROGRAM = "import sys; from uas_coverage_env.cli import main; sys.exit(main(sys.argv[1:]))"


def killed(how: str, seed: int) -> Result:
    """One flight that is ended some time after its folder or its first step could be there.

    Args:
        how: `SIGKILL`, `SIGTERM` or `SIGINT`.
        seed: Draws when; every second one overwrites a flight that is there.
    """
    rng = np.random.default_rng([seed, len(how)])
    with tempfile.TemporaryDirectory() as folder:
        town, out = Path(folder) / "town.toml", Path(folder) / "flight"
        generate_scenario(seed, n_uas=1, n_waypoints=5, n_obstacles=2).to_file(town)
        command = [sys.executable, "-c", _PROGRAM, "run", str(town), "--out", str(out)]
        process = subprocess.Popen(
            [*command, *_FLIGHT], stdout=subprocess.DEVNULL, stderr=subprocess.PIPE
        )
        until = time.monotonic() + float(rng.uniform(2.0, 25.0))
        while process.poll() is None and time.monotonic() < until:
            time.sleep(0.05)
        ended = process.poll() is not None
        if not ended:
            os.kill(process.pid, getattr(signal, how))
        _, said = process.communicate(timeout=_LONGEST_S)
        outcome = "ended before" if ended else _left(out)
        litter = [path.name for path in Path(folder).iterdir() if path.name.startswith(".")]
    return {
        "how": how,
        "outcome": outcome,
        "traceback": b"Traceback" in said,
        "code": process.returncode,
        "litter": len(litter),
    }


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
    return [
        Trial(f"{how} {seed}", killed, (how, seed))
        for seed in range(FIRST_SEED, FIRST_SEED + (2 if quick else 67))
        for how in ("SIGKILL", "SIGTERM", "SIGINT")
    ]


def finding(results: Mapping[str, Result]) -> Finding:
    """A kill fails where it leaves what is no flight, or ends in a traceback."""
    cells: dict[str, Counter[str]] = {}
    failed = len(errors(results))
    for result in results.values():
        if "error" in result:
            continue
        tally = cells.setdefault(result["how"], Counter())
        tally[result["outcome"]] += 1
        tally["traceback"] += result["traceback"]
        failed += result["traceback"] or result["outcome"] in ("damaged", "disagrees")
    names = ("nothing", "a whole flight", "ended before", "damaged", "disagrees", "traceback")
    rows = [
        (how, sum(tally[n] for n in names[:5]), *(tally[n] for n in names))
        for how, tally in cells.items()
    ]
    return Finding(len(results), failed, markdown(("ended by", "flights", *names), rows))


ROW = Row(
    "R8",
    "Kills",
    "kills",
    "nothing is left of the flight, or a whole flight up to that moment with which the independent "
    "checker agrees; no traceback",
    trials,
    finding,
    lambda quick: f"from {FIRST_SEED} on; the seed draws the moment, 2 to 25 s after the start",
    "Kills in `--overwrite`, of `compare` and of `train`, and a full disk.",
)
