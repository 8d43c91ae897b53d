"""What a mission is: scenarios from files, from code and from a seed, checked at the door."""

from uas_coverage_env.scenario.checks import warnings
from uas_coverage_env.scenario.family import FAMILIES, GeneratedScenarios, draw_scenario
from uas_coverage_env.scenario.generator import generate_scenario
from uas_coverage_env.scenario.load import load_scenario, scenario_names
from uas_coverage_env.scenario.model import (
    Decoration,
    Geofence,
    MovingObstacle,
    Obstacle,
    Scenario,
    ScheduledVelocity,
    Uas,
    Waypoint,
)
from uas_coverage_env.scenario.source import MissionSource, Room, ScenarioGenerator, ScenarioLike

__all__ = [
    "FAMILIES",
    "Decoration",
    "GeneratedScenarios",
    "Geofence",
    "MissionSource",
    "MovingObstacle",
    "Obstacle",
    "Room",
    "Scenario",
    "ScenarioGenerator",
    "ScenarioLike",
    "ScheduledVelocity",
    "Uas",
    "Waypoint",
    "draw_scenario",
    "generate_scenario",
    "load_scenario",
    "scenario_names",
    "warnings",
]
