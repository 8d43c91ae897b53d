"""Flights that are ended at a drawn moment, for `kills`; what is left of them is looked at there.

    python benchmarks/robustness_rows/ended_flights.py FOLDER SIGKILL 11000 11001

A program of its own: it compiles everything once and forks a process for each flight, so that no
time passes before there is anything to end, and nothing but this thread is there to be forked.
"""

from __future__ import annotations

import contextlib
import json
import os
import shutil
import signal
import sys
import time
import traceback
from pathlib import Path
from typing import Any

import numpy as np

from uas_coverage_env import generate_scenario
from uas_coverage_env.cli import main

_AFTER_THE_END = 1.1  # moments are drawn up to so much of a flight's time


def fly_and_end(folder: Path, how: str, seed: int) -> dict[str, Any]:
    """One flight that is ended at a drawn moment: between taking off and its last file.

    Args:
        folder: For the scenario, the flight and what is said.
        how: `SIGKILL`, `SIGTERM` or `SIGINT`.
        seed: Draws scenario and moment; every second flight overwrites one that is there.
    """
    rng = np.random.default_rng([seed, len(how)])
    town, out, said = folder / "town.toml", folder / "flight", folder / "said"
    generate_scenario(seed, n_uas=2, n_waypoints=int(rng.integers(4, 40)), n_obstacles=4).to_file(
        town
    )
    command = ["run", str(town), "--out", str(out), "--planner", "nearest-waypoint"]
    began = time.monotonic()
    _wait(_forked(command, said))  # how long it takes is known now
    lasts_s = time.monotonic() - began
    if seed % 2:
        command.append("--overwrite")
    else:
        shutil.rmtree(out)
    child, until = _forked(command, said), rng.uniform(0.0, _AFTER_THE_END * lasts_s)
    time.sleep(until)
    ended, status = os.waitpid(child, os.WNOHANG)
    if not ended:
        os.kill(child, getattr(signal, how))
        status = _wait(child)
    code, text = os.waitstatus_to_exitcode(status), said.read_text(errors="replace")
    # by the signal, as a process that has not begun to handle it, or by a code of its own
    number = getattr(signal, how)
    crashed = "Traceback" in text or code not in (0, 1, -number, 128 + number)
    return {"ended": bool(ended), "code": code, "crashed": crashed, "said": text[-600:] * crashed}


def _wait(child: int) -> int:
    return os.waitpid(child, 0)[1]


def _forked(command: list[str], said: Path) -> int:  # pyrefly: ignore[bad-return]
    """Begin `uas-coverage` with these arguments; returns the process's number once it runs."""
    runs, begins = os.pipe()
    child = os.fork()
    if child:
        os.close(begins)
        os.read(runs, 1)
        os.close(runs)
        return child
    code = 1
    try:
        with said.open("wb") as file:
            os.dup2(file.fileno(), 1)
            os.dup2(file.fileno(), 2)
        os.write(begins, b".")
        code = main(command)
    except BaseException:
        traceback.print_exc()
    finally:
        with contextlib.suppress(BaseException):
            sys.stdout.flush()
            sys.stderr.flush()
        os._exit(code)


def _serve(place: str, how: str, *seeds: str) -> None:
    """A line of JSON for each flight, after one that compiles everything."""
    first = Path(place) / "first"
    first.mkdir()
    # this is where compiling is done, which no child does again
    with (first / "said").open("w") as said, contextlib.redirect_stdout(said):
        generate_scenario(1, n_uas=2, n_waypoints=4, n_obstacles=2).to_file(first / "town.toml")
        out = str(first / "flight")
        main(["run", str(first / "town.toml"), "--out", out, "--planner", "nearest-waypoint"])
    for seed in seeds:
        result = fly_and_end(Path(place) / seed, how, int(seed))
        sys.stdout.write(json.dumps(result) + "\n")
        sys.stdout.flush()


if __name__ == "__main__":
    _serve(*sys.argv[1:])
