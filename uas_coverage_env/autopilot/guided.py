"""Guidance as a command: the velocity with which it flies a UAS to a place now."""

import numpy as np

from uas_coverage_env.autopilot.guidance import steer
from uas_coverage_env.entities.commands import GO_TO, HOME, VELOCITY, GoTo, Velocity, command_mode
from uas_coverage_env.entities.outcome import OUTCOME_DTYPE
from uas_coverage_env.entities.state import WorldState
from uas_coverage_env.vehicle import VZ, Z
from uas_coverage_env.world.arena import Arena


def velocity_of(
    arena: Arena, state: WorldState, i: int, command: GoTo, *, nonlinear: bool = False
) -> Velocity:
    """The velocity that flies as guidance does in the coming step.

    Args:
        arena: The mission, of the world or as a planner sees it (`WorldView`).
        state: The state.
        i: Index of the UAS, which flies.
        command: Where to.
        nonlinear: Whether the world flies the 6-DOF plant.

    Returns:
        A velocity of the same mode. Where guidance brakes, which it does by vertical speed and not
        by altitude, its altitude is the one that stops a climb or descent at once.
    """
    outcome = np.zeros(len(state.uas), OUTCOME_DTYPE)
    given = outcome[i]["applied_command"]
    given["kind"] = GO_TO
    given["values"][0] = HOME if command.waypoint is None else command.waypoint
    # return mode would be obeyed instead
    uas = state.uas.copy()
    uas["returning"] = False
    steer(arena, state._replace(uas=uas), nonlinear, outcome)
    north_mps, east_mps, altitude_m, _ = given["values"].tolist()
    if given["kind"] != VELOCITY:
        vehicle = arena.vehicles[i]
        (_, per_speed), (_, kept) = vehicle["vertical_A"].tolist()
        way, speed = vehicle["vertical_B"].tolist()
        stopping_s = per_speed - way / speed * kept
        altitude_m = -float(state.x[i, Z] + stopping_s * state.x[i, VZ])
    return Velocity(north_mps, east_mps, altitude_m, command_mode(command))
