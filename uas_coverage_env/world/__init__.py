"""What happens: state, commands, and the one compiled step (rules: `docs/rules.md`)."""

from uas_coverage_env.world.arena import Arena, build_arena
from uas_coverage_env.world.assist import AssistantCode, assistants
from uas_coverage_env.world.commands import (
    ACCELERATION,
    CLIMB,
    COMMAND_DTYPE,
    GO_TO,
    HOME,
    KIND_NAMES,
    VELOCITY,
    WRENCH,
    Acceleration,
    Command,
    GoTo,
    Mode,
    Velocity,
    Wrench,
    command_mode,
    pack,
)
from uas_coverage_env.world.guidance import guide, path_length_home_m, target_position
from uas_coverage_env.world.outcome import CONTACT_NAMES, OUTCOME_DTYPE
from uas_coverage_env.world.return_mode import has_to_return, seconds_home
from uas_coverage_env.world.routes import CLEAR, IN_SIGHT, crossing, route
from uas_coverage_env.world.simulation import Dynamics, World, initial_state
from uas_coverage_env.world.state import (
    ABSENT,
    FLYING,
    LANDED,
    LOST,
    STATUS_NAMES,
    SwarmState,
    WorldState,
)
from uas_coverage_env.world.step import advance, begin_mission, first_invalid

__all__ = [
    "ABSENT",
    "ACCELERATION",
    "CLEAR",
    "CLIMB",
    "COMMAND_DTYPE",
    "CONTACT_NAMES",
    "FLYING",
    "GO_TO",
    "HOME",
    "IN_SIGHT",
    "KIND_NAMES",
    "LANDED",
    "LOST",
    "OUTCOME_DTYPE",
    "STATUS_NAMES",
    "VELOCITY",
    "WRENCH",
    "Acceleration",
    "Arena",
    "AssistantCode",
    "Command",
    "Dynamics",
    "GoTo",
    "Mode",
    "SwarmState",
    "Velocity",
    "World",
    "WorldState",
    "Wrench",
    "advance",
    "assistants",
    "begin_mission",
    "build_arena",
    "command_mode",
    "crossing",
    "first_invalid",
    "guide",
    "has_to_return",
    "initial_state",
    "pack",
    "path_length_home_m",
    "route",
    "seconds_home",
    "target_position",
]
