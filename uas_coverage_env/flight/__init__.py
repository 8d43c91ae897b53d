"""What is kept of a flight: planners by name, the rollout, its record, figures and directory."""

from uas_coverage_env.files.errors import PlannerError
from uas_coverage_env.flight.demonstrations import Demonstrations, demonstrate
from uas_coverage_env.flight.evaluation import Evaluation, evaluate
from uas_coverage_env.flight.figure import Figure
from uas_coverage_env.flight.flight import Flight
from uas_coverage_env.flight.loop import Progress, rollout
from uas_coverage_env.flight.metrics import covered_at
from uas_coverage_env.flight.picture import flight_picture
from uas_coverage_env.flight.planner import (
    Assistants,
    AssistedOptions,
    Planner,
    PlannerOptions,
)
from uas_coverage_env.flight.policy import as_planner
from uas_coverage_env.flight.record import MODES, Violation, Why
from uas_coverage_env.flight.registry import describe_planners, load_planner, planner_names
from uas_coverage_env.flight.rest import rest_of
from uas_coverage_env.flight.seen import seen_ground
from uas_coverage_env.flight.sorties import fly_sorties, sorties_summary
from uas_coverage_env.planning.decision import Decision

__all__ = [
    "MODES",
    "Assistants",
    "AssistedOptions",
    "Decision",
    "Demonstrations",
    "Evaluation",
    "Figure",
    "Flight",
    "Planner",
    "PlannerError",
    "PlannerOptions",
    "Progress",
    "Violation",
    "Why",
    "as_planner",
    "covered_at",
    "demonstrate",
    "describe_planners",
    "evaluate",
    "flight_picture",
    "fly_sorties",
    "load_planner",
    "planner_names",
    "rest_of",
    "rollout",
    "seen_ground",
    "sorties_summary",
]
