"""Planners and policies compared on the same scenarios: flown, kept, counted, published."""

from uas_coverage_env.leaderboard.bounds import Bounds, bounds_of
from uas_coverage_env.leaderboard.hardware import machine
from uas_coverage_env.leaderboard.picture import leaderboard_figure
from uas_coverage_env.leaderboard.planner_specs import PlannerSpec, planner_specs_of
from uas_coverage_env.leaderboard.publish import FLIGHTS, Comparison, failures, published, write
from uas_coverage_env.leaderboard.row import FAILED, FLOWN, TIMES, Row
from uas_coverage_env.leaderboard.scenario_sets import (
    SETS,
    scenarios_of,
    seed_range,
)
from uas_coverage_env.leaderboard.scores import Scores, scores_of
from uas_coverage_env.leaderboard.store import STORE, Store, flights_in, opened
from uas_coverage_env.leaderboard.sweep import Entry, Sweep, source_of
from uas_coverage_env.leaderboard.workers import (
    Backend,
    StoppedError,
    WorkerLostError,
    fly,
    fly_all,
    jobs_of,
    kept_as,
)

__all__ = [
    "FAILED",
    "FLIGHTS",
    "FLOWN",
    "SETS",
    "STORE",
    "TIMES",
    "Backend",
    "Bounds",
    "Comparison",
    "Entry",
    "PlannerSpec",
    "Row",
    "Scores",
    "StoppedError",
    "Store",
    "Sweep",
    "WorkerLostError",
    "bounds_of",
    "failures",
    "flights_in",
    "fly",
    "fly_all",
    "jobs_of",
    "kept_as",
    "leaderboard_figure",
    "machine",
    "opened",
    "planner_specs_of",
    "published",
    "scenarios_of",
    "scores_of",
    "seed_range",
    "source_of",
    "write",
]
