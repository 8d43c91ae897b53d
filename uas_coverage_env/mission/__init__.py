"""What planners and learners share: the brief of a mission, and what follows from it."""

from uas_coverage_env.mission.access import Access
from uas_coverage_env.mission.approach import Approach, carefully, with_free_aims
from uas_coverage_env.mission.attempts import Attempts
from uas_coverage_env.mission.blocked import find_blocked
from uas_coverage_env.mission.brief import MissionBrief, MovingObstacleBrief
from uas_coverage_env.mission.errands import Errand, Errands
from uas_coverage_env.mission.guided_flight import GuidedFlight
from uas_coverage_env.mission.handover import Handover, without
from uas_coverage_env.mission.learnt_wind import MEAN_HEIGHT_M, LearntWind, in_disturbances
from uas_coverage_env.mission.legs import Legs
from uas_coverage_env.mission.range import Range, ReturnEstimate, seconds_home
from uas_coverage_env.mission.recall import Recall
from uas_coverage_env.mission.refusal import refuse_what_asks
from uas_coverage_env.mission.relaunch import Relaunch
from uas_coverage_env.mission.repeats import Repeats
from uas_coverage_env.mission.views import WorldView, first_sight
from uas_coverage_env.mission.ways import Way, Ways

__all__ = [
    "MEAN_HEIGHT_M",
    "Access",
    "Approach",
    "Attempts",
    "Errand",
    "Errands",
    "GuidedFlight",
    "Handover",
    "LearntWind",
    "Legs",
    "MissionBrief",
    "MovingObstacleBrief",
    "Range",
    "Recall",
    "Relaunch",
    "Repeats",
    "ReturnEstimate",
    "Way",
    "Ways",
    "WorldView",
    "carefully",
    "find_blocked",
    "first_sight",
    "in_disturbances",
    "refuse_what_asks",
    "seconds_home",
    "with_free_aims",
    "without",
]
