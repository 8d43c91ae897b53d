"""Measures of one flight, each a pure function of its record, and the summary made of them."""

from collections import Counter
from dataclasses import asdict
from typing import Any

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.flight.of_log import OfLog
from uas_coverage_env.flight.record import (
    LANDED,
    LIMIT,
    EventRecord,
    FlightRecord,
    LeftOpen,
    Violation,
)
from uas_coverage_env.flight.scene_history import covered_since
from uas_coverage_env.flight.seen import seen_shares
from uas_coverage_env.scenario.ground_phases import landing, take_off
from uas_coverage_env.vehicle import DOD, U_TH
from uas_coverage_env.vehicle.vertical_flight import VerticalFlight

_J_PER_WH = 3600.0


def coverage(flight: FlightRecord) -> float:
    """Fraction of the waypoints that the swarm has covered, 0..1.

    Of those that events have dropped before they were covered none counts; of those that events
    have added, all that were added in time. One that is to be covered again counts each time.
    """
    left = open_waypoints(flight)
    covered = int(flight.covered[-1])
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
    power_W = flight.voltage_V * flight.current_A
    return power_W.sum(axis=0) * flight.scenario.dt_s / _J_PER_WH


def energy_until_Wh(flight: FlightRecord) -> NDArray[np.float64]:
    """(T, U) [Wh] the same over the samples before each."""
    power_W = flight.voltage_V * flight.current_A
    until_W = np.concatenate([np.zeros_like(power_W[:1]), np.cumsum(power_W[:-1], axis=0)])
    return until_W * flight.scenario.dt_s / _J_PER_WH


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


def accomplished(flight: FlightRecord) -> bool:
    """Whether the mission succeeded: everything covered, every UAS home, no violation.

    A UAS that an event of the scenario took away need not be home.
    """
    taken = {event.uas for event in flight.events if event.kind == "uas_lost"}
    all_home = all(
        landed or name in taken for landed, name in zip(home(flight), flight.names, strict=True)
    )
    return bool(open_waypoints(flight) == 0 and all_home and not flight.violations)


def decision_time_s(flight: FlightRecord) -> dict[str, float | None]:
    """Percentiles of the planner's time per decision [s]; None where there was no decision."""
    names = ("p50", "p95", "p99", "max")
    durations_s = [decision.duration_s for decision in flight.decisions]
    if not durations_s:
        return dict.fromkeys(names)
    return dict(zip(names, np.percentile(durations_s, (50, 95, 99, 100)).tolist(), strict=True))


def mip_gap_p50(flight: FlightRecord) -> float | None:
    """Median gap of the optimising planner, relative to what a plan can influence; None: none."""
    gaps = [decision.mip_gap for decision in flight.decisions if decision.mip_gap is not None]
    return float(np.median(gaps)) if gaps else None


def filtered_share(flight: FlightRecord) -> float:
    """Share of the commands that the safety filter replaced, 0..1; 0 where there was none."""
    commands = int(flight.last_sample.sum())
    return sum(decision.filtered for decision in flight.decisions) / max(commands, 1)


def ground_phases(flight: FlightRecord) -> list[dict[str, Any]]:
    """Take-off and landing of each UAS, which lie outside of the samples.

    Returns:
        One entry per UAS: seconds and Wh of both, and the charge on the ground afterwards. Landing
        and charge are None of a UAS that has not come home. Where it has swapped packs, seconds
        and Wh are sums over all its flights.
    """
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


def summary(flight: FlightRecord) -> dict[str, Any]:
    """The fields of `summary.json`, in their order."""
    return {
        "coverage": coverage(flight),
        # without cameras the file is as it was before there were any
        **({"seen_ground": shares} if (shares := seen_shares(flight)) else {}),
        "steps": flight.steps,
        "energy_Wh": float(energy_Wh(flight).sum()),
        **({"ground_phases": ground_phases(flight)} if flight.scenario.from_ground else {}),
        # where no UAS swaps packs on its own, the file is as it was before that could be
        **({"packs": packs_used(flight), "swaps": _swaps(flight)} if flight.swaps else {}),
        # a record from before rewards were kept stays as it was
        **({"return": episode_return(flight)} if flight.reward_terms is not None else {}),
        **({"reward_terms": reward_sums(flight)} if flight.reward_terms is not None else {}),
        # of a log: what was not measured
        **(_of_log(flight.of_log) if flight.of_log is not None else {}),
        "all_home": bool(home(flight).all()),
        "min_separation_m": flight.min_separation_m,
        "min_obstacle_clearance_m": flight.min_obstacle_clearance_m,
        "violations": [_entry(violation) for violation in flight.violations],
        # without events the file is as it was before there were any
        **({"events": [_happened(event) for event in flight.events]} if flight.events else {}),
        # where nothing is left open the file is as it was before reasons were kept
        **({"left_open": [_open(one) for one in flight.left_open]} if flight.left_open else {}),
        "breaches": flight.breaches,
        # without the rule the file is as it was before there was one
        **({"height_breaches": flight.height_breaches} if flight.scenario.min_height_m else {}),
        "wall_time_s": flight.wall_time_s,
        "decision_time_s": decision_time_s(flight),
        "fallbacks": sum(decision.fallback for decision in flight.decisions),
        "mip_gap_p50": mip_gap_p50(flight),
        "versions": dict(flight.versions),
        "seed": flight.seed,
        "planner": {"name": flight.planner, "options": dict(flight.planner_options)},
    }


def _of_log(of_log: OfLog) -> dict[str, Any]:
    return {
        "estimated": [asdict(one) for one in of_log.estimates],
        "not_known": [asdict(one) for one in of_log.unknown],
    }


def _swaps(flight: FlightRecord) -> list[dict[str, Any]]:
    return [
        {"t_s": swap.time_s, "uas": swap.uas, "landed_s": swap.landed_s} for swap in flight.swaps
    ]


def _happened(event: EventRecord) -> dict[str, Any]:
    return {"t_s": event.time_s, "kind": event.kind, "uas": event.uas}


def _open(left: LeftOpen) -> dict[str, Any]:
    return {"waypoint": left.waypoint, "why": str(left.why), "detail": left.detail}


def _entry(violation: Violation) -> dict[str, Any]:
    entry = {
        "t_s": violation.time_s,
        "uas": violation.uas,
        "kind": violation.kind,
        "with": violation.partner,
    }
    if violation.kind == LIMIT:
        entry |= {
            "value": violation.value,
            "limit": violation.limit,
            "samples": violation.samples,
        }
    return entry
