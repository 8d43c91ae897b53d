"""A global order of the open waypoints for the whole swarm: which UAS visits which, and when."""

from uas_coverage_baselines.routing.search import (
    OrderSearch,
    Routes,
    SearchEffort,
    empty_routes,
    improve_routes,
)
from uas_coverage_baselines.routing.task import RoutingTask
from uas_coverage_baselines.routing.trips import FreshPacks, Packs, improve_trips
from uas_coverage_baselines.routing.window import RouteWindow

__all__ = [
    "FreshPacks",
    "OrderSearch",
    "Packs",
    "RouteWindow",
    "Routes",
    "RoutingTask",
    "SearchEffort",
    "empty_routes",
    "improve_routes",
    "improve_trips",
]
