"""A mission larger than one charge: sortie after sortie, each from home with fresh packs.

A sortie is an ordinary flight of what the ones before it have left, so whatever judges, shows or
exports flights does so with sorties. All UAS wait for the last one to land, and swap together.
"""

from collections.abc import Callable, Iterator, Sequence
from typing import Any

import numpy as np

from uas_coverage_env.flight.flight import Flight
from uas_coverage_env.flight.metrics import energy_Wh, ground_phases, home, open_waypoints
from uas_coverage_env.flight.record import LANDED, LOST
from uas_coverage_env.flight.rest import rest_of
from uas_coverage_env.scenario import Scenario

_LONGEST_NAME = 64


def fly_sorties(
    scenario: Scenario, fly: Callable[[Scenario], Flight], most: int
) -> Iterator[Flight]:
    """Fly sorties until all is covered, the packs are used up, or nothing more comes of it.

    Nothing more comes of it where a sortie has covered nothing, ends with a UAS in the air, or
    loses the last one. A UAS that was lost is not in the sorties that follow.

    Args:
        scenario: The mission; `sorties` says how many packs each UAS has, without it `most` does.
        fly: Flies one sortie, as `rollout` does.
        most: Not more than that many.

    Yields:
        Each sortie as soon as it has been flown.
    """
    packs = min(most, scenario.sorties.packs) if scenario.sorties else most
    now = scenario
    for number in range(1, packs + 1):
        flight = fly(now)
        yield flight
        if number == packs or why_over(flight) is not None:
            return
        now = _next(scenario, flight, number + 1)


def why_over(flight: Flight) -> str | None:
    """Why no sortie follows one, however many packs there are; None: one may follow."""
    if open_waypoints(flight) == 0:
        return "complete"
    if flight.ended == "stopped":
        return "stopped"
    if (flight.mode[-1] == LOST).all():
        return "no UAS left"
    if (flight.mode[-1] < LANDED).any():
        return "in the air"
    return None if flight.covered[-1] > 0 else "nothing covered"


def _next(scenario: Scenario, flight: Flight, number: int) -> Scenario:
    ending = f"-sortie-{number}"
    rest = rest_of(flight, name=f"{scenario.name[: _LONGEST_NAME - len(ending)]}{ending}")
    if rest.sorties is None:
        return rest
    left = rest.sorties.model_copy(update={"packs": rest.sorties.packs - 1})
    return rest.model_copy(update={"sorties": left})


def sorties_summary(flights: Sequence[Flight], *, stopped: bool = False) -> dict[str, Any]:
    """What came of a chain of sorties, and of each of them.

    Args:
        flights: The sorties in their order; at least one.
        stopped: Whether they were stopped by hand after the last one.

    Returns:
        `sorties`: one entry each; `packs`: how many each UAS has used; `time_s` with the swaps,
        `energy_Wh`, `coverage`, and in `ended` why there was no further one.
    """
    scenario = flights[0].scenario
    swap_s = scenario.sorties.swap_s if scenario.sorties else 0.0
    entries, begins_s = [], 0.0
    for flight in flights:
        entry = {"begins_s": begins_s, **_entry(flight)}
        entries.append(entry)
        begins_s += entry["time_s"] + swap_s
    covered = sum(entry["covered"] for entry in entries)
    left = open_waypoints(flights[-1])
    packs = dict.fromkeys(flights[0].names, 0)
    for entry in entries:
        for name in entry["flew"]:
            packs[name] += 1
    return {
        "ended": why_over(flights[-1]) or ("stopped" if stopped else "packs used up"),
        "coverage": covered / (covered + left) if covered + left else 1.0,
        "covered": covered,
        "left": left,
        "time_s": begins_s - swap_s,
        "swap_s": swap_s,
        "energy_Wh": sum(entry["energy_Wh"] for entry in entries),
        "packs": packs,
        "all_home": all(bool(home(flight).all()) for flight in flights),
        "violations": sum(len(flight.violations) for flight in flights),
        "breaches": sum(flight.breaches for flight in flights),
        "sorties": entries,
    }


def _entry(flight: Flight) -> dict[str, Any]:
    time_s, spent_Wh = flight.steps * flight.scenario.dt_s, float(energy_Wh(flight).sum())
    if phases := ground_phases(flight):
        for phase in ("take_off", "landing"):
            time_s += max(float(entry[f"{phase}_s"] or 0.0) for entry in phases)
            spent_Wh += sum(float(entry[f"{phase}_Wh"] or 0.0) for entry in phases)
    flew = np.flatnonzero(flight.soc[-1] < flight.soc[0])
    return {
        "time_s": time_s,
        "energy_Wh": spent_Wh,
        "covered": int(flight.covered[-1]),
        "left": open_waypoints(flight),
        "flew": [flight.names[i] for i in flew],
        "soc_landed": dict(zip(flight.names, flight.soc[-1].tolist(), strict=True)),
    }
