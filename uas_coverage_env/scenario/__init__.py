"""What a mission is: scenarios from files, from code and from a seed, checked at the door."""

from uas_coverage_env.features.parameter_errors import Uncertainty
from uas_coverage_env.features.sensing import Sensing
from uas_coverage_env.features.table import DisturbanceTable
from uas_coverage_env.features.wind import Gust, RandomGusts, Wind
from uas_coverage_env.scenario.checks import warnings
from uas_coverage_env.scenario.execution import Execution
from uas_coverage_env.scenario.families import Family
from uas_coverage_env.scenario.families.generated import (
    GeneratedScenarios,
    generate_scenario,
    sample_scenario,
)
from uas_coverage_env.scenario.fields import (
    Decoration,
    Geofence,
    MovingObstacle,
    NoFlyZone,
    Obstacle,
    Place,
    ScheduledVelocity,
    Sensor,
    Uas,
    Waypoint,
)
from uas_coverage_env.scenario.levels import with_disturbances
from uas_coverage_env.scenario.load import load_scenario, scenario_names
from uas_coverage_env.scenario.model import Scenario
from uas_coverage_env.scenario.packs import Sorties
from uas_coverage_env.scenario.source import MissionSource

__all__ = [
    "Decoration",
    "DisturbanceTable",
    "Execution",
    "Family",
    "GeneratedScenarios",
    "Geofence",
    "Gust",
    "MissionSource",
    "MovingObstacle",
    "NoFlyZone",
    "Obstacle",
    "Place",
    "RandomGusts",
    "Scenario",
    "ScheduledVelocity",
    "Sensing",
    "Sensor",
    "Sorties",
    "Uas",
    "Uncertainty",
    "Waypoint",
    "Wind",
    "generate_scenario",
    "load_scenario",
    "sample_scenario",
    "scenario_names",
    "warnings",
    "with_disturbances",
]
