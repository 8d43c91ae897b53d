"""The rows of `benchmarks/robustness.py`: what each tries, and what it makes of the results."""

from robustness_rows import faults, fuzz, kills, missions, players, repeats, scores
from robustness_rows.row import Row

ROWS: dict[str, Row] = {
    row.name: row
    for row in (
        missions.ROW,
        faults.ROW,
        fuzz.ROW,
        players.HOSTILE,
        players.RANDOM,
        scores.ROW,
        repeats.ROW,
        kills.ROW,
    )
}
"""By name, in the order in which they are made."""

NOT_MADE = {
    "R2": (
        "The judge against the independent checker",
        "`benchmarks/missions.py` judges every flight of its own by both, without disturbances.",
    ),
    "R7": (
        "Decision times",
        "they say something on a quiet machine only; `benchmarks/planner.py` measures them.",
    ),
    "R10": (
        "Exports",
        "`benchmarks/exports.py` has other programs read back what is exported.",
    ),
    "R11": ("Battery", "`tests/paper` compares with the published measurements."),
}
"""Rows of the plan that are not made here, with title and reason."""
