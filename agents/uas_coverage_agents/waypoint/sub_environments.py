"""Many teams side by side: in every lane one team flies one scenario of a pool, again and again."""

from collections.abc import Sequence
from typing import Annotated, NamedTuple

import numpy as np
from numba import prange
from numpy.typing import NDArray

from uas_coverage_agents.waypoint.layout import OBSERVATION_SIZE, K
from uas_coverage_agents.waypoint.legs import LEGS, legs_of
from uas_coverage_agents.waypoint.observation import NO_TARGET
from uas_coverage_agents.waypoint.team import (
    ACCOUNT_SIZE,
    NO_UAS,
    Choices,
    choose,
    flight_code,
    fly_on_by,
)
from uas_coverage_env.compiled.kernels import allocating_kernel
from uas_coverage_env.compiled.memory import Memory, Pool, Values
from uas_coverage_env.compiled.views import Handover, copy_arrays, pool_view
from uas_coverage_env.entities.commands import COMMAND_DTYPE
from uas_coverage_env.entities.outcome import OUTCOME_DTYPE
from uas_coverage_env.scenario import Scenario, load_scenario
from uas_coverage_env.simulation.pool import (
    WorldPool,
    arena_of,
    lanes_of,
    pool_worlds,
    start_of,
    state_of,
)
from uas_coverage_env.vehicle.layout import DOD
from uas_coverage_env.world import WorldState, build_arena
from uas_coverage_env.world.arena import ARENA

legs_at = pool_view(LEGS)
"""In a kernel, (pool, s) -> the legs of scenario s."""


def pool_legs(scenarios: Sequence[Scenario]) -> Pool:
    """The legs of scenarios, in their order."""
    return LEGS.pool([legs_of(build_arena(scenario)) for scenario in scenarios])


class WaypointSubEnvironments(NamedTuple):
    """What L lanes need besides the world."""

    scenario: Annotated[NDArray[np.int64], "L", Values(0, "S")]
    """Index in the pool."""
    decider: Annotated[NDArray[np.int64], "L", Values(NO_UAS, "U")]
    """UAS that decides, NO_UAS where the mission is over."""
    targets: Annotated[NDArray[np.int64], "L", "U", Values(NO_TARGET, "W")]
    blocked: Annotated[NDArray[np.bool_], "L", "W"]
    commands: Annotated[NDArray[np.void], COMMAND_DTYPE, "L", "U"]
    outcome: Annotated[NDArray[np.void], OUTCOME_DTYPE, "L", "U"]
    candidates: Annotated[NDArray[np.int64], "L", K, Values(-1, "W")]
    legal: Annotated[NDArray[np.bool_], "L", K + 1]
    observation: Annotated[NDArray[np.float32], "L", OBSERVATION_SIZE]
    account: Annotated[NDArray[np.float64], "L", ACCOUNT_SIZE]
    """Of the mission so far."""


LANES = Memory(WaypointSubEnvironments)


def make_lanes(n_lanes: int, pool: WorldPool) -> tuple[WaypointSubEnvironments, WorldState]:
    """Lanes that fly any scenario of a pool; nothing has begun."""
    lanes = LANES.zeros({**ARENA.largest(pool.arenas), "L": n_lanes})
    lanes.decider[:] = NO_UAS
    lanes.targets[:] = NO_TARGET
    lanes.candidates[:] = -1
    return lanes, lanes_of(n_lanes, pool.starts)


@allocating_kernel
def _fly_lane(worlds, all_legs, lanes, states, lane, return_mode, assistants, flight):
    s = lanes.scenario[lane]
    arena = arena_of(worlds.arenas, s)
    n_uas = arena.uas.shape[0]
    n_waypoints = arena.waypoints.shape[0]
    state = state_of(states, lane, worlds.arenas, s)
    legs = legs_at(all_legs, s)
    choices = Choices(lanes.candidates[lane], lanes.legal[lane], lanes.observation[lane])
    lanes.decider[lane] = fly_on_by(
        flight, arena, legs, state, return_mode, assistants, lanes.blocked[lane, :n_waypoints],
        lanes.targets[lane, :n_uas], lanes.commands[lane, :n_uas], lanes.outcome[lane, :n_uas],
        choices, lanes.account[lane],
    )  # fmt: skip


