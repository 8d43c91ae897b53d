"""Planners and policies compared on the same scenarios: flown, kept, counted, published."""

from uas_coverage_env.leaderboard.bounds import bounds_of
from uas_coverage_env.leaderboard.picture import leaderboard_figure
from uas_coverage_env.leaderboard.planner_specs import PlannerSpec, planner_specs_of
from uas_coverage_env.leaderboard.publish import Comparison, read_comparison
from uas_coverage_env.leaderboard.row import Row
from uas_coverage_env.leaderboard.scenario_sets import scenarios_of, seed_range
from uas_coverage_env.leaderboard.scores import Scores, scores_of
from uas_coverage_env.leaderboard.sweep import Sweep

__all__ = [
    "Comparison",
    "PlannerSpec",
    "Row",
    "Scores",
    "Sweep",
    "bounds_of",
    "leaderboard_figure",
    "planner_specs_of",
    "read_comparison",
    "scenarios_of",
    "scores_of",
    "seed_range",
]
