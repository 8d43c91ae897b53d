"""The rows of `benchmarks/robustness.py`: what each tries, and what it makes of the results."""

from robustness_rows import (
    attacks,
    batteries,
    decisions,
    exported,
    faults,
    fuzz,
    judge,
    kills,
    missions,
    mutants,
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
        attacks.HOSTILE,
        attacks.RANDOM,
        scores.ROW,
        repeats.ROW,
        kills.ROW,
        judge.ROW,
        batteries.ROW,
        decisions.ROW,
        exported.ROW,
        mutants.ROW,
    )
}
"""By name, in the order in which they are made."""

ON_DEMAND = (mutants.ROW.name,)
"""Made only where they are asked for: they take hours."""
