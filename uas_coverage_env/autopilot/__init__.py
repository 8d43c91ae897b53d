"""What flies a UAS: control, guidance past obstacles, return mode and safety filter."""

from uas_coverage_env.autopilot.assist import AssistantCode, assistants
from uas_coverage_env.autopilot.control import write_brake, write_command
from uas_coverage_env.autopilot.guidance import (
    guide,
    path_length_home_m,
    target_position,
    velocity_of,
)
from uas_coverage_env.autopilot.return_mode import (
    has_to_return,
    seconds_home,
    seconds_to_keep,
)
from uas_coverage_env.autopilot.return_path import flight_home

__all__ = [
    "AssistantCode",
    "assistants",
    "flight_home",
    "guide",
    "has_to_return",
    "path_length_home_m",
    "seconds_home",
    "seconds_to_keep",
    "target_position",
    "velocity_of",
    "write_brake",
    "write_command",
]
