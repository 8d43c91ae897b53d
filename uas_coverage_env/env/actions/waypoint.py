"""Which of the nearest open waypoints next, or home."""

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.compiled.kernels import inlined_kernel
from uas_coverage_env.entities.commands import GO_TO, HOME, VELOCITY, GoTo
from uas_coverage_env.env.actions.kind import ActionKind
from uas_coverage_env.env.observation.nearest import NO_TARGET
from uas_coverage_env.env.observation.scales import K_WAYPOINTS
from uas_coverage_env.vehicle.layout import Z
from uas_coverage_env.world.coverage import can_cover

HOME_CHOICE = K_WAYPOINTS
"""The waypoint action that flies home."""


@inlined_kernel
def write(arena, state, tables, learners, i, parameters, values, command):
    """Write the command, see `ActionKind`; the target is kept in `learners.targets`."""
    choice = int(values[0])
    if choice == HOME_CHOICE:
        learners.targets[i] = HOME
    elif learners.candidates[i, choice] >= 0:
        learners.targets[i] = learners.candidates[i, choice]
    target = learners.targets[i]
    command.kind = GO_TO
    command.values[0] = target
    command.returning = target == HOME
    if target == NO_TARGET:
        # nowhere to go yet: hover
        command.kind = VELOCITY
        command.values[0] = 0.0
        command.values[2] = -state.x[i, Z]


def _mask(candidates: NDArray[np.int64]) -> NDArray[np.bool_]:
    masks = np.ones((*candidates.shape[:-1], HOME_CHOICE + 1), dtype=np.bool_)
    np.greater_equal(candidates, 0, out=masks[..., :HOME_CHOICE])
    return masks


def _express(arena, state, tables, learners, i, parameters, command):
    if not isinstance(command, GoTo):
        raise ValueError("it flies a GoTo")
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


WAYPOINT = ActionKind(
    name="waypoint",
    meaning=(
        "Fly to that one of the nearest open waypoints that it can cover, in the order of the "
        "observation; the last choice is home. A choice that does not exist now keeps the former "
        "target; before the first, and with none, a UAS stays where it is."
    ),
    write=write,
    choices=HOME_CHOICE + 1,
    mask=_mask,
    goes_to=True,
    express=_express,
)
