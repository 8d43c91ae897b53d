"""What planners and learners share: the brief of a mission, and what follows from it."""

from uas_coverage_env.mission.brief import MissionBrief, MovingObstacleBrief
from uas_coverage_env.mission.range import Range, ReturnEstimate
from uas_coverage_env.mission.views import WorldView, first_sight
from uas_coverage_env.mission.ways import Ways

__all__ = [
    "MissionBrief",
    "MovingObstacleBrief",
    "Range",
    "ReturnEstimate",
    "Ways",
    "WorldView",
    "first_sight",
]
