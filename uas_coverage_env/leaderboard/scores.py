"""What the flights of a sweep say about each planner: pure functions of the rows."""

import dataclasses
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

import numpy as np

from uas_coverage_env.leaderboard.bounds import Bounds
from uas_coverage_env.leaderboard.row import FLOWN, Row
from uas_coverage_env.leaderboard.statistics import (
    Estimate,
    FloatArray,
    Over,
    estimate,
    mean,
    paired_difference,
    probability_of_improvement,
)

_PERCENT = 100.0
_MS_PER_S = 1000.0


@dataclass(frozen=True)
class Scores:
    """One planner with its options. Energy is that of flights without a violation.

    Attributes:
        label: Its label.
        flights: How many rows, failed ones included.
        failed: Flights that there are none of: refused, or crashed.
        accomplished: Flights in which everything was covered, all UAS home, nothing touched.
        all_home: Flights after which all UAS were home.
        violating: Flights with a violation.
        violations: Contacts and limits exceeded, in all flights.
        breaches: Samples closer than the safe distances, in all flights.
        fallbacks: Decisions flown on a fallback, in all flights.
        filtered_percent: Mean over flights of the share of commands that the filter replaced.
        coverage_percent: Interquartile mean; a failed flight covers nothing.
        mean_coverage_percent: The mean, which one bad flight changes.
        worst_coverage_percent: The least of all flights.
        energy_Wh: Interquartile mean.
        Wh_per_percent: Energy per percent covered, of flights that covered something.
        steps: Interquartile mean of the makespan of accomplished flights.
        above_bound_percent: Energy of accomplished flights beyond the least with which the mission
            can be flown in as many steps (docs/bound.md); where that is known.
        decision_p50_ms: Median over flights of the median time of a decision.
        decision_p95_ms: Worst over flights of the 95th percentile.
        relative_energy_percent: Interquartile mean of the energy in percent of the reference's
            mean on the same scenario; the intervals of this and all further figures are over
            scenarios, unless there is only one.
        energy_difference_percent: Paired difference to the reference, where both accomplished.
        steps_difference_percent: The same of the makespan.
        improves_energy: Probability of needing less energy than the reference; a flight that is
            not accomplished is worse than any that is.
        improves_steps: The same of the makespan.
        episode_return: Interquartile mean of the sum of all rewards, as the environments pay by
            default; over all flights that there are, violating ones included.
    """

    label: str
    flights: int
    failed: int
    accomplished: int
    all_home: int
    violating: int
    violations: int
    breaches: int
    fallbacks: int
    filtered_percent: float
    coverage_percent: Estimate
    mean_coverage_percent: Estimate
    worst_coverage_percent: float
    energy_Wh: Estimate
    Wh_per_percent: Estimate
    steps: Estimate
    above_bound_percent: Estimate
    decision_p50_ms: float | None
    decision_p95_ms: float | None
    relative_energy_percent: Estimate
    energy_difference_percent: Estimate
    steps_difference_percent: Estimate
    improves_energy: Estimate
    improves_steps: Estimate
    episode_return: Estimate

    def flat(self) -> dict[str, Any]:
        """Plain columns: an estimate becomes NAME, NAME_low, NAME_high and NAME_n."""
        columns: dict[str, Any] = {}
        for field in dataclasses.fields(self):
            value = getattr(self, field.name)
            if isinstance(value, Estimate):
                columns[field.name] = value.value
                columns |= {f"{field.name}_{k}": getattr(value, k) for k in ("low", "high", "n")}
            else:
                columns[field.name] = value
        return columns


def drawn_anew(rows: Sequence[Row]) -> Over:
    """What the intervals of plain figures are over: seeds, unless each scenario has only one."""
    return "seeds" if len({row.seed for row in rows}) > 1 else "scenarios"


def scores_of(
    rows: Sequence[Row], reference: str, bounds: Bounds = MappingProxyType({})
) -> list[Scores]:
    """The scores of every planner, best first.

    More flights accomplished come first, then more coverage, then less energy.

    Args:
        rows: At least one; whatever part of the sweep has been flown.
        reference: Label of the planner that the others are compared with.
        bounds: Least energies, as far as they are known.
    """
    scenarios = list(dict.fromkeys(row.scenario for row in rows))
    over = drawn_anew(rows)
    tables = {
        label: _by_scenario([row for row in rows if row.label == label], scenarios)
        for label in dict.fromkeys(row.label for row in rows)
    }
    theirs = tables.get(reference, [[] for _ in scenarios])
    found = [_scores(label, mine, theirs, over, bounds) for label, mine in tables.items()]
    return sorted(found, key=_place)


def _place(scores: Scores) -> tuple[Any, ...]:
    energy = scores.relative_energy_percent.value
    return (
        -scores.accomplished / scores.flights,
        -(scores.mean_coverage_percent.value or 0.0),
        np.inf if energy is None else energy,
        scores.label,
    )


