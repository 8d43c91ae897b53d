"""The rows of `benchmarks/robustness.py`: what each tries, and what it makes of the results."""

from robustness_rows import (
    batteries,
    decisions,
    exported,
    faults,
    fuzz,
    judge,
    kills,
    missions,
    players,
    repeats,
    scores,
)
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
        judge.ROW,
        batteries.ROW,
        decisions.ROW,
        exported.ROW,
    )
}
"""By name, in the order in which they are made."""
