"""What planners and learners share: the brief of a mission, and what follows from it."""

from uas_coverage_env.mission.brief import MissionBrief, MovingObstacleBrief

__all__ = ["MissionBrief", "MovingObstacleBrief"]
