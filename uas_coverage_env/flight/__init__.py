"""What is kept of a flight: planners by name, the rollout, its record, measures and directory."""

from uas_coverage_env.files.errors import PlannerError
from uas_coverage_env.flight.demonstrations import Demonstrations, demonstrate
from uas_coverage_env.flight.directory import check_directory
from uas_coverage_env.flight.evaluation import Episode, Evaluation, evaluate
from uas_coverage_env.flight.flight import Flight
from uas_coverage_env.flight.loop import Progress, rollout
from uas_coverage_env.flight.metrics import (
    accomplished,
    coverage,
    covered_at,
    energy_Wh,
    episode_return,
    fallback_reasons,
    filtered_share,
    home,
    packs_used,
    reward_sums,
    summary,
)
from uas_coverage_env.flight.picture import draw_flight, flight_picture, flight_pictures
from uas_coverage_env.flight.planner import (
    Assistants,
    AssistedOptions,
    Decision,
    Planner,
    PlannerOptions,
)
from uas_coverage_env.flight.policy import Policy, as_planner
from uas_coverage_env.flight.record import (
    MODES,
    DecisionRecord,
    FlightRecord,
    LeftOpen,
    Swap,
    Violation,
    Why,
)
from uas_coverage_env.flight.registry import (
    OptionDescription,
    PlannerDescription,
    describe_planner,
    describe_planners,
    load_planner,
    planner_names,
)
from uas_coverage_env.flight.rest import rest_of
from uas_coverage_env.flight.scene_history import SceneHistory
from uas_coverage_env.flight.seen import (
    SeenGround,
    SeenPictures,
    footprints_m,
    seen_ground,
    seen_pictures,
)
from uas_coverage_env.flight.sorties import fly_sorties, sorties_summary

__all__ = [
    "MODES",
    "Assistants",
    "AssistedOptions",
    "Decision",
    "DecisionRecord",
    "Demonstrations",
    "Episode",
    "Evaluation",
    "Flight",
    "FlightRecord",
    "LeftOpen",
    "OptionDescription",
    "Planner",
    "PlannerDescription",
    "PlannerError",
    "PlannerOptions",
    "Policy",
    "Progress",
    "SceneHistory",
    "SeenGround",
    "SeenPictures",
    "Swap",
    "Violation",
    "Why",
    "accomplished",
    "as_planner",
    "check_directory",
    "coverage",
    "covered_at",
    "demonstrate",
    "describe_planner",
    "describe_planners",
    "draw_flight",
    "energy_Wh",
    "episode_return",
    "evaluate",
    "fallback_reasons",
    "filtered_share",
    "flight_picture",
    "flight_pictures",
    "fly_sorties",
    "footprints_m",
    "home",
    "load_planner",
    "packs_used",
    "planner_names",
    "rest_of",
    "reward_sums",
    "rollout",
    "seen_ground",
    "seen_pictures",
    "sorties_summary",
    "summary",
]
