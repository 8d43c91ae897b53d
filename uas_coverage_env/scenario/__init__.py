"""What a mission is: scenarios from files, from code and from a seed, checked at the door."""

from uas_coverage_env.features.parameter_errors import Uncertainty
from uas_coverage_env.features.sensing import Sensing
from uas_coverage_env.features.table import DisturbanceTable
from uas_coverage_env.features.wind import Gust, RandomGusts, Wind
from uas_coverage_env.scenario.checks import free_places_m, out_of_reach, warnings
from uas_coverage_env.scenario.conditions import Conditions, conditions_of
from uas_coverage_env.scenario.execution import Execution
from uas_coverage_env.scenario.families import Family, FamilyOfSeeds, Size, installed_families
from uas_coverage_env.scenario.families.flood_village import flood_village
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
from uas_coverage_env.scenario.levels import LEVELS, Level, with_disturbances
from uas_coverage_env.scenario.load import load_scenario, scenario_names
from uas_coverage_env.scenario.model import Scenario
from uas_coverage_env.scenario.packs import Sorties
from uas_coverage_env.scenario.room import Room
from uas_coverage_env.scenario.source import (
    MissionSource,
    ScenarioGenerator,
    ScenarioLike,
    loaded_scenario,
)

__all__ = [
    "LEVELS",
    "Conditions",
    "Decoration",
    "DisturbanceTable",
    "Execution",
    "Family",
    "FamilyOfSeeds",
    "GeneratedScenarios",
    "Geofence",
    "Gust",
    "Level",
    "MissionSource",
    "MovingObstacle",
    "NoFlyZone",
    "Obstacle",
    "Place",
    "RandomGusts",
    "Room",
    "Scenario",
    "ScenarioGenerator",
    "ScenarioLike",
    "ScheduledVelocity",
    "Sensing",
    "Sensor",
    "Size",
    "Sorties",
    "Uas",
    "Uncertainty",
    "Waypoint",
    "Wind",
    "conditions_of",
    "flood_village",
    "free_places_m",
    "generate_scenario",
    "installed_families",
    "load_scenario",
    "loaded_scenario",
    "out_of_reach",
    "sample_scenario",
    "scenario_names",
    "warnings",
    "with_disturbances",
]
