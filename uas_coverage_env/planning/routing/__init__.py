"""A global order of the open waypoints for the whole swarm: which UAS visits which, and when."""

from uas_coverage_env.planning.routing.search import (
    Routes,
    SearchEffort,
    empty_routes,
    improve_routes,
)
from uas_coverage_env.planning.routing.task import RoutingTask

__all__ = ["Routes", "RoutingTask", "SearchEffort", "empty_routes", "improve_routes"]
