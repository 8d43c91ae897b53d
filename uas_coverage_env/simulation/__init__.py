"""The one compiled step, and a mission that is flown with it."""

from uas_coverage_env.simulation.world import World

__all__ = ["World"]
