"""A planner's command as an action: for imitation, DAgger and shields."""

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.autopilot.guidance import velocity_of
from uas_coverage_env.entities.commands import pack
from uas_coverage_env.entities.state import FLYING
from uas_coverage_env.env.actions.given import Actions
from uas_coverage_env.env.episode.memory import Learners, Tables
from uas_coverage_env.world import Arena, Command, GoTo, WorldState

_ROUNDING = 1e-9
"""A number this far beyond its range, as a share of it, is at the end of it."""


class Moment(NamedTuple):
    """A mission before a step."""

    names: Sequence[str]
    """Of the UAS."""
    arena: Arena
    state: WorldState
    tables: Tables
    learners: Learners
    nonlinear: bool
    """Whether the 6-DOF plant is flown."""


def action_of(actions: Actions, moment: Moment, name: str, command: Command, clip: bool) -> Any:
    """The action of a UAS that flies a command in the coming step.

    Args:
        actions: Of the environment.
        moment: Now.
        name: Of the UAS.
        command: A planner's.
        clip: Whether a number beyond the range of the action becomes the end of it.

    Returns:
        (size,) float32, exact but for the rounding to it; or a choice.

    Raises:
        ValueError: No action of this kind flies the command, or it is none; says why.
    """
    kind, state = actions.kind, moment.state
    if name not in moment.names:
        raise ValueError(f"there is no agent {name!r}: {', '.join(moment.names)}")
    i = moment.names.index(name)
    if state.uas[i].status != FLYING:
        raise ValueError(f"{name} does not fly any more; remove its command {command}")
    pack({name: command}, [name], [name], len(state.uncovered))  # refuses what is none
    try:
        if kind.express is None:
            raise ValueError("the kind has no `express`")
        flown = command
        if isinstance(command, GoTo) and not kind.goes_to:
            flown = velocity_of(moment.arena, state, i, command, nonlinear=moment.nonlinear)
        values = kind.express(
            moment.arena, state, moment.tables, moment.learners, i, kind.parameters, flown
        )
        if kind.choices:
            return np.int64(values[0])
        return _shares(kind.numbers, actions.ranges[i], values, clip)
    except ValueError as error:
        raise ValueError(f"no {kind.name} action of {name} flies {command}: {error}") from error


def _shares(
    names: Sequence[str], ranges: NDArray[np.float64], values: Sequence[float], clip: bool
) -> NDArray[np.float32]:
    shares = np.zeros(len(names), np.float32)
    for k, (lowest, middle, highest) in enumerate(ranges.tolist()):
        value = float(values[k])
        beyond = max(lowest - value, value - highest)
        if beyond > _ROUNDING * (highest - lowest) and not clip:
            raise ValueError(
                f"{names[k]} is {value:g}, and the action reaches from {lowest:g} to {highest:g}; "
                f"clip=True takes the end"
            )
        reach = highest - middle if value > middle else middle - lowest
        if reach > 0.0:
            shares[k] = min(max((value - middle) / reach, -1.0), 1.0)
    return shares


def joint_action_of(
    actions: Actions,
    moment: Moment,
    commands: Mapping[str, Command],
    clip: bool,
    *,
    n_uas: int | None = None,
) -> NDArray[Any]:
    """The actions of a whole swarm; arguments and errors as for `action_of`.

    Args:
        actions: Of the environment.
        moment: Now.
        commands: One for each UAS that flies.
        clip: See `action_of`.
        n_uas: Rows of the answer; None: the UAS of the mission.

    Returns:
        (U, size) float32 or (U,) choices; zero for those that do not fly.

    Raises:
        ValueError: See `action_of`; or one that flies has no command.
    """
    rows = len(moment.names) if n_uas is None else n_uas
    choice = actions.kind.choices > 0
    joint = np.zeros(rows if choice else (rows, actions.size), np.int64 if choice else np.float32)
    for i, name in enumerate(moment.names):
        if name not in commands and moment.state.uas[i].status == FLYING:
            raise ValueError(f"{name} has no command; give one for each UAS that flies")
    for name, command in commands.items():
        action = action_of(actions, moment, name, command, clip)
        joint[moment.names.index(name)] = action
    return joint
