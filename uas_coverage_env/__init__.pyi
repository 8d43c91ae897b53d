from .files.strict_toml import InputError
from .flight import (
    Decision,
    Evaluation,
    Flight,
    Planner,
    as_planner,
    evaluate,
    load_planner,
    planner_names,
    rollout,
)
from .mission import MissionBrief
from .scenario import Scenario, generate_scenario, load_scenario, scenario_names
from .simulation import World
from .vehicle import (
    LinearModel,
    VehicleParams,
    linear_model,
    load_vehicle,
    simulate_battery,
    vehicle_names,
)
from .world import (
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

__all__ = [
    "Acceleration",
    "Command",
    "CommandKind",
    "ContactKind",
    "Decision",
    "Evaluation",
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
    "as_planner",
    "evaluate",
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