@allocating_kernel
def begin_lane(
    worlds, all_legs, lanes, states, lane, s, covered, discharged, return_mode, assistants, flight
):
    """Begin a mission in a lane and fly to its first decision.

    Args:
        worlds: `WorldPool`.
        all_legs: Of `pool_legs`.
        lanes: `WaypointSubEnvironments`; written.
        states: `lanes_of` the pool; written.
        lane: Which lane.
        s: Index of the scenario.
        covered: (most waypoints,) that are covered already.
        discharged: (most UAS,) depth of discharge in addition to the scenario's.
        return_mode: Whether the world brings UAS home in time.
        assistants: See `world.advance`.
        flight: The `team.flight_code` that flies it.
    """
    state = state_of(states, lane, worlds.arenas, s)
    copy_arrays(start_of(worlds.starts, s), state)
    for w in range(state.uncovered.shape[0]):
        state.uncovered[w] = state.uncovered[w] and not covered[w]
    for i in range(state.uas.shape[0]):
        state.x[i, DOD] += discharged[i]
    lanes.scenario[lane] = s
    lanes.targets[lane] = NO_TARGET
    lanes.blocked[lane] = False
    lanes.account[lane] = 0.0
    _fly_lane(worlds, all_legs, lanes, states, lane, return_mode, assistants, flight)


class _Given(NamedTuple):
    """What the lanes are given, in one piece."""

    worlds: WorldPool
    legs: Pool
    lanes: WaypointSubEnvironments
    states: WorldState


def _example() -> _Given:
    scenarios = [load_scenario("open_field")]
    worlds = pool_worlds(scenarios)
    return _Given(worlds, pool_legs(scenarios), *make_lanes(1, worlds))


_HANDOVER = Handover(_example)
_keep, _take = _HANDOVER.keep, _HANDOVER.take


@allocating_kernel(parallel=True)
def _begin_lanes(
    worlds, all_legs, lanes, states, which, s, covered, discharged, return_mode, assistants, flight
):
    kept = _keep(_Given(worlds, all_legs, lanes, states))
    for k in prange(which.shape[0]):
        given = _take(kept)
        begin_lane(
            given.worlds, given.legs, given.lanes, given.states, which[k], s[k], covered[k],
            discharged[k], return_mode, assistants, flight,
        )  # fmt: skip


def begin_lanes(
    worlds, all_legs, lanes, states, which, s, covered, discharged, return_mode, assistants
):
    """`begin_lane` in some lanes; `which`, `s`, `covered` and `discharged` have a row for each."""
    _begin_lanes(
        worlds, all_legs, lanes, states, which, s, covered, discharged, return_mode, assistants,
        flight_code(),
    )  # fmt: skip


@allocating_kernel(parallel=True)
def _step_lanes(worlds, all_legs, lanes, states, choices, return_mode, assistants, flight):
    kept = _keep(_Given(worlds, all_legs, lanes, states))
    for lane in prange(choices.shape[0]):
        given = _take(kept)
        i = given.lanes.decider[lane]
        if i != NO_UAS:
            choose(given.lanes.targets[lane], given.lanes.candidates[lane], i, choices[lane])
            _fly_lane(
                given.worlds, given.legs, given.lanes, given.states, lane, return_mode, assistants,
                flight,
            )  # fmt: skip


def step_lanes(worlds, all_legs, lanes, states, choices, return_mode, assistants):
    """Let the UAS whose turn it is decide, and fly on to the next decision, in every lane.

    Lanes whose missions are over stay as they are.

    Args:
        worlds: `WorldPool`.
        all_legs: Of `pool_legs`.
        lanes: `WaypointSubEnvironments`; written.
        states: `lanes_of` the pool; written.
        choices: (L,) legal choices.
        return_mode: Whether the world brings UAS home in time.
        assistants: See `world.advance`.
    """
    _step_lanes(worlds, all_legs, lanes, states, choices, return_mode, assistants, flight_code())
