"""The shipped policies with 1 to 8 UAS: the same weights, towns that nobody has trained on.

    python benchmarks/fleets.py                  # agents/README.md, a few minutes
    python benchmarks/fleets.py --fleets 8 --missions 50

Flies towns of the validation seeds with as many UAS as asked for; differences to nearest-waypoint
are paired town by town. `learned-waypoint` is flown by its network alone (`simulations=0`).
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence

import numpy as np
from learners import MEASURED, flown_by, machine, measured_cells, put
from numpy.typing import NDArray
from uas_coverage_agents.training.scenarios import VALIDATION, town

from uas_coverage_env import Scenario

NAME = "fleets"
REFERENCE = "nearest-waypoint"
PLANNERS: dict[str, dict[str, str]] = {
    REFERENCE: {},
    "learned-waypoint": {"simulations": "0"},
    "learned-velocity": {},
}
HEAD = ("UAS", "planner", *MEASURED)


def main(argv: Sequence[str] | None = None) -> int:
    """Fly, print and fill the README; the exit code."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--fleets", default="1,2,4,8", help="numbers of UAS; default 1,2,4,8")
    parser.add_argument("--missions", type=int, default=20, help="towns for each")
    arguments = parser.parse_args(argv)
    numbers = arguments.fleets.split(",")
    fleets = [int(number) for number in numbers if number.isdecimal()]
    fits = len(fleets) == len(numbers) and all(1 <= n_uas <= 64 for n_uas in fleets)
    if not 1 <= arguments.missions <= 100 or not fits:
        parser.error("--missions: 1 to 100; --fleets: 1 to 64 each")
    lines = [
        f"`python benchmarks/fleets.py --fleets {arguments.fleets} "
        f"--missions {arguments.missions}`; {machine()}.",
        "",
        f"| {' | '.join(HEAD)} |",
        f"|---:|---|{'---:|' * (len(HEAD) - 2)}",
    ]
    for n_uas in fleets:
        towns = towns_of(n_uas, arguments.missions)
        results = {name: flown(name, towns) for name in PLANNERS}
        lines += [row(n_uas, name, results[name], results[REFERENCE]) for name in PLANNERS]
    text = "\n".join(lines)
    sys.stdout.write(f"{text}\n")
    put(NAME, text)
    return 0


def towns_of(n_uas: int, missions: int) -> list[Scenario]:
    """Validation towns with a fleet of this size."""
    fleet = VALIDATION.model_copy(update={"n_uas": (n_uas, n_uas)})
    return [town(fleet, number) for number in range(missions)]


def flown(name: str, towns: Sequence[Scenario]) -> NDArray[np.float64]:
    """(missions, measures) of a planner."""
    return flown_by(name, towns, PLANNERS[name])


def row(n_uas: int, name: str, result: NDArray[np.float64], reference: NDArray[np.float64]) -> str:
    """A line of the table."""
    others = None if name == REFERENCE else reference
    return f"| {' | '.join([str(n_uas), f'`{name}`', *measured_cells(result, others)])} |"


if __name__ == "__main__":
    sys.exit(main())
