"""Missions as an autopilot flies them from a file: few straight legs, from rest to rest."""

from uas_coverage_baselines.by_legs.mission import LegMission
from uas_coverage_baselines.by_legs.pilot import LegPilot

__all__ = ["LegMission", "LegPilot"]
