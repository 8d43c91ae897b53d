"""Lower bounds: what no flight of a mission can do with less. See docs/bound.md."""

from uas_coverage_env.bound.mission import MOST_WAYPOINTS, MissionBound, bound_of

__all__ = ["MOST_WAYPOINTS", "MissionBound", "bound_of"]
