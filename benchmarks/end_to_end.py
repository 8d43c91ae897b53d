"""How `learned-velocity` fares alone: without safety filter, without return mode.

    python benchmarks/end_to_end.py                  # a few minutes
    python benchmarks/end_to_end.py --missions 20

Flies validation towns with ever more obstacles, on which nothing was trained.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence

import numpy as np
from learners import shown
from numpy.typing import NDArray
from uas_coverage_agents.training.scenarios import VALIDATION, town

from uas_coverage_env import Scenario, load_planner, rollout
from uas_coverage_env.flight.metrics import coverage, energy_Wh, home

PLANNER = "learned-velocity"
LEVELS = {"none": (0, 0), "1 to 3": (1, 3), "5 to 20": VALIDATION.n_obstacles}
HEAD = (
    "obstacles", "covered, %", "all home, %", "UAS lost, %", "energy, Wh", "steps",
)  # fmt: skip


def main(argv: Sequence[str] | None = None) -> int:
    """Fly and print; the exit code."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--missions", type=int, default=100, help="towns of each level")
    arguments = parser.parse_args(argv)
    if not 1 <= arguments.missions <= 100:
        parser.error("--missions: 1 to 100")
    lines = [
        f"| {' | '.join(HEAD)} |",
        f"|---|{'---:|' * (len(HEAD) - 1)}",
    ]
    lines += [row(name, flown(towns_of(name, arguments.missions))) for name in LEVELS]
    text = "\n".join(lines)
    sys.stdout.write(f"{text}\n")
    return 0


def towns_of(level: str, missions: int) -> list[Scenario]:
    """Validation towns with so many obstacles."""
    towns = VALIDATION.model_copy(update={"n_obstacles": LEVELS[level]})
    return [town(towns, number) for number in range(missions)]


def flown(towns: Sequence[Scenario]) -> NDArray[np.float64]:
    """(missions, 5) under `HEAD`."""
    planner = load_planner(PLANNER, {"filter": "false", "return_mode": "false"})
    flights = [
        rollout(scenario, planner, safety_filter=False, return_mode=False) for scenario in towns
    ]
    return np.array(
        [
            (
                100 * coverage(flight),
                100 * home(flight).all(),
                100 * (~home(flight)).mean(),
                energy_Wh(flight).sum(),
                flight.steps,
            )
            for flight in flights
        ]
    )


def row(level: str, result: NDArray[np.float64]) -> str:
    """A line of the table."""
    digits = (2, 1, 1, 2, 1)
    cells = [shown(column, n) for column, n in zip(result.T, digits, strict=True)]
    return f"| {' | '.join([level, *cells])} |"


if __name__ == "__main__":
    sys.exit(main())
