"""What a person is told of a flight: whether it is good, and its figures."""

from typing import Any

from uas_coverage_env.flight import MODES, Flight
from uas_coverage_env.flight.figures import computed, printed, summary
from uas_coverage_env.flight.metrics import accomplished, coverage, energy_Wh, named, not_home
from uas_coverage_env.flight.record import LeftOpen

ENDED = {"complete": "", "steps": "limit of steps reached", "stopped": "stopped"}
"""What ended a flight before the mission did."""

_ALIKE = 0.005
_NAMED = 8
"""Waypoints that are told; of more, the number."""
_WORDS = {True: "more energy than", False: "less energy than"}


def verdict(flight: Flight) -> str:
    """Whether the mission succeeded, and what it lacks if not, in a line."""
    if accomplished(flight):
        return "mission accomplished: everything covered, every UAS home, no violation"
    covered, away = coverage(flight), not_home(flight)
    lacks = [
        ENDED[flight.ended],
        "" if covered == 1.0 else f"{covered:.0%} covered",
        f"not home: {named(away)}" if away else "",
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
    """What was flown, and its figures with their units, as a person reads them, by heading."""
    return {
        "scenario": flight.scenario.name,
        "planner": flight.planner,
        "seed": str(flight.seed),
        "model": flight.dynamics,
        "ended": ENDED[flight.ended] or "complete",
        **printed(flight),
    }


def failed_figures(flight: Flight) -> list[str]:
    """Figures that could not be computed, and why, a line each."""
    return [f"figure {why}" for why in computed(flight)[1].values()]


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
        **summary(flight),
    }


def _several(count: int, thing: str) -> str:
    return f"{count} {thing}{'s' if count > 1 else ''}" if count else ""
