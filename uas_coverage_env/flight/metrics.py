"""Measures of one flight, each a pure function of its record; `figures` says where they go."""

from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.flight.record import LANDED, LOST, FlightRecord
from uas_coverage_env.flight.scene_history import covered_since
from uas_coverage_env.scenario import Scenario
from uas_coverage_env.scenario.ground_phases import landing, take_off
from uas_coverage_env.vehicle.layout import DOD, U_TH
from uas_coverage_env.vehicle.vertical_flight import VerticalFlight

_S_PER_H = 3600.0
_NAMED = 8
"""UAS whose names are told; of more, the number."""
_MOVED_M = 1.0
"""What flies moves farther."""


def coverage(flight: FlightRecord) -> float:
    """Fraction of the waypoints that the swarm has covered, 0..1.

    Of those that events have dropped before they were covered none counts; of those that events
    have added, all that were added in time. One that is to be covered again counts each time.
    """
    return covered_share(int(flight.covered[-1]), open_waypoints(flight))


def covered_share(covered: int, left: int) -> float:
    """Fraction of the waypoints that are covered; 1 where there is none."""
    return float(covered / (covered + left)) if covered + left else 1.0


def open_waypoints(flight: FlightRecord) -> int:
    """How many waypoints were still to be covered at the end, each time counted."""
    if flight.open_waypoints is not None:
        return flight.open_waypoints
    return len(flight.scenario.waypoints) - int(flight.covered[-1])


def covered_at(flight: FlightRecord) -> NDArray[np.int64]:
    """(W,) the sample in which each waypoint was covered; T (one past the last) where never.

    Of the waypoints that the flight began with; `SceneHistory` has those that events added, too.
    """
    since = np.zeros(len(flight.scenario.waypoints), np.int64)
    return covered_since(flight, flight.scenario, since)


def energy_Wh(flight: FlightRecord) -> NDArray[np.float64]:
    """(U,) [Wh] sum over samples of voltage times current times dt."""
    each_Wh = flight.voltage_V * flight.current_A * (flight.scenario.dt_s / _S_PER_H)
    # one after the other, as the environments add it up: equal to the last digit
    sums_Wh: NDArray[np.float64] = np.add.accumulate(each_Wh, axis=0)
    return sums_Wh[-1]


def total_energy_Wh(flight: FlightRecord) -> float:
    """Of all UAS [Wh]."""
    return float(energy_Wh(flight).sum())


def available_Wh(scenario: Scenario) -> float:
    """What all batteries may give: charge above what must be left, at the mean voltage [Wh]."""
    total_Wh = 0.0
    for uas, vehicle in zip(scenario.uas, scenario.vehicles, strict=True):
        battery = vehicle.battery
        usable = uas.soc_0 - (1.0 - uas.dod_max)
        total_Wh += usable * battery.capacity_Ah * float(np.mean(battery.ocv_V))
    return total_Wh


def energy_share(flight: FlightRecord) -> float | None:
    """Energy drawn over what all batteries may give; None where they may give none."""
    return share_of_available(total_energy_Wh(flight), flight.scenario)


def share_of_available(energy_Wh: float, scenario: Scenario) -> float | None:
    """Energy over what all batteries may give; None where they may give none."""
    available = available_Wh(scenario)
    return energy_Wh / available if available > 0.0 else None


def min_soc(flight: FlightRecord) -> float:
    """The least charge of any battery, 0..1."""
    return float(flight.soc.min())


def energy_until_Wh(flight: FlightRecord) -> NDArray[np.float64]:
    """(T, U) [Wh] the same over the samples before each."""
    power_W = flight.voltage_V * flight.current_A
    until_W = np.concatenate([np.zeros_like(power_W[:1]), np.cumsum(power_W[:-1], axis=0)])
    return until_W * flight.scenario.dt_s / _S_PER_H


def packs_used(flight: FlightRecord) -> dict[str, int]:
    """UAS -> battery packs that it has flown with, where each swaps on its own."""
    swaps = Counter(swap.uas for swap in flight.swaps)
    return {name: 1 + swaps[name] for name in flight.names}


def reward_sums(flight: FlightRecord) -> dict[str, float]:
    """Term of the reward -> its sum over all steps and UAS; empty where none were kept."""
    if flight.reward_terms is None:
        return {}
    sums = flight.reward_terms.sum(axis=(0, 1)).tolist()
    return dict(zip(flight.reward_names, sums, strict=True))


def episode_return(flight: FlightRecord) -> float | None:
    """The sum of all rewards, not discounted; None where none were kept."""
    return None if flight.reward_terms is None else float(sum(reward_sums(flight).values()))


def home(flight: FlightRecord) -> NDArray[np.bool_]:
    """(U,) whether each UAS has landed."""
    return flight.mode[-1] == LANDED


def all_home(flight: FlightRecord) -> bool:
    """Whether every UAS has landed."""
    return bool(home(flight).all())


def not_home(flight: FlightRecord) -> list[str] | None:
    """The names of those that have not landed; None where all have."""
    out = [name for name, landed in zip(flight.names, home(flight), strict=True) if not landed]
    return out or None


def named(names: Sequence[str]) -> str:
    """The first few names, and how many more there are."""
    more = f" and {len(names) - _NAMED} more" if len(names) > _NAMED else ""
    return f"{', '.join(names[:_NAMED])}{more}"


def n_home(flight: FlightRecord) -> int:
    """UAS that have landed."""
    return int(home(flight).sum())


