"""Which of the nearest open waypoints next, or home; in v1 also to hold, and to climb."""

from functools import partial

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.compiled.kernels import inlined_kernel
from uas_coverage_env.entities.commands import GO_TO, HOME, VELOCITY, GoTo, Velocity
from uas_coverage_env.env.actions.kind import ActionKind
from uas_coverage_env.env.observation.nearest import NO_TARGET
from uas_coverage_env.env.observation.scales import K_WAYPOINTS
from uas_coverage_env.vehicle.layout import Z
from uas_coverage_env.world.coverage import can_cover

HOME_CHOICE = K_WAYPOINTS
"""The waypoint action that flies home."""

HOLD_CHOICE, CLIMB_CHOICE = K_WAYPOINTS + 1, K_WAYPOINTS + 2
"""Those of v1 that stay where it is, and that climb on the way to where it is flying."""

CLIMB_M = 10.0
"""Above where it is, what is asked for while climbing: more than any vehicle climbs in a step [m].
"""

_HERE_M = 1e-6
"""A velocity of zero at an altitude so near to that of a UAS holds [m]."""


@inlined_kernel
def write(arena, state, tables, learners, i, parameters, values, command):
    """Write the command, see `ActionKind`; the target is kept in `learners.targets`."""
    choice = int(values[0])
    if choice == HOME_CHOICE:
        learners.targets[i] = HOME
    elif choice < HOME_CHOICE and learners.candidates[i, choice] >= 0:
        learners.targets[i] = learners.candidates[i, choice]
    target = learners.targets[i]
    command.kind = GO_TO
    command.values[0] = target
    command.returning = target == HOME and choice != HOLD_CHOICE
    climb_m = CLIMB_M if choice == CLIMB_CHOICE else 0.0
    command.values[1] = climb_m
    if target == NO_TARGET or choice == HOLD_CHOICE:
        # nowhere to go yet, or it waits: hover
        command.kind = VELOCITY
        command.values[0] = 0.0
        command.values[1] = 0.0
        command.values[2] = climb_m - state.x[i, Z]


def _mask(choices: int, candidates: NDArray[np.int64]) -> NDArray[np.bool_]:
    masks = np.ones((*candidates.shape[:-1], choices), dtype=np.bool_)
    np.greater_equal(candidates, 0, out=masks[..., :HOME_CHOICE])
    return masks


def _express(arena, state, tables, learners, i, parameters, command):
    if not isinstance(command, GoTo):
        raise ValueError("it flies a GoTo")
    if command.climb_m:
        raise ValueError("it does not climb by choice")
    if command.waypoint is None:
        return (HOME_CHOICE,)
    (choices,) = np.nonzero(learners.candidates[i] == command.waypoint)
    if not choices.size:
        if not state.uncovered[command.waypoint]:
            raise ValueError(f"waypoint {command.waypoint} is covered already")
        if not can_cover(arena, i, command.waypoint):
            raise ValueError(f"waypoint {command.waypoint} asks for a sensor that it lacks")
        raise ValueError(
            f"waypoint {command.waypoint} is not among the {K_WAYPOINTS} nearest open ones"
        )
    return (int(choices[0]),)


def _express_more(arena, state, tables, learners, i, parameters, command):
    target = learners.targets[i]
    if isinstance(command, Velocity):
        altitude_m = -state.x[i, Z]
        if command.north_mps or command.east_mps or command.mode == "return":
            raise ValueError("it flies a GoTo, or holds still")
        if abs(command.altitude_m - altitude_m) <= _HERE_M:
            return (HOLD_CHOICE,)
        if target == NO_TARGET and abs(command.altitude_m - altitude_m - CLIMB_M) <= _HERE_M:
            return (CLIMB_CHOICE,)
        raise ValueError(f"it holds at its altitude, which is {altitude_m:g} m")
    if isinstance(command, GoTo) and command.climb_m:
        if command.climb_m != CLIMB_M:
            raise ValueError(f"it climbs by {CLIMB_M:g} m")
        if target != (HOME if command.waypoint is None else command.waypoint):
            raise ValueError("it climbs on the way to where it is flying already")
        return (CLIMB_CHOICE,)
    return _express(arena, state, tables, learners, i, parameters, command)


WAYPOINT = ActionKind(
    name="waypoint",
    meaning=(
        "Fly to that one of the nearest open waypoints that it can cover, in the order of the "
        "observation; the last choice is home. A choice that does not exist now keeps the former "
        "target; before the first, and with none, a UAS stays where it is."
    ),
    write=write,
    choices=HOME_CHOICE + 1,
    mask=partial(_mask, HOME_CHOICE + 1),
    goes_to=True,
    express=_express,
)

WAYPOINT_V1 = ActionKind(
    name="waypoint",
    meaning=(
        "Fly to that one of the nearest open waypoints that it can cover, in the order of the "
        "observation, or home; hold where it is; or climb on the way to where it is flying, at "
        "its fastest and as far as the fence allows, to pass over others and obstacles. It comes "
        "down again once it is not chosen. To hold and to climb keep the target, as a choice that "
        "does not exist now does; without one a UAS stays where it is."
    ),
    write=write,
    choices=CLIMB_CHOICE + 1,
    mask=partial(_mask, CLIMB_CHOICE + 1),
    goes_to=True,
    express=_express_more,
)
