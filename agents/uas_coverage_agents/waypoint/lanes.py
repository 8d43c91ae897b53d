"""Many teams side by side: in every lane one team flies one scenario of a pool, again and again."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numba import prange
from numpy.typing import NDArray

from uas_coverage_agents.waypoint.layout import OBSERVATION_SIZE, K
from uas_coverage_agents.waypoint.legs import Legs, legs_of
from uas_coverage_agents.waypoint.look import NO_TARGET
from uas_coverage_agents.waypoint.team import (
    ACCOUNT_SIZE,
    NOBODY,
    choose,
    fly_on,
)
from uas_coverage_env.kernels import allocating_kernel
from uas_coverage_env.scenario import Scenario
from uas_coverage_env.vehicle import DOD
from uas_coverage_env.world import COMMAND_DTYPE, OUTCOME_DTYPE, WorldState, build_arena
from uas_coverage_env.world.pool import ArenaPool, arena_of, begin, lanes_of, state_of


class LegsPool(NamedTuple):
    """The legs of the scenarios of a pool, end to end and flat."""

    between_s: NDArray[np.float64]
    home_s: NDArray[np.float64]
    return_s: NDArray[np.float64]
    unit: NDArray[np.float64]
    """(S, 2)."""
    first: NDArray[np.int64]
    """(S+1, 2) where the legs of a scenario begin, between waypoints and home."""


def pool_legs(scenarios: Sequence[Scenario]) -> LegsPool:
    """The legs of scenarios, in their order."""
    legs = [legs_of(build_arena(scenario)) for scenario in scenarios]
    sizes = np.array([(0, 0), *((each.between_s.size, each.home_s.size) for each in legs)])
    return LegsPool(
        between_s=np.concatenate([each.between_s.ravel() for each in legs]),
        home_s=np.concatenate([each.home_s.ravel() for each in legs]),
        return_s=np.concatenate([each.return_s.ravel() for each in legs]),
        unit=np.stack([each.unit for each in legs]),
        first=sizes.cumsum(axis=0),
    )


@allocating_kernel
def legs_at(pool, s, n_uas, n_waypoints):
    """The legs of scenario s: views into the arrays of the pool."""
    a = pool.first[s]
    b = pool.first[s + 1]
    return Legs(
        pool.between_s[a[0] : b[0]].reshape((n_waypoints, n_waypoints)),
        pool.home_s[a[1] : b[1]].reshape((n_uas, n_waypoints)),
        pool.return_s[a[1] : b[1]].reshape((n_uas, n_waypoints)),
        pool.unit[s],
    )


class Lanes(NamedTuple):
    """What the lanes need besides the world; the first axis is the lane."""

    scenario: NDArray[np.int64]
    """(L,) index in the pool."""
    decider: NDArray[np.int64]
    """(L,) UAS that decides, NOBODY where the mission is over."""
    targets: NDArray[np.int64]
    """(L, U)."""
    blocked: NDArray[np.bool_]
    """(L, W)."""
    commands: NDArray[np.void]
    """(L, U)."""
    outcome: NDArray[np.void]
    """(L, U)."""
    candidates: NDArray[np.int64]
    """(L, K)."""
    legal: NDArray[np.bool_]
    """(L, K+1)."""
    observation: NDArray[np.float32]
    """(L, OBSERVATION_SIZE)."""
    account: NDArray[np.float64]
    """(L, ACCOUNT_SIZE) of the mission so far."""


def make_lanes(n_lanes: int, pool: ArenaPool) -> tuple[Lanes, WorldState]:
    """Lanes that fly any scenario of a pool; nothing has begun."""
    states = lanes_of(n_lanes, pool)
    n_uas, n_waypoints = states.status.shape[1], states.uncovered.shape[1]
    return Lanes(
        scenario=np.zeros(n_lanes, dtype=np.int64),
        decider=np.full(n_lanes, NOBODY),
        targets=np.full((n_lanes, n_uas), NO_TARGET),
        blocked=np.zeros((n_lanes, n_waypoints), dtype=np.bool_),
        commands=np.zeros((n_lanes, n_uas), dtype=COMMAND_DTYPE),
        outcome=np.zeros((n_lanes, n_uas), dtype=OUTCOME_DTYPE),
        candidates=np.full((n_lanes, K), -1),
        legal=np.zeros((n_lanes, K + 1), dtype=np.bool_),
        observation=np.zeros((n_lanes, OBSERVATION_SIZE), dtype=np.float32),
        account=np.zeros((n_lanes, ACCOUNT_SIZE)),
    ), states


@allocating_kernel
def _fly_lane(arenas, all_legs, lanes, states, lane, return_mode, assistants):
    s = lanes.scenario[lane]
    arena = arena_of(arenas, s)
    n_uas = arena.uas.shape[0]
    n_waypoints = arena.waypoints.shape[0]
    state = state_of(states, lane, n_uas, n_waypoints)
    legs = legs_at(all_legs, s, n_uas, n_waypoints)
    lanes.decider[lane] = fly_on(
        arena, legs, state, False, return_mode, assistants, lanes.blocked[lane, :n_waypoints],
        lanes.targets[lane, :n_uas], lanes.commands[lane, :n_uas], lanes.outcome[lane, :n_uas],
        lanes.candidates[lane], lanes.legal[lane], lanes.observation[lane], lanes.account[lane],
    )  # fmt: skip


@allocating_kernel
def begin_lane(
    arenas, all_legs, lanes, states, lane, s, covered, discharged, return_mode, assistants
):
    """Begin a mission in a lane and fly to its first decision.

    Args:
        arenas: `ArenaPool`.
        all_legs: `LegsPool`.
        lanes: `Lanes`; written.
        states: `lanes_of` the pool; written.
        lane: Which lane.
        s: Index of the scenario.
        covered: (most waypoints,) that are covered already.
        discharged: (most UAS,) depth of discharge in addition to the scenario's.
        return_mode: Whether the world brings UAS home in time.
        assistants: See `world.advance`.
    """
    at = arenas.spans[s]
    n_uas = at.uas[1] - at.uas[0]
    n_waypoints = at.waypoints[1] - at.waypoints[0]
    state = state_of(states, lane, n_uas, n_waypoints)
    begin(arenas, s, state)
    for w in range(n_waypoints):
        state.uncovered[w] = state.uncovered[w] and not covered[w]
    for i in range(n_uas):
        state.x[i, DOD] += discharged[i]
    lanes.scenario[lane] = s
    lanes.targets[lane] = NO_TARGET
    lanes.blocked[lane] = False
    lanes.account[lane] = 0.0
    _fly_lane(arenas, all_legs, lanes, states, lane, return_mode, assistants)


@allocating_kernel(parallel=True)
def begin_lanes(
    arenas, all_legs, lanes, states, which, s, covered, discharged, return_mode, assistants
):
    """`begin_lane` in some lanes; `which`, `s`, `covered` and `discharged` have a row for each."""
    for k in prange(which.shape[0]):
        begin_lane(
            arenas, all_legs, lanes, states, which[k], s[k], covered[k], discharged[k],
            return_mode, assistants,
        )  # fmt: skip


@allocating_kernel(parallel=True)
def step_lanes(arenas, all_legs, lanes, states, choices, return_mode, assistants):
    """Let the UAS whose turn it is decide, and fly on to the next decision, in every lane.

    Lanes whose missions are over stay as they are.

    Args:
        arenas: `ArenaPool`.
        all_legs: `LegsPool`.
        lanes: `Lanes`; written.
        states: `lanes_of` the pool; written.
        choices: (L,) legal choices.
        return_mode: Whether the world brings UAS home in time.
        assistants: See `world.advance`.
    """
    for lane in prange(choices.shape[0]):
        i = lanes.decider[lane]
        if i != NOBODY:
            choose(lanes.targets[lane], lanes.candidates[lane], i, choices[lane])
            _fly_lane(arenas, all_legs, lanes, states, lane, return_mode, assistants)
