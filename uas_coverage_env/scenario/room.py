"""How large the missions of an environment may be: its spaces are made for that."""

from typing import NamedTuple

from uas_coverage_env.scenario.model import Scenario

SPARE, MOVING = 2, 4
"""Room for what is asked for, and for rare draws: it costs nothing, a mission refused much."""


class Room(NamedTuple):
    """The most that a mission may have."""

    n_uas: int
    n_waypoints: int
    n_moving: int

    @classmethod
    def of(cls, scenario: Scenario) -> "Room":
        """What a scenario has, or may have once all of its events have happened."""
        kinds = [event.kind for event in scenario.events]
        n_waypoints = sum(waypoint.visits for waypoint in scenario.waypoints)
        n_waypoints += kinds.count("waypoint_added")
        n_moving = len(scenario.moving_obstacles) + kinds.count("moving_obstacle_added")
        return cls(len(scenario.uas), n_waypoints, n_moving)
