"""What the missions benchmark counts: a row per flight, planners compared in pairs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import astuple, dataclass
from typing import Any, Self

import numpy as np
from rich.table import Table

from uas_coverage_env.independent_check import Report

RESAMPLES = 10_000
COLUMNS = (
    *("scenario", "planner", "uas", "steps", "energy_Wh", "coverage", "all_home", "violations"),
    *("independent_problems", "breaches", "p50_s", "p95_s", "p99_s", "fallbacks", "room_m"),
)


@dataclass(frozen=True)
class Row:
    """One flight.

    Attributes:
        scenario: Name of the scenario.
        planner: Name of the planner.
        n_uas: UAS of the scenario.
        steps: Steps until the last UAS was home, lost, or the flight ended.
        energy_Wh: Energy of the swarm.
        coverage: Fraction of the waypoints.
        all_home: Whether every UAS has landed.
        violations: Contacts and limits exceeded that the world counted.
        problems: What the independent check found: violations, and where it disagrees.
        breaches: Samples closer than the safe distances, the larger of both counts.
        decision_s: (3,) p50, p95 and p99 of the decision time [s].
        fallbacks: Decisions flown on a fallback.
        room_m: Smallest distance left before a contact on the curves between samples [m].
    """

    scenario: str
    planner: str
    n_uas: int
    steps: int
    energy_Wh: float  # noqa: N815
    coverage: float
    all_home: bool
    violations: int
    problems: tuple[str, ...]
    breaches: int
    decision_s: tuple[float, float, float]
    fallbacks: int
    room_m: float

    @classmethod
    def of(
        cls, scenario: str, planner: str, n_uas: int, summary: dict[str, Any], report: Report
    ) -> Self:
        """The row of a flight that was summed up and checked."""
        times = summary["decision_time_s"]
        return cls(
            *(scenario, planner, n_uas, report.steps, report.energy_Wh, report.coverage),
            all_home=report.all_home,
            violations=len(summary["violations"]),
            problems=tuple(report.problems),
            breaches=max(summary["breaches"], report.breaches),
            decision_s=(times["p50"], times["p95"], times["p99"]),
            fallbacks=summary["fallbacks"],
            room_m=min(report.curved_room_m.values()),
        )

    @property
    def clean(self) -> bool:
        """Nothing touched, nothing too near, both judges agree."""
        return not self.violations and not self.problems and not self.breaches

    @property
    def accomplished(self) -> bool:
        """Everything covered, every UAS home, nothing touched."""
        return self.coverage == 1.0 and self.all_home and not self.violations

    def values(self) -> list[Any]:
        """In the order of `COLUMNS`."""
        *head, problems, breaches, times, fallbacks, room_m = astuple(self)
        return [*head, len(problems), breaches, *times, fallbacks, room_m]

    def texts(self) -> list[str]:
        """The values as a person reads them."""
        times = [f"{1e3 * t:.0f}" for t in self.decision_s]
        return [
            *(self.scenario, self.planner, str(self.n_uas), str(self.steps)),
            *(f"{self.energy_Wh:.2f}", f"{self.coverage:.0%}", "all" if self.all_home else "no"),
            *(str(self.violations), str(len(self.problems)), str(self.breaches)),
            *(*times, str(self.fallbacks), f"{self.room_m:.2f}"),
        ]

    def line(self) -> str:
        """One line, for logs."""
        return "  ".join(f"{h} {t}" for h, t in zip(_HEADINGS, self.texts(), strict=True))


_HEADINGS = (
    *("scenario", "planner", "UAS", "steps", "Wh", "covered", "home", "violations", "check"),
    *("breaches", "p50 ms", "p95 ms", "p99 ms", "fallbacks", "room m"),
)


def paired_interval(differences: Sequence[float]) -> tuple[float, float, float]:
    """Mean of paired differences and its 95 % percentile bootstrap interval.

    Args:
        differences: One per pair, at least one.
    """
    values = np.array(differences, float)
    rng = np.random.default_rng(0)
    drawn = values[rng.integers(0, len(values), (RESAMPLES, len(values)))].mean(axis=1)
    low, high = np.percentile(drawn, (2.5, 97.5))
    return float(values.mean()), float(low), float(high)


def flights_table(rows: Sequence[Row]) -> Table:
    """One line per flight."""
    table = Table(*_HEADINGS, title="Flights (check: what the independent check objects to)")
    for row in rows:
        table.add_row(*row.texts())
    return table


def planners_table(rows: Sequence[Row], planners: Sequence[str]) -> Table:
    """One line per planner: means, and paired differences to the first planner.

    Steps and energy are compared on the scenarios that both have accomplished: who gives up is
    home early.
    """
    table = Table(
        *("planner", "accomplished", "covered", "steps", "Wh", "violations", "check", "breaches"),
        *(
            "fallbacks",
            "worst p99 ms",
            "pairs",
            "Δ steps [95 %]",
            "Δ Wh [95 %]",
            "Δ coverage",
        ),
        title=f"Planners; Δ: mean paired difference to {planners[0]}",
    )
    of = {name: {r.scenario: r for r in rows if r.planner == name} for name in planners}
    first = of[planners[0]]
    for name in planners:
        mine = list(of[name].values())
        done = [row for row in mine if row.accomplished]
        both = [row for row in done if first[row.scenario].accomplished]
        table.add_row(
            name,
            f"{len(done)}/{len(mine)}",
            f"{np.mean([row.coverage for row in mine]):.1%}",
            _mean([row.steps for row in done], ".1f"),
            _mean([row.energy_Wh for row in done], ".2f"),
            str(sum(row.violations for row in mine)),
            str(sum(len(row.problems) for row in mine)),
            str(sum(row.breaches for row in mine)),
            str(sum(row.fallbacks for row in mine)),
            f"{1e3 * max(row.decision_s[-1] for row in mine):.0f}",
            *_differences(name == planners[0], first, both, mine),
        )
    return table


def _differences(
    is_first: bool, first: dict[str, Row], both: Sequence[Row], mine: Sequence[Row]
) -> list[str]:
    if is_first:
        return ["", "", "", ""]
    pairs = [(row, first[row.scenario]) for row in both]
    return [
        str(len(pairs)),
        _interval([row.steps - other.steps for row, other in pairs], 1.0, ".1f"),
        _interval([row.energy_Wh - other.energy_Wh for row, other in pairs], 1.0, ".2f"),
        _interval([row.coverage - first[row.scenario].coverage for row in mine], 100.0, ".1f"),
    ]


def _mean(values: Sequence[float], form: str) -> str:
    return format(float(np.mean(values)), form) if values else "-"


def _interval(differences: Sequence[float], scale: float, form: str) -> str:
    if not differences:
        return "-"
    mean, low, high = (format(scale * value, form) for value in paired_interval(differences))
    return f"{mean} [{low}, {high}]"
