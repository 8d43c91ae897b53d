"""`trajectory`: each UAS's whole mission as one trajectory, flown as planned."""

from uas_coverage_baselines.trajectory.options import TrajectoryOptions
from uas_coverage_baselines.trajectory.planner import Trajectory

__all__ = ["Trajectory", "TrajectoryOptions"]
