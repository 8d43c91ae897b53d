"""Planners and policies compared on the same scenarios: flown, kept, counted, published."""

from uas_coverage_env.leaderboard.bounds import Bounds, bounds_of
from uas_coverage_env.leaderboard.hardware import machine
from uas_coverage_env.leaderboard.picture import leaderboard_figure
from uas_coverage_env.leaderboard.planner_specs import PlannerSpec, planner_specs_of
from uas_coverage_env.leaderboard.publish import (
    FLIGHTS,
    SCORES,
    Comparison,
    failures,
    parquet,
    published,
    write,
)
from uas_coverage_env.leaderboard.row import FAILED, FLOWN, TIMES, Row
from uas_coverage_env.leaderboard.scenario_sets import (
    SETS,
    scenarios_of,
    seed_range,
)
from uas_coverage_env.leaderboard.scores import Scores, scores_of
from uas_coverage_env.leaderboard.sweep import Entry, Sweep, source_of

__all__ = [
    "FAILED",
    "FLIGHTS",
    "FLOWN",
    "SCORES",
    "SETS",
    "TIMES",
    "Bounds",
    "Comparison",
    "Entry",
    "PlannerSpec",
    "Row",
    "Scores",
    "Sweep",
    "bounds_of",
    "failures",
    "leaderboard_figure",
    "machine",
    "parquet",
    "planner_specs_of",
    "published",
    "scenarios_of",
    "scores_of",
    "seed_range",
    "source_of",
    "write",
]
