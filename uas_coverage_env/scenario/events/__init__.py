"""What may happen during a mission: the tables `[[events]]` of a scenario, a class per kind."""

from typing import Annotated, get_args

from pydantic import Field, Strict

from uas_coverage_env.scenario.events.of_uas import (
    ChargeLost,
    GnssLost,
    LateStart,
    MotorDegraded,
    PlannerLost,
    RadioLost,
    Then,
    UasLost,
)
from uas_coverage_env.scenario.events.scene import (
    HomeClosed,
    MovingObstacleAdded,
    MovingObstacleTurns,
    NoFlyZoneAdded,
    ObstacleAdded,
    WaypointAdded,
    WaypointDropped,
)
from uas_coverage_env.scenario.events.table import EFFECTS, Effect, EventTable, OfUas

Event = Annotated[
    UasLost
    | RadioLost
    | PlannerLost
    | GnssLost
    | LateStart
    | MotorDegraded
    | ChargeLost
    | WaypointDropped
    | WaypointAdded
    | ObstacleAdded
    | NoFlyZoneAdded
    | MovingObstacleAdded
    | MovingObstacleTurns
    | HomeClosed,
    Field(discriminator="kind"),
]
"""A table of any kind: `kind` says which."""

EVENT_KINDS: tuple[type[EventTable], ...] = get_args(get_args(Event)[0])
"""The classes of all kinds."""

Events = Annotated[tuple[Event, ...], Strict(False), Field(max_length=1000)]

__all__ = [
    "EFFECTS",
    "EVENT_KINDS",
    "ChargeLost",
    "Effect",
    "Event",
    "EventTable",
    "Events",
    "GnssLost",
    "HomeClosed",
    "LateStart",
    "MotorDegraded",
    "MovingObstacleAdded",
    "MovingObstacleTurns",
    "NoFlyZoneAdded",
    "ObstacleAdded",
    "OfUas",
    "PlannerLost",
    "RadioLost",
    "Then",
    "UasLost",
    "WaypointAdded",
    "WaypointDropped",
]
