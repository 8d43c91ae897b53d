"""Actions become commands: the kinds of a version as one kernel, others at their address."""

import math
from collections.abc import Sequence
from functools import cache
from typing import Any

import numpy as np
from numba import from_dtype, types
from numpy.typing import NDArray

from uas_coverage_env.autopilot.control import write_brake
from uas_coverage_env.compiled.calls import Signature
from uas_coverage_env.compiled.kernels import inlined_kernel, kernel, rarely
from uas_coverage_env.entities.commands import CLIMB, COMMAND_DTYPE, GO_TO, HOME, VELOCITY
from uas_coverage_env.entities.state import FLYING, STATE
from uas_coverage_env.env.actions import ActionKind
from uas_coverage_env.env.episode.memory import (
    ADDRESS,
    CHOOSES,
    GOES_TO,
    HIGHEST,
    LEARNERS,
    LOWEST,
    MIDDLE,
    TABLES,
    WHICH,
    Acting,
)
from uas_coverage_env.world.arena import ARENA

Kinds = tuple[ActionKind, ...]

_OWN = -1
"""Which kind it is, where it is none of the version."""


@cache
def _types() -> tuple[types.Type, ...]:
    """Of the arguments of a kind's kernel."""
    numbers = types.Array(types.float64, 1, "C")
    return (
        ARENA.numba_type(), STATE.numba_type(), TABLES.numba_type(), LEARNERS.numba_type(),
        types.int64, numbers, numbers, from_dtype(COMMAND_DTYPE),
    )  # fmt: skip


_SIGNATURE = Signature("arena state tables learners i parameters values command", _types)
_write_command = _SIGNATURE.call


def acting_of(kind: ActionKind, own: Kinds) -> Acting:
    """Compile the kernel of a kind, or load it from the cache.

    Args:
        kind: Of the actions.
        own: Those of the version.

    Raises:
        ValueError: It cannot be compiled.
    """
    same = [kind.write is each.write for each in own]
    which = same.index(True) if any(same) else _OWN
    address = 0 if which != _OWN else _SIGNATURE.address_of(kind.write)
    return Acting(
        call=np.array([which, address, kind.choices > 0, kind.goes_to], dtype=np.int64),
        parameters=np.array(kind.parameters, dtype=np.float64),
    )


def is_own(acting: Acting) -> bool:
    """Whether the kind is none of `ACTIONS`: what it writes is checked."""
    return int(acting.call[WHICH]) == _OWN


def refuse_what_it_wrote(
    kind: ActionKind, asked: NDArray[np.float64], names: Sequence[str]
) -> None:
    """Say for which UAS an own kind wrote a command that cannot be flown; see `write_command`.

    Args:
        kind: The kind.
        asked: (..., U, A) the actions after the step.
        names: Of the UAS.

    Raises:
        ValueError: There is one.
    """
    wrong = ~np.isfinite(asked[..., 0])
    if wrong.any():
        i = int(np.argwhere(wrong)[0, -1])
        raise ValueError(
            f"action kind {kind.name!r} wrote a command for {names[i]} that cannot be flown: give "
            f"a kind of command and finite values; for GO_TO an open index and goes_to=True"
        )


@inlined_kernel
def first_not_finite(asked):
    """Index of the first UAS that was asked for something not finite; -1 if none was."""
    for i in range(asked.shape[0]):
        for k in range(asked.shape[1]):
            if not math.isfinite(asked[i, k]):
                return i
    return -1


@inlined_kernel
def begin_command(tables, learners, scratch, acting, i):
    """A command that is zero, and the values of an action: its numbers in their units."""
    command = scratch.commands[i]
    command.kind = VELOCITY
    command.returning = False
    for k in range(4):
        command.values[k] = 0.0
    for k in range(learners.asked.shape[1]):
        value = learners.asked[i, k]
        if not acting.call[CHOOSES]:
            share = min(max(value, -1.0), 1.0)
            middle = tables.ranges[i, k, MIDDLE]
            reach = tables.ranges[i, k, HIGHEST] - middle
            if share < 0.0:
                reach = middle - tables.ranges[i, k, LOWEST]
            value = middle + share * reach
        scratch.values[i, k] = value


def _written(kinds: Kinds, which: int) -> Any:
    """One kernel that writes the command of one of some kinds, which are numbered from a number."""
    write = kinds[0].write
    if len(kinds) == 1:

        @inlined_kernel
        def write_last(arena, state, tables, learners, kind, i, parameters, values, command):
            write(arena, state, tables, learners, i, parameters, values, command)

        return write_last
    rest = _written(kinds[1:], which + 1)

    @inlined_kernel
    def write_one(arena, state, tables, learners, kind, i, parameters, values, command):
        if kind == which:
            write(arena, state, tables, learners, i, parameters, values, command)
        else:
            rest(arena, state, tables, learners, kind, i, parameters, values, command)

    return write_one


@kernel
def refuse_unflyable(arena, learners, acting, i, command):
    """Brake where an own kind wrote what cannot be flown; the action is then not finite."""
    values = command.values
    flyable = VELOCITY <= command.kind <= CLIMB
    for k in range(4):
        flyable &= math.isfinite(values[k])
    if flyable and command.kind == GO_TO:
        target = values[0]
        exists = target == math.floor(target) and HOME <= target < arena.waypoints.shape[0]
        flyable = exists and acting.call[GOES_TO] != 0
    if not flyable:
        write_brake(command)
        learners.asked[i, 0] = math.nan


@cache
def write_command_with(own: Kinds) -> Any:
    """A kernel that turns the action of a UAS into a command, of which some kinds are part.

    Returns:
        `write_command(arena, state, tables, learners, scratch, acting, i)`: writes the command and
        the values of the action, which is finite; the target is updated by the waypoint action, and
        an action for which a kind of another origin wrote what cannot be flown becomes NaN.
    """
    write = _written(own, 0)

    @inlined_kernel
    def write_command(arena, state, tables, learners, scratch, acting, i):
        which = acting.call[WHICH]
        begin_command(tables, learners, scratch, acting, i)
        values = scratch.values[i]
        command = scratch.commands[i]
        if rarely(which == _OWN):
            if state.uas[i].status == FLYING:
                _write_command(
                    acting.call[ADDRESS], arena, state, tables, learners, i,
                    acting.parameters, values, command,
                )  # fmt: skip
                refuse_unflyable(arena, learners, acting, i, command)
        else:
            write(arena, state, tables, learners, which, i, acting.parameters, values, command)

    return write_command
