"""Packs swapped together or each on its own: how long a mission larger than one charge takes.

    python benchmarks/sorties.py                       # some minutes of processor time
    python benchmarks/sorties.py --planners tour --swap 30
    python benchmarks/sorties.py --towns 7:12 --charges 0.33,0.37 --forms alone --each
    python benchmarks/sorties.py --uas 1 --waypoints 10 --again 15,15 --charges 1 --forms relaunch

The towns are `generate_scenario(seed, n_uas=3, n_waypoints=90)`, packs charged to `--charges`. They
are flown as sorties one after the other (`run --sorties`: all wait for the last one to land),
in one flight (`together = false`), and on the charge that is left (`relaunch = true`). With
`--again`, every waypoint is asked for again so many seconds after it was covered, once for each
number; the last two forms know that. A row for each planner, form and charge, of all towns, as
median (range): waypoints covered, time of the whole mission with its swaps, energy, packs used, and
violations and breaches in all. `--each` prints a row for each mission, too.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Mapping, Sequence
from statistics import median
from typing import NamedTuple

from uas_coverage_env import Scenario, generate_scenario, load_planner, rollout
from uas_coverage_env.flight import Flight, fly_sorties, sorties_summary
from uas_coverage_env.flight.metrics import energy_Wh, open_waypoints, packs_used
from uas_coverage_env.scenario.packs import Sorties

PLANNERS = ("nearest-waypoint", "trajectory")
HEAD = ("planner", "packs are swapped", "charge", "covered", "time, s", "energy, Wh", "packs",
        "harm")  # fmt: skip
TOWN = 7


class Flown(NamedTuple):
    """What came of a mission."""

    covered: int
    waypoints: int
    time_s: float
    spent_Wh: float  # noqa: N815
    packs: int
    harm: int


def mission(charge: float, swap_s: float, town: Scenario | None = None) -> Scenario:
    """A town with packs charged to a share, swapped together."""
    town = town or generate_scenario(TOWN, n_uas=3, n_waypoints=90)
    fleet = tuple(uas.model_copy(update={"soc_0": charge}) for uas in town.uas)
    # waypoints that are asked for again do not go with sorties one after the other
    packs = Sorties(packs=20, swap_s=swap_s, together=not town.asks_again)
    return town.model_copy(update={"uas": fleet, "sorties": packs, "max_steps": 5000})


def asked_again(town: Scenario, gaps_s: tuple[float, ...]) -> Scenario:
    """A town whose waypoints are all asked for again."""
    again = (w.model_copy(update={"again_after_s": gaps_s}) for w in town.waypoints)
    return town.model_copy(update={"waypoints": (*again,)}) if gaps_s else town


def together(scenario: Scenario, planner: str, options: Mapping[str, str]) -> Flown:
    """Sorties one after the other."""

    def fly(sortie: Scenario) -> Flight:
        return rollout(sortie, load_planner(planner, options))

    result = sorties_summary(list(fly_sorties(scenario, fly, 20)))
    harm = result["violations"] + result["breaches"]
    return Flown(result["covered"], result["covered"] + result["left"], result["time_s"],
                 result["energy_Wh"], sum(result["packs"].values()), harm)  # fmt: skip


def alone(scenario: Scenario, planner: str, options: Mapping[str, str]) -> Flown:
    """One flight in which each swaps while the others fly on."""
    packs = Sorties(packs=20, swap_s=scenario.sorties.swap_s if scenario.sorties else 0.0,
                    together=False)  # fmt: skip
    return in_one(scenario.model_copy(update={"sorties": packs}), planner, options)


def relaunch(scenario: Scenario, planner: str, options: Mapping[str, str]) -> Flown:
    """One flight in which UAS take off again on the charge that is left."""
    changes = {"sorties": None, "relaunch": True}
    return in_one(scenario.model_copy(update=changes), planner, options)


def in_one(scenario: Scenario, planner: str, options: Mapping[str, str]) -> Flown:
    """One flight of a mission as it is."""
    flight = rollout(scenario, load_planner(planner, options))
    covered = int(flight.covered[-1])
    harm = len(flight.violations) + flight.breaches
    time_s, spent_Wh = flight.steps * scenario.dt_s, float(energy_Wh(flight).sum())
    packs_in_all = sum(packs_used(flight).values())
    return Flown(covered, covered + open_waypoints(flight), time_s, spent_Wh, packs_in_all, harm)


FORMS = {
    "together": ("together", together),
    "alone": ("each on its own", alone),
    "relaunch": ("not", relaunch),
}


def _spread(values: Sequence[float], digits: int) -> str:
    low, middle, high = (f"{f(values):.{digits}f}" for f in (min, median, max))
    return middle if low == high else f"{middle} ({low} to {high})"


def row(flown: Sequence[Flown]) -> list[str]:
    """The figures of a row, of several missions."""
    covered = sum(one.covered for one in flown)
    return [
        f"{covered}/{sum(one.waypoints for one in flown)}",
        _spread([one.time_s for one in flown], 0),
        _spread([one.spent_Wh for one in flown], 1),
        _spread([one.packs for one in flown], 0),
        str(sum(one.harm for one in flown)),
    ]


def main(arguments: Sequence[str] | None = None) -> int:
    """Fly both forms with every planner and print the table."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--planners", default=",".join(PLANNERS))
    parser.add_argument("--charges", default="0.4", help="of a fresh pack, 0 to 1")
    parser.add_argument("--swap", type=float, default=60.0, help="[s]")
    parser.add_argument("--towns", default=f"{TOWN}:{TOWN + 1}", help="seeds, FIRST:LAST+1")
    parser.add_argument("--forms", default="together,alone", help=f"of {', '.join(FORMS)}")
    parser.add_argument("--uas", type=int, default=3)
    parser.add_argument("--waypoints", type=int, default=90)
    parser.add_argument("--again", default="", help="[s] after which waypoints are asked for again")
    parser.add_argument("--each", action="store_true", help="print each mission, too")
    parser.add_argument("--option", action="append", default=[], help="NAME=VALUE, of the planners")
    given = parser.parse_args(arguments)
    options = dict(one.split("=", 1) for one in given.option)
    seeds = range(*map(int, given.towns.split(":")))
    gaps_s = tuple(float(gap) for gap in given.again.split(",") if gap)
    towns = [
        asked_again(generate_scenario(seed, n_uas=given.uas, n_waypoints=given.waypoints), gaps_s)
        for seed in seeds
    ]
    print(f"| {' | '.join(HEAD)} |\n|{'---|' * len(HEAD)}")
    for planner in given.planners.split(","):
        for form, fly in (FORMS[name] for name in given.forms.split(",")):
            for charge in map(float, given.charges.split(",")):
                flown = []
                for seed, town in zip(seeds, towns, strict=True):
                    flown.append(fly(mission(charge, given.swap, town), planner, options))
                    if given.each:
                        print(f"seed {seed}:", *row(flown[-1:]), file=sys.stderr, flush=True)
                print("|", " | ".join([f"`{planner}`", form, f"{charge}", *row(flown)]), "|",
                      flush=True)  # fmt: skip
    return 0


if __name__ == "__main__":
    sys.exit(main())
