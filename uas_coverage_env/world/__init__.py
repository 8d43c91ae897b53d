"""A mission as it stands: arena, state and commands, contacts and coverage (`docs/rules.md`)."""

from uas_coverage_env.entities.codes import CommandKind, ContactKind, UasStatus
from uas_coverage_env.entities.commands import Acceleration, Command, GoTo, Velocity, Wrench
from uas_coverage_env.entities.state import SwarmState, WorldState
from uas_coverage_env.world.arena import Arena, build_arena

__all__ = [
    "Acceleration",
    "Arena",
    "Command",
    "CommandKind",
    "ContactKind",
    "GoTo",
    "SwarmState",
    "UasStatus",
    "Velocity",
    "WorldState",
    "Wrench",
    "build_arena",
]
