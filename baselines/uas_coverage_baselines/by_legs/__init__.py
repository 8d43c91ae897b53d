"""Missions as an autopilot flies them from a file: few straight legs, from rest to rest."""

from uas_coverage_baselines.by_legs.follower import LegFollower
from uas_coverage_baselines.by_legs.mission import LegMission

__all__ = ["LegFollower", "LegMission"]
