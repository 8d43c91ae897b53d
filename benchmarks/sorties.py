"""Packs swapped together or each on its own: how long a mission larger than one charge takes.

    python benchmarks/sorties.py                       # some minutes of processor time
    python benchmarks/sorties.py --planners tour --swap 30

The town is `generate_scenario(7, n_uas=3, n_waypoints=90)`, its packs charged to `--charge`. It is
flown as sorties one after the other (`run --sorties`: all wait for the last one to land) and in one
flight (`together = false`). A row for each planner and form: waypoints covered, time of the whole
mission with its swaps, energy, packs used, violations and breaches.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from functools import partial
from typing import Any

from uas_coverage_env import Scenario, generate_scenario, rollout
from uas_coverage_env.flight import (
    Flight,
    energy_Wh,
    fly_sorties,
    packs_used,
    sorties_summary,
)
from uas_coverage_env.flight.metrics import open_waypoints
from uas_coverage_env.scenario.packs import Sorties

PLANNERS = ("nearest-waypoint", "trajectory")
HEAD = ("planner", "packs are swapped", "covered", "time, s", "energy, Wh", "packs", "harm")


def mission(charge: float, swap_s: float, town: Scenario | None = None) -> Scenario:
    """A town with packs charged to a share, swapped together."""
    town = town or generate_scenario(7, n_uas=3, n_waypoints=90)
    fleet = tuple(uas.model_copy(update={"soc_0": charge}) for uas in town.uas)
    packs = Sorties(packs=20, swap_s=swap_s)
    return town.model_copy(update={"uas": fleet, "sorties": packs, "max_steps": 5000})


def together(scenario: Scenario, planner: str) -> tuple[Any, ...]:
    """Covered, time [s], energy [Wh], packs and harm of sorties one after the other."""
    fly = partial(rollout, planner=planner)
    result = sorties_summary(list(fly_sorties(scenario, fly, 20)))
    share = f"{result['covered']}/{result['covered'] + result['left']}"
    harm = result["violations"] + result["breaches"]
    return share, result["time_s"], result["energy_Wh"], sum(result["packs"].values()), harm


def alone(scenario: Scenario, planner: str) -> tuple[Any, ...]:
    """The same of one flight in which each swaps while the others fly on."""
    packs = Sorties(packs=20, swap_s=scenario.sorties.swap_s if scenario.sorties else 0.0,
                    together=False)  # fmt: skip
    flight: Flight = rollout(scenario.model_copy(update={"sorties": packs}), planner)
    covered = int(flight.covered[-1])
    share = f"{covered}/{covered + open_waypoints(flight)}"
    harm = len(flight.violations) + flight.breaches
    time_s = flight.steps * scenario.dt_s
    return share, time_s, energy_Wh(flight).sum(), sum(packs_used(flight).values()), harm


def main(arguments: Sequence[str] | None = None) -> int:
    """Fly both forms with every planner and print the table."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--planners", default=",".join(PLANNERS))
    parser.add_argument("--charge", type=float, default=0.4, help="of a fresh pack, 0 to 1")
    parser.add_argument("--swap", type=float, default=60.0, help="[s]")
    given = parser.parse_args(arguments)
    scenario = mission(given.charge, given.swap)
    print(f"| {' | '.join(HEAD)} |\n|{'---|' * len(HEAD)}")
    for planner in given.planners.split(","):
        for form, flown in (
            ("together", together(scenario, planner)),
            ("each on its own", alone(scenario, planner)),
        ):
            share, time_s, spent_Wh, packs, harm = flown
            print(
                f"| `{planner}` | {form} | {share} | {time_s:.0f} | {spent_Wh:.1f} | {packs} "
                f"| {harm} |",
                flush=True,
            )
    return 0


if __name__ == "__main__":
    sys.exit(main())
