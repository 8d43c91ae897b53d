"""Lower bounds: what no flight of a mission can do with less. See docs/bound.md."""

from uas_coverage_env.bound.mission import MissionBound, bound_of

__all__ = ["MissionBound", "bound_of"]
