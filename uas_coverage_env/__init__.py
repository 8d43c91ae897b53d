"""Multi-UAS area coverage with a physical battery: one model of the world for every player.

Importing the package registers the environments with Gymnasium and PettingZoo, nothing else.
"""

from uas_coverage_env.env import register_environments
from uas_coverage_env.files.strict_toml import InputError
from uas_coverage_env.flight import (
    Decision,
    Flight,
    Planner,
    load_planner,
    planner_names,
    rollout,
)
from uas_coverage_env.mission import MissionBrief
from uas_coverage_env.scenario import Scenario, generate_scenario, load_scenario, scenario_names
from uas_coverage_env.simulation import World
from uas_coverage_env.vehicle import (
    LinearModel,
    VehicleParams,
    linear_model,
    load_vehicle,
    simulate_battery,
    vehicle_names,
)
from uas_coverage_env.world import (
    Acceleration,
    Command,
    CommandKind,
    ContactKind,
    GoTo,
    SwarmState,
    UasStatus,
    Velocity,
    Wrench,
)

register_environments()

__all__ = [
    "Acceleration",
    "Command",
    "CommandKind",
    "ContactKind",
    "Decision",
    "Flight",
    "GoTo",
    "InputError",
    "LinearModel",
    "MissionBrief",
    "Planner",
    "Scenario",
    "SwarmState",
    "UasStatus",
    "VehicleParams",
    "Velocity",
    "World",
    "Wrench",
    "generate_scenario",
    "linear_model",
    "load_planner",
    "load_scenario",
    "load_vehicle",
    "planner_names",
    "rollout",
    "scenario_names",
    "simulate_battery",
    "vehicle_names",
]
