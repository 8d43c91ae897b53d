"""A global order of the open waypoints for the whole swarm: which UAS visits which, and when."""

from uas_coverage_env.planning.routing.problem import RoutingProblem
from uas_coverage_env.planning.routing.search import (
    OPERATORS,
    Routes,
    SearchEffort,
    empty_routes,
    improve_routes,
)
from uas_coverage_env.planning.routing.trips import search_orders

__all__ = [
    "OPERATORS",
    "Routes",
    "RoutingProblem",
    "SearchEffort",
    "empty_routes",
    "improve_routes",
    "search_orders",
]