def _scores(
    label: str,
    mine: Sequence[Sequence[Row]],
    theirs: Sequence[Sequence[Row]],
    over: Over,
    bounds: Bounds,
) -> Scores:
    rows = [row for scenario in mine for row in scenario]
    # a comparison is meant for more than these scenarios
    compared: Over = "scenarios" if len(mine) > 1 else "seeds"
    coverage = _values(mine, lambda row: _PERCENT * row.coverage)
    return Scores(
        label=label,
        flights=len(rows),
        failed=sum(row.status != FLOWN for row in rows),
        accomplished=sum(row.accomplished for row in rows),
        all_home=sum(row.all_home for row in rows),
        violating=sum(row.violations > 0 for row in rows),
        violations=sum(row.violations for row in rows),
        breaches=sum(row.breaches for row in rows),
        fallbacks=sum(row.fallbacks for row in rows),
        filtered_percent=_PERCENT * _filtered_share(rows),
        coverage_percent=estimate(coverage, over),
        mean_coverage_percent=estimate(coverage, over, mean),
        worst_coverage_percent=_PERCENT * min(row.coverage for row in rows),
        energy_Wh=estimate(_values(mine, _ranked_energy_Wh), over),
        Wh_per_percent=estimate(_values(mine, _Wh_per_percent), over),
        steps=estimate(_values(mine, lambda row: row.steps if row.accomplished else None), over),
        above_bound_percent=estimate(
            _values(mine, lambda row: _above_bound(row, bounds)), compared, mean
        ),
        decision_p50_ms=_ms(np.median, [row.decision_p50_s for row in rows]),
        decision_p95_ms=_ms(np.max, [row.decision_p95_s for row in rows]),
        relative_energy_percent=_relative_energy(mine, theirs, compared),
        energy_difference_percent=_paired(mine, theirs, lambda row: row.energy_Wh),
        steps_difference_percent=_paired(mine, theirs, lambda row: row.steps),
        improves_energy=_improves(mine, theirs, lambda row: row.energy_Wh, compared),
        improves_steps=_improves(mine, theirs, lambda row: row.steps, compared),
        episode_return=estimate(_values(mine, lambda row: row.episode_return), over),
    )


def _filtered_share(rows: Sequence[Row]) -> float:
    shares = [row.filtered_share for row in rows if row.status == FLOWN]
    return float(np.mean(shares)) if shares else 0.0


Measure = Callable[[Row], float | None]


def _by_scenario(rows: Sequence[Row], scenarios: Sequence[str]) -> list[list[Row]]:
    found: Mapping[str, list[Row]] = {name: [] for name in scenarios}
    for row in rows:
        found[row.scenario].append(row)
    return list(found.values())


def _values(table: Sequence[Sequence[Row]], measure: Measure) -> list[FloatArray]:
    """One array per scenario; rows without the measure left out."""
    columns = [[measure(row) for row in rows] for rows in table]
    return [np.array([v for v in values if v is not None], float) for values in columns]


def _ranked_energy_Wh(row: Row) -> float | None:
    return row.energy_Wh if row.ranked else None


def _above_bound(row: Row, bounds: Bounds) -> float | None:
    least_Wh = bounds.get((row.scenario, row.steps or 0)) if row.accomplished else None
    if row.energy_Wh is None or not least_Wh:
        return None
    return _PERCENT * (row.energy_Wh / least_Wh - 1.0)


def _Wh_per_percent(row: Row) -> float | None:
    energy_Wh = _ranked_energy_Wh(row)
    if energy_Wh is None or not row.coverage:
        return None
    return energy_Wh / (_PERCENT * row.coverage)


def _relative_energy(
    mine: Sequence[Sequence[Row]], theirs: Sequence[Sequence[Row]], over: Over
) -> Estimate:
    parts = [
        _PERCENT * m / t.mean() if len(t) and t.mean() else np.empty(0)
        for m, t in zip(
            _values(mine, _ranked_energy_Wh), _values(theirs, _ranked_energy_Wh), strict=True
        )
    ]
    return estimate(parts, over)


def _paired(
    mine: Sequence[Sequence[Row]], theirs: Sequence[Sequence[Row]], measure: Measure
) -> Estimate:
    """Of flights on the same scenario with the same seed that both accomplished."""
    differences = []
    for my_rows, their_rows in zip(mine, theirs, strict=True):
        there = {row.seed: measure(row) for row in their_rows if row.accomplished}
        pairs = [(measure(r), there.get(r.seed)) for r in my_rows if r.accomplished]
        differences.append(
            np.array([_PERCENT * (m / t - 1.0) for m, t in pairs if m is not None and t], float)
        )
    return paired_difference(differences)


def _improves(
    mine: Sequence[Sequence[Row]], theirs: Sequence[Sequence[Row]], measure: Measure, over: Over
) -> Estimate:
    def value(row: Row) -> float | None:
        return measure(row) if row.accomplished else np.inf

    return probability_of_improvement(_values(mine, value), _values(theirs, value), over)


def _ms(summed_up: Callable[..., Any], times_s: Sequence[float | None]) -> float | None:
    there = [time_s for time_s in times_s if time_s is not None]
    return _MS_PER_S * float(summed_up(there)) if there else None
