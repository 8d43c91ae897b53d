"""What is done round every planner, once, so that a planner plans."""

from uas_coverage_env.planning.around.around import Around

__all__ = ["Around"]
