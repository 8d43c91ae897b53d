"""Labels for a route policy: towns, and the routes that a planner would fly there."""

from typing import Any, NamedTuple

from uas_coverage_env.flight import load_planner
from uas_coverage_env.mission import MissionBrief
from uas_coverage_env.scenario import Scenario


class Label(NamedTuple):
    """A town and the routes of its UAS.

    Attributes:
        number: Of the town.
        routes: Waypoints of each UAS, in order.
        steps: Steps that each planned flight takes; 0 where it stays at home.
    """

    number: int
    routes: list[list[int]]
    steps: list[int]


def label_of(number: int, town: Scenario) -> Label:
    """The routes by which `trajectory` would fly a town before take-off; nothing is flown."""
    planner: Any = load_planner("trajectory")
    planner.reset(MissionBrief.of(town), 0)
    plan = planner.mission_plan
    planned, routes = plan.planned, [route.tolist() for route in plan.order.routes]
    steps = [planned[u].flight.steps if u in planned else 0 for u in range(len(routes))]
    return Label(number, routes, steps)
