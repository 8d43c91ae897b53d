"""A team between decisions: which UAS needs a target, and the flight until one does."""

from functools import cache
from typing import NamedTuple

import numpy as np
from numba import typeof, types
from numpy.typing import NDArray

from uas_coverage_agents.waypoint.layout import HOME_CHOICE
from uas_coverage_agents.waypoint.legs import LEGS
from uas_coverage_agents.waypoint.observation import (
    NO_TARGET,
    allowed,
    claimed_by_mates,
    covers,
    observe,
)
from uas_coverage_env.autopilot.return_mode import has_to_return
from uas_coverage_env.compiled.calls import Signature
from uas_coverage_env.compiled.kernels import allocating_kernel
from uas_coverage_env.entities.commands import COMMAND_DTYPE, GO_TO, HOME, VELOCITY
from uas_coverage_env.entities.outcome import OUTCOME_DTYPE
from uas_coverage_env.entities.state import FLYING, STATE
from uas_coverage_env.mission.blocked import find_blocked
from uas_coverage_env.simulation.step import advance
from uas_coverage_env.vehicle.layout import Z
from uas_coverage_env.world.arena import ARENA

NO_UAS = -1

ENERGY, TIME, FILTERED, LOST_UAS, NOT_HOME, LEFT = range(6)
"""Columns of an account: energy of all [Wh], time while any UAS flew [s], steps of single UAS in
which the filter changed the command; at the end: UAS lost, UAS in the air, waypoints left."""

ACCOUNT_SIZE = LEFT + 1


class Choices(NamedTuple):
    """What the UAS that decides may choose, and what it sees; see `observe`."""

    candidates: NDArray[np.int64]
    """(K,)."""
    legal: NDArray[np.bool_]
    """(K+1,)."""
    observation: NDArray[np.float32]
    """(OBSERVATION_SIZE,)."""


@allocating_kernel
def _needs_target(state, blocked, claimed, may, targets, i):
    """Whether a covering UAS has none, or waits for a moving obstacle while there is other work."""
    w = targets[i]
    if w < 0 or not state.uncovered[w]:
        return True
    if not blocked[w]:
        return False
    claimed_by_mates(state, targets, i, claimed)
    allowed(state, blocked, claimed, may)
    return (may & ~blocked).any()


@allocating_kernel
def choose(targets, candidates, i, choice):
    """Note the choice of UAS i."""
    targets[i] = HOME if choice == HOME_CHOICE else candidates[choice]


@allocating_kernel
def next_to_decide(arena, legs, state, return_mode, blocked, targets, choices):
    """The first UAS that has a choice to make now; the others keep or get their targets.

    Args:
        arena: The arena. Where it has no moving obstacles, `blocked` stays as it is.
        legs: `Legs`.
        state: The state of the world; `returning` is set a moment before the world would.
        return_mode: Whether the world brings UAS home in time.
        blocked: (W,) see `find_blocked`; written.
        targets: (U,) where each flies to; written.
        choices: `Choices`; written.

    Returns:
        Index of the UAS, or NO_UAS.
    """
    if arena.moving.shape[0] > 0:
        find_blocked(arena, state.step[0], 0.0, 0.0, 0.0, blocked)
    n_uas = targets.shape[0]
    for i in range(n_uas):
        if state.uas[i].status == FLYING and return_mode and not state.uas[i].returning:
            state.uas[i].returning = has_to_return(arena, state, i)
    done = not state.uncovered.any()
    claimed = np.empty(blocked.shape[0], dtype=np.bool_)
    may = np.empty(blocked.shape[0], dtype=np.bool_)
    for i in range(n_uas):
        if not covers(state, targets, i):
            continue
        if done:
            targets[i] = HOME
        elif _needs_target(state, blocked, claimed, may, targets, i):
            targets[i] = NO_TARGET
            candidates, legal, row = choices
            if observe(arena, legs, state, blocked, targets, i, candidates, legal, row) > 1:
                return i
            choose(targets, candidates, i, legal.argmax())
    return NO_UAS


@allocating_kernel
def write_commands(state, targets, commands):
    """The commands that fly every UAS to its target."""
    for i in range(targets.shape[0]):
        command = commands[i]
        command.values[:] = 0.0
        command.returning = targets[i] == HOME
        if targets[i] == NO_TARGET:  # on its way home already, or nothing to fly
            command.kind = VELOCITY
            command.values[2] = -state.x[i, Z]
        else:
            command.kind = GO_TO
            command.values[0] = targets[i]


@allocating_kernel
def is_over(arena, state):
    """Whether no UAS is flying, or the time is up."""
    return state.step[0] >= arena.rules[0].max_steps or not (state.uas["status"] == FLYING).any()


@allocating_kernel
def fly_on(
    arena, legs, state, return_mode, assistants, blocked, targets, commands, outcome, choices,
    account,
):  # fmt: skip
    """Fly by the LPV model until a UAS has a choice to make, or the mission is over.

    Args:
        arena: See `next_to_decide`.
        legs: See `next_to_decide`.
        state: Written.
        return_mode: Whether the world brings UAS home in time.
        assistants: See `world.advance`.
        blocked: See `next_to_decide`.
        targets: See `next_to_decide`.
        commands: (U,) of COMMAND_DTYPE; written.
        outcome: (U,) of OUTCOME_DTYPE; written.
        choices: See `next_to_decide`.
        account: (ACCOUNT_SIZE,) what the flight took is added.

    Returns:
        Index of the UAS that decides, or NO_UAS where the mission is over.
    """
    while not is_over(arena, state):
        i = next_to_decide(arena, legs, state, return_mode, blocked, targets, choices)
        if i != NO_UAS:
            return i
        write_commands(state, targets, commands)
        advance(arena, state, commands, False, assistants, None, outcome)
        account[TIME] += arena.rules[0].dt_s
        for j in range(targets.shape[0]):
            account[ENERGY] += outcome[j].energy_Wh
            account[FILTERED] += outcome[j].filtered
            account[LOST_UAS] += outcome[j].contact != 0
    account[NOT_HOME] = (state.uas["status"] == FLYING).sum()
    account[LEFT] = state.uncovered.sum()
    return NO_UAS


@cache
def _types() -> tuple[types.Type, ...]:
    """Of the arguments of `fly_on`."""
    whole, flags = np.empty(0, np.int64), np.empty(0, np.bool_)
    choices = Choices(whole, flags, np.empty(0, np.float32))
    arrays = (flags, whole, np.empty(0, COMMAND_DTYPE), np.empty(0, OUTCOME_DTYPE), choices)
    return (
        ARENA.numba_type(), LEGS.numba_type(), STATE.numba_type(), types.boolean, typeof(whole),
        *map(typeof, arrays), typeof(np.empty(0)),
    )  # fmt: skip


_SIGNATURE = Signature(
    "arena legs state return_mode assistants blocked targets commands outcome choices account",
    _types,
    types.int64,
)

fly_on_by = _SIGNATURE.call
"""In a kernel, (flight_code(), *arguments): `fly_on`, which is more code than all that calls it,
and so is compiled once, by itself."""


@cache
def flight_code() -> int:
    """Compile `fly_on`, or load it from the cache.

    Returns:
        Its address, for one process.
    """
    return _SIGNATURE.address_of(fly_on)
