"""The tables that people read: the same cells on the terminal and in Markdown."""

from collections.abc import Sequence

from rich.table import Table

from uas_coverage_env.leaderboard.row import FLOWN, Row
from uas_coverage_env.leaderboard.scores import NOTHING, Scores, columns, drawn_anew

Cells = tuple[list[str], list[list[str]]]


def cells(scores: Sequence[Scores], table: str, reference: str | None = None) -> Cells:
    """Headings and rows of the columns of a table.

    Args:
        scores: A row each; at least one.
        table: `outcome`: what was achieved, and what went wrong; `effort`: what it took;
            `reference`: beside the reference, which has no row of its own.
        reference: Its label, for that table.
    """
    shown = [
        column
        for name, column in columns().items()
        # what no planner has been asked is not shown
        if column.table == table and any(one.figures[name] is not None for one in scores)
    ]
    pairs = ["pairs"] if table == "reference" else []
    headings = ["planner", *pairs, *(column.heading for column in shown)]
    return headings, [
        [
            one.label,
            *(str(one.energy_difference_percent.n) for _ in pairs),
            *(column.cell(one) for column in shown),
        ]
        for one in scores
        if table != "reference" or one.label != reference
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


def _escaped(cell: str) -> str:
    return cell.replace("\\", "\\\\").replace("|", "\\|").replace("\n", " ")