def n_lost(flight: FlightRecord) -> int:
    """UAS that were lost."""
    return int((flight.mode[-1] == LOST).sum())


def flew(flight: FlightRecord) -> int:
    """UAS that have left their starts by more than 1 m."""
    moved_m = np.abs(flight.x[:, :, :3] - flight.x[0, :, :3]).max(axis=(0, 2))
    return int((moved_m > _MOVED_M).sum())


def accomplished(flight: FlightRecord) -> bool:
    """Whether the mission succeeded: everything covered, every UAS home, no violation.

    A UAS that an event of the scenario took away need not be home.
    """
    taken = {event.uas for event in flight.events if event.kind == "uas_lost"}
    all_home = all(
        landed or name in taken for landed, name in zip(home(flight), flight.names, strict=True)
    )
    return bool(open_waypoints(flight) == 0 and all_home and not flight.violations)


def percentiles(flight: FlightRecord, of_decision: str) -> dict[str, float | None]:
    """Percentiles of a time of the planner's decisions [s]; None where there is none.

    Args:
        flight: The flight.
        of_decision: `duration_s` or `processor_s`.
    """
    names = ("p50", "p95", "p99", "max")
    times_s = [getattr(decision, of_decision) for decision in flight.decisions]
    if not times_s or None in times_s:
        return dict.fromkeys(names)
    return dict(zip(names, np.percentile(times_s, (50, 95, 99, 100)).tolist(), strict=True))


def processor_time_s(flight: FlightRecord) -> dict[str, float | None] | None:
    """Percentiles of the processor time per decision [s]; None where it was not kept."""
    found = percentiles(flight, "processor_s")
    return None if None in found.values() else found


def mip_gap_p50(flight: FlightRecord) -> float | None:
    """Median gap of the optimising planner, relative to what a plan can influence; None: none."""
    gaps = [decision.mip_gap for decision in flight.decisions if decision.mip_gap is not None]
    return float(np.median(gaps)) if gaps else None


def filtered_share(flight: FlightRecord) -> float:
    """Share of the commands that the safety filter replaced, 0..1; 0 where there was none."""
    commands = int(flight.last_sample.sum())
    return sum(decision.filtered for decision in flight.decisions) / max(commands, 1)


def height_breaches(flight: FlightRecord) -> int | None:
    """Samples below the least height; None where there is no such rule."""
    return flight.height_breaches if flight.scenario.min_height_m else None


def reserve_breaches(flight: FlightRecord) -> int | None:
    """Landings with less charge than the reserve; None where there is none."""
    return flight.reserve_breaches if flight.scenario.reserve else None


def n_fallbacks(flight: FlightRecord) -> int:
    """Decisions flown on a fallback."""
    return sum(decision.fallback for decision in flight.decisions)


def flown_by(flight: FlightRecord) -> dict[str, float]:
    """Who flew in place of the planner, and in which share of the decisions: the most first."""
    who = Counter(name for decision in flight.decisions for name in decision.flown_by)
    return {name: n / len(flight.decisions) for name, n in who.most_common()}


def by_others_share(flight: FlightRecord) -> float:
    """Share of the decisions in which another than the planner flew, 0..1."""
    flown = sum(bool(decision.flown_by) for decision in flight.decisions)
    return flown / max(len(flight.decisions), 1)


def ground_phases(flight: FlightRecord) -> list[dict[str, Any]] | None:
    """Take-off and landing of each UAS, which lie outside of the samples; None: there are none.

    Returns:
        One entry per UAS: seconds and Wh of both, and the charge on the ground afterwards. Landing
        and charge are None of a UAS that has not come home. Where it has swapped packs, seconds
        and Wh are sums over all its flights.
    """
    if not flight.scenario.from_ground:
        return None
    entries = []
    for i, name in enumerate(flight.names):
        up = take_off(flight.scenario, i)
        swaps = [swap for swap in flight.swaps if swap.uas == name]
        entry: dict[str, Any] = {
            "uas": name,
            "take_off_s": up.time_s * (1 + len(swaps)),
            "take_off_Wh": up.energy_Wh * (1 + len(swaps)),
            **dict.fromkeys(("landing_s", "landing_Wh", "soc_on_ground")),
        }
        landed = [round(swap.landed_s / flight.scenario.dt_s) for swap in swaps]
        if flight.mode[-1, i] == LANDED:
            landed.append(-1)
        downs = [_landing(flight, i, k) for k in landed]
        if downs:
            entry["landing_s"] = sum(down.time_s for down in downs)
            entry["landing_Wh"] = sum(down.energy_Wh for down in downs)
        if flight.mode[-1, i] == LANDED:
            entry["soc_on_ground"] = 1.0 - downs[-1].battery.dod
        entries.append(entry)
    return entries


def _landing(flight: FlightRecord, i: int, k: int) -> VerticalFlight:
    x = flight.x[k, i]
    return landing(flight.scenario, i, x[:3].tolist(), float(x[DOD]), float(x[U_TH]))


def fallback_reasons(flight: FlightRecord) -> dict[str, int]:
    """Why there were fallbacks, and how many: the most frequent reason first."""
    reasons = Counter(
        decision.reason or "no reason given" for decision in flight.decisions if decision.fallback
    )
    return dict(reasons.most_common())


def reasons_left_open(entries: Sequence[Mapping[str, Any]]) -> str:
    """Why waypoints were left open, and how many for each reason, of their entries in the file."""
    return ", ".join(f"{n} {why}" for why, n in Counter(each["why"] for each in entries).items())
