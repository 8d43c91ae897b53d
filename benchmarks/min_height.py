"""What a least height costs each planner: the same towns flown without and with it.

    python benchmarks/min_height.py                          # all planners, half an hour
    python benchmarks/min_height.py --planners tour --towns 12

Towns are those of `generate_scenario(..., min_height_m=)`, whose waypoints can be covered from
above the least height, so that both flights of a pair have the same waypoints. Prints a table: how
long the UAS are below the least height away from their landing zones, without the rule and with it,
and what it changes in steps and energy; median and range over the towns.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env import Flight, Scenario, generate_scenario, load_planner, rollout
from uas_coverage_env.flight.metrics import accomplished, energy_Wh
from uas_coverage_env.vehicle.layout import Z

PLANNERS = ("nearest-waypoint", "lawnmower", "tour", "milp-mpc")
OPTIONS = {"milp-mpc": {"horizon": 12, "threads": 1}}
HEAD = (
    *("planner", "accomplished", "low without it, %", "low with it, %"),
    *("steps without it", "steps, %", "energy, %", "fallbacks"),
)


@dataclass(frozen=True)
class Pair:
    """One town flown without and with the least height."""

    free: Flight
    kept: Flight

    def change(self, of_free: float, of_kept: float) -> float:
        """Relative change [%]."""
        return 100.0 * (of_kept / of_free - 1.0)

    @property
    def steps_percent(self) -> float:
        """By how much the mission takes longer [%]."""
        return self.change(self.free.steps, self.kept.steps)

    @property
    def energy_percent(self) -> float:
        """By how much it takes more energy [%]."""
        return self.change(energy_Wh(self.free).sum(), energy_Wh(self.kept).sum())


def low_percent(flight: Flight, scenario: Scenario) -> float:
    """Share of the samples in flight that are too low by the scenario's rule, roofs aside [%]."""
    starts_m = np.array([uas.start_m for uas in scenario.uas])
    away_m = np.linalg.norm(flight.x[:, :, :2] - starts_m[:, :2], axis=2)
    low: NDArray[np.bool_] = -flight.x[:, :, Z] < scenario.min_height_m
    flying = np.arange(len(flight.x))[:, None] < flight.last_sample
    return 100.0 * float((low & (away_m > scenario.landing_zone_m) & flying).sum() / flying.sum())


def pair_of(planner: str, town: Scenario) -> Pair:
    """A town flown without and with its least height."""
    free = town.model_copy(update={"min_height_m": 0.0})
    options = OPTIONS.get(planner, {})
    flights = [rollout(one, load_planner(planner, options), seed=0) for one in (free, town)]
    return Pair(*flights)


def row(planner: str, pairs: Sequence[Pair], town: Scenario) -> str:
    """A line of the table."""
    done = sum(accomplished(pair.free) and accomplished(pair.kept) for pair in pairs)
    cells = (
        f"`{planner}`",
        f"{done} of {len(pairs)}",
        _range([low_percent(pair.free, _with_height(pair, town)) for pair in pairs]),
        _range([low_percent(pair.kept, _with_height(pair, town)) for pair in pairs]),
        _range([pair.free.steps for pair in pairs], "d"),
        _range([pair.steps_percent for pair in pairs], "+.1f"),
        _range([pair.energy_percent for pair in pairs], "+.1f"),
        " and ".join(
            str(sum(one.fallback for pair in pairs for one in getattr(pair, which).decisions))
            for which in ("free", "kept")
        ),
    )
    return f"| {' | '.join(cells)} |"


def _with_height(pair: Pair, town: Scenario) -> Scenario:
    return pair.free.scenario.model_copy(update={"min_height_m": town.min_height_m})


def _range(values: Sequence[float], form: str = ".1f") -> str:
    middle = float(np.median(values))
    if form == "d":
        middle, values, form = round(middle), [round(value) for value in values], ".0f"
    return f"{middle:{form}} [{min(values):{form}} to {max(values):{form}}]"


def main(argv: Sequence[str] | None = None) -> int:
    """Fly and print; the exit code."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--planners", default=",".join(PLANNERS), help="separated by commas")
    parser.add_argument("--towns", type=int, default=4, help="seeds from 2000 on")
    parser.add_argument("--waypoints", type=int, default=16)
    parser.add_argument("--height", type=float, default=3.0, help="least height [m]")
    arguments = parser.parse_args(argv)
    if not 1 <= arguments.towns <= 20 or not 0.0 < arguments.height <= 10.0:
        parser.error("--towns: 1 to 20; --height: above 0, at most 10")
    towns = [
        generate_scenario(seed, n_waypoints=arguments.waypoints, min_height_m=arguments.height)
        for seed in range(2000, 2000 + arguments.towns)
    ]
    rows = [
        row(planner, [pair_of(planner, town) for town in towns], towns[0])
        for planner in arguments.planners.split(",")
    ]
    head = f"| {' | '.join(HEAD)} |\n|---|{'---:|' * (len(HEAD) - 1)}"
    sys.stdout.write("\n".join((head, *rows)) + "\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
