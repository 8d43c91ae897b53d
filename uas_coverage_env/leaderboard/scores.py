"""What the flights of a sweep say about each planner: pure functions of the rows.

Every figure of a flight (`flight.figures`) has a column; `_FURTHER` has those that need more than
one figure, the bounds, or the flights of the reference.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from types import MappingProxyType
from typing import Any, Literal

import numpy as np

from uas_coverage_env.files.digits import three_digits
from uas_coverage_env.files.errors import InputError
from uas_coverage_env.flight.figure import ByName, Figure
from uas_coverage_env.flight.figures import figures
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

NOTHING = "–"

_PERCENT = 100.0
_SUFFIXES = {"%": "_percent", "ms": "_ms"}

Value = int | float | Estimate | None


@dataclass(frozen=True)
class Scores(ByName):
    """One planner with its options.

    Attributes:
        label: Its label.
        figures: Column -> its value, see `columns`; they are attributes of it, too.
    """

    label: str
    figures: Mapping[str, Value]

    def plain(self) -> dict[str, Any]:
        """As plain data."""
        values = self.figures.items()
        return {
            "label": self.label,
            **{k: asdict(v) if isinstance(v, Estimate) else v for k, v in values},
        }

    def flat(self) -> dict[str, Any]:
        """Plain columns: an estimate becomes NAME, NAME_low, NAME_high and NAME_n."""
        columns: dict[str, Any] = {"label": self.label}
        for name, value in self.figures.items():
            if isinstance(value, Estimate):
                columns[name] = value.value
                columns |= {f"{name}_{k}": getattr(value, k) for k in ("low", "high", "n")}
            else:
                columns[name] = value
        return columns


@dataclass(frozen=True)
class Flights:
    """The flights of one planner, and what they are held against.

    Attributes:
        mine: By scenario.
        theirs: Those of the reference, likewise.
        over: What the intervals of plain figures are over.
        compared: What those of comparisons are over: they are meant for more scenarios.
        bounds: Least energies, as far as they are known.
    """

    mine: Sequence[Sequence[Row]]
    theirs: Sequence[Sequence[Row]]
    over: Over
    compared: Over
    bounds: Bounds

    @property
    def rows(self) -> list[Row]:
        """All of the planner."""
        return [row for scenario in self.mine for row in scenario]


@dataclass(frozen=True)
class Column:
    """A column of a comparison's tables.

    Attributes:
        name: In the files.
        heading: For people.
        meaning: In a line, for the docs.
        of: Its value for a planner.
        form: How a number is printed; empty: with three digits.
        table: In which it stands for people; empty: in the files alone.
        text: How the value is printed, where that takes more: of the planner's scores.
    """

    name: str
    heading: str
    meaning: str
    of: Callable[[Flights], Value]
    form: str = ""
    table: Literal["outcome", "effort", "reference", ""] = ""
    text: Callable[[Scores], str] | None = None

    def cell(self, scores: Scores) -> str:
        """Its cell in the row of a planner."""
        if self.text is not None:
            return self.text(scores)
        value = scores.figures[self.name]
        if not isinstance(value, Estimate):
            return NOTHING if value is None else self._number(value)
        if value.value is None:
            return NOTHING
        if value.low is None or value.high is None:
            return self._number(value.value)
        return (
            f"{self._number(value.value)} [{self._number(value.low)}, {self._number(value.high)}]"
        )

    def _number(self, value: float) -> str:
        return format(value, self.form) if self.form else three_digits(value)


def columns() -> dict[str, Column]:
    """All columns by name: those of figures in their order, then those made of several."""
    ours = [_of_figure(each) for each in figures().values() if each.in_rows]
    found: dict[str, Column] = {}
    for column in (*_COUNTED, *_FURTHER, *ours):
        if found.setdefault(column.name, column) is not column:
            raise InputError(f"two columns of a comparison are called {column.name!r}; rename one")
    places = [column.name for column in (*_COUNTED, *ours, *_FURTHER)]
    return {name: found[name] for name in places}


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
    compared: Over = "scenarios" if len(scenarios) > 1 else "seeds"
    tables = {
        label: _by_scenario([row for row in rows if row.label == label], scenarios)
        for label in dict.fromkeys(row.label for row in rows)
    }
    theirs = tables.get(reference, [[] for _ in scenarios])
    found = []
    for label, mine in tables.items():
        flights = Flights(mine, theirs, over, compared, bounds)
        found.append(Scores(label, {name: each.of(flights) for name, each in columns().items()}))
    return sorted(found, key=_place)


def _place(scores: Scores) -> tuple[Any, ...]:
    energy = scores.relative_energy_percent.value
    return (
        -scores.accomplished / scores.flights,
        -(scores.mean_coverage_percent.value or 0.0),
        np.inf if energy is None else energy,
        scores.label,
    )


Measure = Callable[[Row], float | None]


def _of_figure(figure: Figure) -> Column:
    """The column of a figure: over flights it is summed up as it says, a truth is counted."""
    unit, name = figure.printed_unit, figure.name
    if unit in _SUFFIXES:
        name = f"{name.removesuffix('_share').removesuffix('_s')}{_SUFFIXES[unit]}"
    heading = figure.label if unit != "%" else f"{figure.title}, %"
    over = "total" if figure.kind is bool else figure.over
    whole = over == "total" and figure.kind is not float
    digits = 1 if unit == "%" or figure.kind is not float else figure.digits
    form = "d" if whole else "" if unit == "ms" else f".{digits}f"

    def measure(row: Row) -> float | None:
        value = getattr(row, figure.name) if _COUNTS[figure.counts](row) else None
        return None if value is None else figure.scale * value

    def of(flights: Flights) -> Value:
        if over == "mean":
            return estimate(_values(flights.mine, measure), flights.over)
        there = [value for row in flights.rows if (value := measure(row)) is not None]
        if whole:
            return int(sum(there))
        return float(_SUMMED_UP[over](there)) if there else None

    def counted(scores: Scores) -> str:
        return f"{scores.figures[name]}/{scores.flights}"

    meaning = f"{_OVER[over]} `{figure.name}`{_OF[figure.counts]}"
    if figure.kind is bool:
        meaning = f"flights with `{figure.name}`"
    text = counted if figure.kind is bool else None
    return Column(name, heading, meaning, of, form, figure.table, text)


_OVER = {
    "mean": "interquartile mean of",
    "average": "mean of",
    "total": "sum of",
    "median": "median of",
    "least": "least",
    "most": "largest",
}
_OF = {
    "all": "",
    "flown": "",
    "unharmed": ", of flights without a violation",
    "accomplished": ", of accomplished flights",
}
_COUNTS: dict[str, Callable[[Row], bool]] = {
    "all": lambda row: True,
    "flown": lambda row: row.status == FLOWN,
    "unharmed": lambda row: row.ranked,
    "accomplished": lambda row: row.accomplished,
}
_SUMMED_UP: dict[str, Callable[[Sequence[float]], Any]] = {
    "total": sum,
    "average": np.mean,
    "median": np.median,
    "least": min,
    "most": max,
}


def _by_scenario(rows: Sequence[Row], scenarios: Sequence[str]) -> list[list[Row]]:
    found: Mapping[str, list[Row]] = {name: [] for name in scenarios}
    for row in rows:
        found[row.scenario].append(row)
    return list(found.values())


def _values(table: Sequence[Sequence[Row]], measure: Measure) -> list[FloatArray]:
    """One array per scenario; rows without the measure left out."""
    columns = [[measure(row) for row in rows] for rows in table]
    return [np.array([v for v in values if v is not None], float) for values in columns]


def _number_of(rows: Callable[[Row], bool]) -> Callable[[Flights], int]:
    return lambda flights: sum(map(rows, flights.rows))


def _disagreeing(flights: Flights) -> int | None:
    """How many flights the independent checker disagrees with; None: it was not asked."""
    asked = [row for row in flights.rows if row.verdict is not None]
    return sum(row.disagrees for row in asked) if asked else None


def _coverage(summed_up: Callable[..., FloatArray]) -> Callable[[Flights], Estimate]:
    return lambda flights: estimate(
        _values(flights.mine, lambda row: _PERCENT * row.coverage), flights.over, summed_up
    )


def _ranked_energy_Wh(row: Row) -> float | None:
    return row.energy_Wh if row.ranked else None


def _Wh_per_percent(row: Row) -> float | None:
    energy_Wh = _ranked_energy_Wh(row)
    if energy_Wh is None or not row.coverage:
        return None
    return energy_Wh / (_PERCENT * row.coverage)


def _above_bound(flights: Flights) -> Estimate:
    def above(row: Row) -> float | None:
        least_Wh = flights.bounds.get((row.scenario, row.steps or 0)) if row.accomplished else None
        if row.energy_Wh is None or not least_Wh:
            return None
        return _PERCENT * (row.energy_Wh / least_Wh - 1.0)

    return estimate(_values(flights.mine, above), flights.compared, mean)


def _relative_energy(flights: Flights) -> Estimate:
    parts = [
        _PERCENT * m / t.mean() if len(t) and t.mean() else np.empty(0)
        for m, t in zip(
            _values(flights.mine, _ranked_energy_Wh),
            _values(flights.theirs, _ranked_energy_Wh),
            strict=True,
        )
    ]
    return estimate(parts, flights.compared)


def _paired(figure: str) -> Callable[[Flights], Estimate]:
    """Of flights on the same scenario with the same seed that both accomplished."""

    def difference(flights: Flights) -> Estimate:
        differences = []
        for my_rows, their_rows in zip(flights.mine, flights.theirs, strict=True):
            there = {row.seed: getattr(row, figure) for row in their_rows if row.accomplished}
            pairs = [(getattr(r, figure), there.get(r.seed)) for r in my_rows if r.accomplished]
            differences.append(
                np.array([_PERCENT * (m / t - 1.0) for m, t in pairs if m is not None and t], float)
            )
        return paired_difference(differences)

    return difference


def _improves(figure: str) -> Callable[[Flights], Estimate]:
    def value(row: Row) -> float | None:
        return getattr(row, figure) if row.accomplished else np.inf

    return lambda flights: probability_of_improvement(
        _values(flights.mine, value), _values(flights.theirs, value), flights.compared
    )


def _flights(scores: Scores) -> str:
    return f"{scores.flights} ({scores.failed} failed)" if scores.failed else str(scores.flights)


_COUNTED = (
    Column("flights", "flights", "rows, those that failed included", lambda it: len(it.rows),
           table="outcome", text=_flights),
    Column("failed", "failed", "there is no flight: the planner refused the mission, or crashed",
           _number_of(lambda row: row.status != FLOWN), "d"),
    Column("disagreeing", "check disagrees", "flights with which the independent checker disagrees "
           "(`--check`)", _disagreeing, "d", "outcome"),
)  # fmt: skip

_FURTHER = (
    Column("violating", "violating", "flights with a violation",
           _number_of(lambda row: row.violations > 0), "d", "outcome"),
    Column("worst_coverage_percent", "worst, %", "the least covered of all flights",
           lambda it: _PERCENT * min(row.coverage for row in it.rows), ".0f", "outcome"),
    Column("mean_coverage_percent", "mean covered, %", "the mean, which one bad flight changes",
           _coverage(mean), ".1f"),
    Column("Wh_per_percent", "Wh per % covered", "of flights without a violation that covered "
           "something", lambda it: estimate(_values(it.mine, _Wh_per_percent), it.over), ".3f",
           "effort"),
    Column("above_bound_percent", "above the bound, %", "energy beyond the [least](bound.md) with "
           "which the mission can be flown in as many steps, mean over accomplished flights in the "
           "LPV model", _above_bound, ".1f", "effort"),
    Column("energy_difference_percent", "Δ energy, %", "mean difference over pairs of accomplished "
           "flights with the same scenario and seed", _paired("energy_Wh"), "+.1f", "reference"),
    Column("steps_difference_percent", "Δ steps, %", "likewise", _paired("steps"), "+.1f",
           "reference"),
    Column("improves_energy", "P(less energy)", "probability that a flight beats one of the "
           "reference on the same scenario, ties counting half; one that is not accomplished loses "
           "to any that is", _improves("energy_Wh"), ".2f", "reference"),
    Column("improves_steps", "P(fewer steps)", "likewise", _improves("steps"), ".2f", "reference"),
    Column("relative_energy_percent", "energy, % of the reference's", "of flights without a "
           "violation, in percent of the reference's mean on the same scenario", _relative_energy,
           ".1f", "reference"),
)  # fmt: skip
