"""The tables that people read: the same cells on the terminal and in Markdown."""

from collections.abc import Sequence

from rich.table import Table

from uas_coverage_env.files.digits import three_digits
from uas_coverage_env.leaderboard.row import FLOWN, Row
from uas_coverage_env.leaderboard.scores import Scores, drawn_anew
from uas_coverage_env.leaderboard.statistics import Estimate

NOTHING = "–"

Cells = tuple[list[str], list[list[str]]]


def outcome_cells(scores: Sequence[Scores]) -> Cells:
    """Headings and rows: what was achieved, and what went wrong."""
    headings = [
        *("planner", "flights", "accomplished", "covered, %", "worst", "all home"),
        *("violations", "breaches", "fallbacks", "filtered, %", "return"),
    ]
    return headings, [
        [
            one.label,
            f"{one.flights} ({one.failed} failed)" if one.failed else str(one.flights),
            f"{one.accomplished}/{one.flights}",
            _text(one.coverage_percent, ".1f"),
            f"{one.worst_coverage_percent:.0f}",
            f"{one.all_home}/{one.flights}",
            f"{one.violations} in {one.violating}" if one.violations else "0",
            str(one.breaches),
            str(one.fallbacks),
            f"{one.filtered_percent:.1f}",
            _text(one.episode_return, ".1f"),
        ]
        for one in scores
    ]


def effort_cells(scores: Sequence[Scores]) -> Cells:
    """Headings and rows: what it took."""
    headings = [
        *("planner", "energy, Wh", "above the bound, %", "Wh per % covered", "steps"),
        *("decision p50, ms", "p95, ms"),
    ]
    return headings, [
        [
            one.label,
            _text(one.energy_Wh, ".2f"),
            _text(one.above_bound_percent, ".1f"),
            _text(one.Wh_per_percent, ".3f"),
            _text(one.steps, ".1f"),
            _milliseconds(one.decision_p50_ms),
            _milliseconds(one.decision_p95_ms),
        ]
        for one in scores
    ]


def reference_cells(scores: Sequence[Scores], reference: str) -> Cells:
    """Headings and rows of the comparison with the reference; it has no row of its own."""
    headings = [
        *("planner", "pairs", "Δ energy, %", "Δ steps, %"),
        *("P(less energy)", "P(fewer steps)", "energy, % of the reference's"),
    ]
    return headings, [
        [
            one.label,
            str(one.energy_difference_percent.n),
            _text(one.energy_difference_percent, "+.1f"),
            _text(one.steps_difference_percent, "+.1f"),
            _text(one.improves_energy, ".2f"),
            _text(one.improves_steps, ".2f"),
            _text(one.relative_energy_percent, ".1f"),
        ]
        for one in scores
        if one.label != reference
    ]


def scenarios_cells(rows: Sequence[Row], labels: Sequence[str]) -> Cells:
    """Means per scenario: energy and steps of the flights that accomplished the mission."""
    table = []
    for name in dict.fromkeys(row.scenario for row in rows):
        cells = [name]
        for label in labels:
            mine = [row for row in rows if (row.scenario, row.label) == (name, label)]
            cells.append(_scenario_cell(mine))
        table.append(cells)
    return ["scenario", *labels], table


def notes(rows: Sequence[Row], reference: str) -> list[str]:
    """What one must know to read the tables, a line each."""
    over = {
        "seeds": "stratified bootstrap over the seeds of each scenario",
        "scenarios": "bootstrap over scenarios, as each was flown with one seed",
    }[drawn_anew(rows)]
    return [
        f"Interquartile means with 95 % intervals [{over}]; no interval where the flights cannot "
        "tell. A flight with a violation has no energy, one that is not accomplished no steps.",
        "Return: the sum of the rewards of all UAS, not discounted, with the environments' default "
        "terms and weights (docs/environment.md#rewards), whatever a policy was trained with.",
        "Above the bound: mean over accomplished flights of the energy beyond the least with which "
        "the mission can be flown in as many steps (docs/bound.md); intervals are over scenarios.",
        f"Against {reference}, intervals are over scenarios. Δ: mean paired difference where both "
        "accomplished the mission. P: probability of doing better; a flight that is not "
        "accomplished is worse than any that is.",
        *_flown_alike(rows),
    ]


def _flown_alike(rows: Sequence[Row]) -> list[str]:
    """A line on the planners whose flights are the same with every seed."""
    flown: dict[str, dict[str, list[str | None]]] = {}
    for row in rows:
        flown.setdefault(row.label, {}).setdefault(row.scenario, []).append(row.trajectory_sha256)
    alike = [
        label
        for label, of_scenario in flown.items()
        if any(len(hashes) > 1 for hashes in of_scenario.values())
        and all(None not in hashes and len(set(hashes)) == 1 for hashes in of_scenario.values())
    ]
    if not alike:
        return []
    return [f"The same flight with every seed, so that one suffices: {', '.join(alike)}."]


def markdown(cells: Cells) -> str:
    """A Markdown table; figures to the right."""
    headings, rows = cells
    lines = [headings, ["---", *["---:"] * (len(headings) - 1)], *rows]
    return "".join(f"| {' | '.join(_escaped(cell) for cell in line)} |\n" for line in lines)


def rich_table(cells: Cells, title: str) -> Table:
    """The table for a terminal."""
    headings, rows = cells
    table = Table(title=title, title_justify="left", box=None, pad_edge=False)
    for n, heading in enumerate(headings):
        table.add_column(heading, justify="right" if n else "left", no_wrap=True)
    for row in rows:
        table.add_row(*(cell.replace("[", r"\[") for cell in row))
    return table


def _scenario_cell(rows: Sequence[Row]) -> str:
    done = [row for row in rows if row.accomplished]
    if not rows:
        return NOTHING
    if not done:
        reason = "violation" if any(row.violations for row in rows) else "not done"
        return reason if any(row.status == FLOWN for row in rows) else "failed"
    energy_Wh = sum(row.energy_Wh or 0.0 for row in done) / len(done)
    steps = sum(row.steps or 0 for row in done) / len(done)
    some = "" if len(done) == len(rows) else f" ({len(done)}/{len(rows)})"
    return f"{energy_Wh:.2f} Wh, {steps:.0f}{some}"


def _text(found: Estimate, form: str) -> str:
    if found.value is None:
        return NOTHING
    if found.low is None or found.high is None:
        return format(found.value, form)
    return f"{found.value:{form}} [{found.low:{form}}, {found.high:{form}}]"


def _milliseconds(value_ms: float | None) -> str:
    return NOTHING if value_ms is None else three_digits(value_ms)


def _escaped(cell: str) -> str:
    return cell.replace("\\", "\\\\").replace("|", "\\|").replace("\n", " ")
