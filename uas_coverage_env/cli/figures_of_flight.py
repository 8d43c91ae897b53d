"""What a person is told of a flight: whether it is good, and its figures."""

from collections import Counter
from typing import Any

from uas_coverage_env.files.digits import three_digits
from uas_coverage_env.flight import MODES, Flight
from uas_coverage_env.flight.figures import summary
from uas_coverage_env.flight.metrics import (
    accomplished,
    energy_Wh,
    fallback_reasons,
    filtered_share,
    packs_used,
)
from uas_coverage_env.flight.record import LeftOpen

ENDED = {"complete": "", "steps": "limit of steps reached", "stopped": "stopped"}
"""What ended a flight before the mission did."""

NONE = "-"
_ALIKE = 0.005
_NAMED = 8
"""UAS whose names are told; of more, the number."""
_WORDS = {True: "more energy than", False: "less energy than"}


def verdict(flight: Flight) -> str:
    """Whether the mission succeeded, and what it lacks if not, in a line."""
    if accomplished(flight):
        return "mission accomplished: everything covered, every UAS home, no violation"
    result = summary(flight)
    lacks = [
        ENDED[flight.ended],
        "" if result["coverage"] == 1.0 else f"{result['coverage']:.0%} covered",
        "" if result["all_home"] else f"not home: {_not_home(flight)}",
        _several(len(flight.violations), "violation"),
    ]
    return f"mission not accomplished: {'; '.join(filter(None, lacks))}"


def left_open(flight: Flight) -> list[str]:
    """What a flight has left open and why, a line for each reason: empty where nothing."""
    by_reason: dict[str, list[LeftOpen]] = {}
    for one in flight.left_open:
        by_reason.setdefault(one.why, []).append(one)
    lines = []
    for why, those in by_reason.items():
        named = ", ".join(f"waypoints[{one.waypoint}]" for one in those[:_NAMED])
        more = f" and {len(those) - _NAMED} more" if len(those) > _NAMED else ""
        details = list(dict.fromkeys(one.detail for one in those))
        others = f" (+{len(details) - 1} more)" if len(details) > 1 else ""
        lines.append(f"left open: {named}{more}: {why}: {details[0]}{others}")
    return lines


def beside_the_best(flight: Flight) -> str:
    """A flight beside the best one known of its mission, in a line; empty where none is known."""
    from uas_coverage_env.leaderboard.best_flown import best_flown

    best = best_flown(flight.scenario) if flight.dynamics == "lpv" else None
    if best is None:
        return ""
    known = f"{best.energy_Wh:.2f} Wh in {best.steps} steps, by {best.planner}"
    if not accomplished(flight):
        return f"the best flight known of this mission: {known}"
    more = sum(energy_Wh(flight)) / best.energy_Wh - 1.0
    much = "as much energy as" if abs(more) < _ALIKE else f"{abs(more):.0%} {_WORDS[more > 0]}"
    return f"{much} the best flight known of this mission ({known})"


def figures(flight: Flight) -> dict[str, str]:
    """The figures of a flight with their units, by name, as a person reads them."""
    result = summary(flight)
    times = result["decision_time_s"]
    reasons = ", ".join(f"{n} {reason}" for reason, n in fallback_reasons(flight).items())
    seen: dict[str, float] = result.get("seen_ground", {})
    packs = ", ".join(f"{name} {n}" for name, n in packs_used(flight).items())
    rows = {
        "scenario": flight.scenario.name,
        "planner": flight.planner,
        "seed": str(flight.seed),
        "model": flight.dynamics,
        "accomplished": "yes" if accomplished(flight) else "no",
        "ended": ENDED[flight.ended] or "complete",
        "covered": f"{result['coverage']:.0%}",
        "ground seen": ", ".join(f"{name} {share:.1%}" for name, share in seen.items()) or NONE,
        "left open": ", ".join(f"{n} {why}" for why, n in _reasons(flight).items()) or NONE,
        "all home": "yes" if result["all_home"] else f"not {_not_home(flight)}",
        "steps": str(flight.steps),
        "energy, Wh": f"{result['energy_Wh']:.2f}",
        "packs used": packs if flight.swaps else NONE,
        "least charge left": f"{flight.soc.min():.1%}",
        "least clearance of obstacles, m": _metres(flight.min_obstacle_clearance_m),
        "least separation of UAS, m": _metres(flight.min_separation_m),
        "violations": str(len(flight.violations)),
        "breaches": str(flight.breaches),
        "of them too low": str(flight.height_breaches) if flight.scenario.min_height_m else NONE,
        "decisions": str(len(flight.decisions)),
        "fallbacks": f"{result['fallbacks']}{f' ({reasons})' if reasons else ''}",
        "decision time p50, ms": _milliseconds(times["p50"]),
        "decision time p95, ms": _milliseconds(times["p95"]),
        "decision time max, ms": _milliseconds(times["max"]),
        "gap of the joint program": NONE if (g := result["mip_gap_p50"]) is None else f"{g:.1%}",
        "commands that the filter replaced": (
            f"{filtered_share(flight):.1%}" if flight.safety_filter else NONE
        ),
    }
    return rows


def by_uas(flight: Flight) -> list[tuple[str, str, str, str, str]]:
    """Of each UAS its name, how it ended, its last step, its energy and the charge left."""
    energies_Wh = energy_Wh(flight)
    return [
        (
            name,
            end if (end := MODES[flight.mode[-1, i]]) in ("landed", "lost") else "in the air",
            str(flight.last_sample[i]),
            f"{energies_Wh[i]:.2f}",
            f"{flight.soc[-1, i]:.1%}",
        )
        for i, name in enumerate(flight.names)
    ]


def of_log(flight: Flight) -> list[str]:
    """What was estimated of a flight from a log, and when it is not known where a UAS was."""
    if flight.of_log is None:
        return []
    return [
        *map(str, flight.of_log.estimates),
        *(
            f"{one.uas}: where it was from {one.from_s:.1f} to {one.to_s:.1f} s is not known: "
            f"{one.why}"
            for one in flight.of_log.unknown
        ),
    ]


def data(flight: Flight, directory: str) -> dict[str, Any]:
    """A flight as plain data for machines: `summary.json` and what identifies the flight."""
    return {
        "directory": directory,
        "scenario": flight.scenario.name,
        "dynamics": flight.dynamics,
        "ended": flight.ended,
        "accomplished": accomplished(flight),
        **summary(flight),
    }


def _not_home(flight: Flight) -> str:
    """The first few UAS that have not landed, and how many more there are."""
    out = [name for i, name in enumerate(flight.names) if MODES[flight.mode[-1, i]] != "landed"]
    more = f" and {len(out) - _NAMED} more" if len(out) > _NAMED else ""
    return f"{', '.join(out[:_NAMED])}{more}"


def _reasons(flight: Flight) -> Counter[str]:
    return Counter(str(one.why) for one in flight.left_open)


def _several(count: int, thing: str) -> str:
    return f"{count} {thing}{'s' if count > 1 else ''}" if count else ""


def _metres(value: float | None) -> str:
    return NONE if value is None else f"{value:.2f}"


def _milliseconds(value_s: float | None) -> str:
    return NONE if value_s is None else three_digits(1e3 * value_s)
