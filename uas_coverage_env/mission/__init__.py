"""What planners and learners share: the brief of a mission, and what follows from it."""

from uas_coverage_env.mission.blocked import find_blocked
from uas_coverage_env.mission.brief import MissionBrief, MovingObstacleBrief
from uas_coverage_env.mission.legs import Legs
from uas_coverage_env.mission.range import Range, ReturnEstimate, seconds_home
from uas_coverage_env.mission.views import WorldView, first_sight

__all__ = [
    "Legs",
    "MissionBrief",
    "MovingObstacleBrief",
    "Range",
    "ReturnEstimate",
    "WorldView",
    "find_blocked",
    "first_sight",
    "seconds_home",
]
