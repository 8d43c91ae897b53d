"""One step of many missions, compiled: every lane is flown by `step_learners`, as a single one."""

import math
from typing import NamedTuple

import numpy as np
from numba import njit, prange
from numba.np.ufunc import get_thread_id
from numpy.typing import NDArray

from uas_coverage_env.env.actions import first_not_finite
from uas_coverage_env.env.kernel import (
    ACCEPTED,
    CONTACT_WITH,
    COVERED,
    ENERGY,
    REPORT_SIZE,
    STATUS,
    step_learners,
)
from uas_coverage_env.env.layout import K_WAYPOINTS, OBSERVATION_SIZE
from uas_coverage_env.env.nearest import NO_TARGET, count_company
from uas_coverage_env.env.observation import observe
from uas_coverage_env.env.pool import tables_of
from uas_coverage_env.env.rewards import REWARD_TERMS
from uas_coverage_env.world import FLYING
from uas_coverage_env.world.borrow import borrow
from uas_coverage_env.world.pool import arena_of, begin, state_of

NEXT_STEP, SAME_STEP, DISABLED = range(3)
"""When a mission that has ended begins anew: in the next step, in the same, or never by itself."""

FLY, REST, DRAW = -3, -2, -1
"""What a lane does in the coming step: fly, nothing, or begin a mission that is drawn; a number
from 0 on begins a mission of that scenario."""

ABSENT = -1
"""Status of a UAS that the scenario of a lane does not have."""

N_TERMS = len(REWARD_TERMS)

SWARM_COVERED, SWARM_REWARD = ENERGY + 1, ENERGY + 2
"""Columns of a swarm's report behind the sums of the reward terms and of ENERGY: waypoints covered,
and the sum of all terms."""

SWARM_SIZE = SWARM_REWARD + 1


class Lanes(NamedTuple):
    """All missions, a lane each; the arrays are as large as the largest scenario needs.

    L lanes, U UAS and W waypoints at most. Rows of UAS that a lane's scenario does not have are
    zero, with status ABSENT.
    """

    seed: NDArray[np.uint64]
    """(L,) from which the scenarios are drawn."""
    mission: NDArray[np.int64]
    """(L,) number of the mission since the lane was seeded, from 0 on."""
    scenario: NDArray[np.int64]
    """(L,) index in the pool."""
    orders: NDArray[np.int64]
    """(L,) what it does in the coming step: FLY, or DRAW after an end (NEXT_STEP)."""
    asked: NDArray[np.float64]
    """(L, U, size) actions."""
    targets: NDArray[np.int64]
    """(L, U) see `step_learners`, also the next two."""
    candidates: NDArray[np.int64]
    """(L, U, K_WAYPOINTS)."""
    company: NDArray[np.float64]
    """(L, W, 2)."""
    commands: NDArray[np.void]
    """(threads, U) of the lane that a thread flew last: all lanes share them, so they stay in its
    cache."""
    outcome: NDArray[np.void]
    """(threads, U), likewise."""
    report: NDArray[np.float64]
    """(L, U, REPORT_SIZE)."""
    rewards: NDArray[np.float64]
    """(L, U) of each UAS for the latest step."""
    swarm: NDArray[np.float64]
    """(L, SWARM_SIZE) sums over the UAS, see SWARM_COVERED."""
    terminated: NDArray[np.bool_]
    """(L,) no UAS flies any more."""
    truncated: NDArray[np.bool_]
    """(L,) one still flies after the last step allowed."""
    final_observation: NDArray[np.float32]
    """(L, U, OBSERVATION_SIZE) of the last mission that ended in a lane; SAME_STEP only."""
    final_report: NDArray[np.float64]
    """(L, U, REPORT_SIZE), likewise."""
    final_swarm: NDArray[np.float64]
    """(L, SWARM_SIZE), likewise."""
    final_candidates: NDArray[np.int64]
    """(L, U, K_WAYPOINTS), likewise."""


@njit(cache=True, error_model="numpy")
def _mixed(z):
    """The output function of SplitMix64 (Steele, Lea, Flood 2014): every bit depends on all."""
    z = (z ^ (z >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    z = (z ^ (z >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return z ^ (z >> np.uint64(31))


@njit(cache=True, error_model="numpy")
def drawn(seed, mission, n):
    """Which of n scenarios a mission is flown in: a function of seed and number, with no state.

    Args:
        seed: uint64.
        mission: Number of the mission.
        n: Number of scenarios.
    """
    if n == 1:
        return 0
    counter = np.uint64(mission + 1) * np.uint64(0x9E3779B97F4A7C15)
    return np.int64(_mixed(_mixed(seed) + counter) % np.uint64(n))


@njit(cache=True, error_model="numpy")
def _begin_lane(pool, tables, worlds, lanes, lane, order, observation):
    """Begin a mission in a lane, as `Episode.reset` does for a single one."""
    s = order
    if order == DRAW:
        s = drawn(lanes.seed[lane], lanes.mission[lane] + 1, pool.spans.shape[0])
    arena = arena_of(pool, s)
    n_uas, n_waypoints = arena.uas.shape[0], arena.waypoints.shape[0]
    _, scales, neighbours = tables_of(tables, s)
    state = state_of(worlds, lane, n_uas, n_waypoints)
    company = borrow(lanes.company, lane, (n_waypoints, 2))
    lanes.scenario[lane] = s
    lanes.mission[lane] += 1
    lanes.orders[lane] = FLY
    worlds.status[lane, n_uas:] = ABSENT
    begin(pool, s, state)
    lanes.targets[lane] = NO_TARGET
    lanes.candidates[lane, n_uas:] = -1
    report = lanes.report[lane]
    report[:] = 0.0
    report[:, CONTACT_WITH] = -1.0
    report[:, STATUS] = worlds.status[lane]
    report[:, COVERED] = n_waypoints - state.uncovered.sum()
    swarm = lanes.swarm[lane]
    swarm[:] = 0.0
    swarm[SWARM_COVERED] = report[0, COVERED]
    count_company(state.uncovered, neighbours, company)
    observation[lane, n_uas:] = 0.0
    observe(
        arena, state, scales, company, state.status == FLYING,
        borrow(lanes.targets, lane, (n_uas,)), arena.rules[0].max_steps,
        borrow(lanes.candidates, lane, (n_uas, K_WAYPOINTS)),
        borrow(observation, lane, (n_uas, OBSERVATION_SIZE)),
    )  # fmt: skip


@njit(cache=True, error_model="numpy")
def _settle(worlds, lanes, lane, n_uas, max_steps):
    """Add up what a step has brought, in the order of UAS and terms; says if the mission is over.

    The order matters: sums of floats depend on it, and a lane must equal a single mission.
    """
    report = borrow(lanes.report, lane, (n_uas, REPORT_SIZE))
    rewards = borrow(lanes.rewards, lane, (lanes.rewards.shape[1],))
    swarm = borrow(lanes.swarm, lane, (SWARM_SIZE,))
    flies = False
    for i in range(n_uas):
        flies = flies or worlds.status[lane, i] == FLYING
        reward = 0.0
        for term in range(N_TERMS):
            reward += report[i, term]
        rewards[i] = reward
    for i in range(n_uas, rewards.shape[0]):
        rewards[i] = 0.0
    reward = 0.0
    for column in range(SWARM_COVERED):
        total = 0.0
        for i in range(n_uas):
            total += report[i, column]
        swarm[column] = total
        if column < N_TERMS:
            reward += total
    swarm[SWARM_COVERED] = report[0, COVERED]
    swarm[SWARM_REWARD] = reward
    lanes.terminated[lane] = not flies
    lanes.truncated[lane] = flies and worlds.step[lane, 0] >= max_steps
    return lanes.terminated[lane] or lanes.truncated[lane]


@njit(cache=True, error_model="numpy")
def step_lane(
    pool, tables, worlds, lanes, lane, order, thread, kind, weights, nonlinear, return_mode,
    safety_filter, autoreset, before, observation,
):  # fmt: skip
    """One lane of `step_batch`."""
    if order == REST:
        observation[lane] = before[lane]
        return
    if order != FLY:
        lanes.terminated[lane] = lanes.truncated[lane] = False
        lanes.rewards[lane] = 0.0
        _begin_lane(pool, tables, worlds, lanes, lane, order, observation)
        return
    s = lanes.scenario[lane]
    arena = arena_of(pool, s)
    ranges, scales, neighbours = tables_of(tables, s)
    n_uas, n_waypoints = arena.uas.shape[0], arena.waypoints.shape[0]
    max_steps = arena.rules[0].max_steps
    state = state_of(worlds, lane, n_uas, n_waypoints)
    for i in range(observation.shape[1]):
        # what is not written below: a UAS that did not fly keeps its last observation
        if i >= n_uas:
            for k in range(OBSERVATION_SIZE):
                observation[lane, i, k] = 0.0
        elif state.status[i] != FLYING:
            for k in range(OBSERVATION_SIZE):
                observation[lane, i, k] = before[lane, i, k]
    step_learners(
        arena, state, kind, ranges, scales, neighbours, weights, nonlinear, return_mode,
        safety_filter, borrow(lanes.asked, lane, (n_uas, lanes.asked.shape[2])),
        borrow(lanes.targets, lane, (n_uas,)),
        borrow(lanes.candidates, lane, (n_uas, K_WAYPOINTS)),
        borrow(lanes.company, lane, (n_waypoints, 2)), borrow(lanes.commands, thread, (n_uas,)),
        borrow(lanes.outcome, thread, (n_uas,)), borrow(lanes.report, lane, (n_uas, REPORT_SIZE)),
        max_steps, borrow(observation, lane, (n_uas, OBSERVATION_SIZE)),
    )  # fmt: skip
    over = _settle(worlds, lanes, lane, n_uas, max_steps)
    if over and autoreset == NEXT_STEP:
        lanes.orders[lane] = DRAW
    elif over and autoreset == SAME_STEP:
        lanes.final_observation[lane] = observation[lane]
        lanes.final_report[lane] = lanes.report[lane]
        lanes.final_swarm[lane] = lanes.swarm[lane]
        lanes.final_candidates[lane] = lanes.candidates[lane]
        _begin_lane(pool, tables, worlds, lanes, lane, DRAW, observation)


@njit(cache=True, error_model="numpy")
def _all_finite(numbers):
    finite = True
    for k in range(numbers.shape[0]):
        # no early end: so it is a few vector instructions
        finite &= math.isfinite(numbers[k])
    return finite


@njit(cache=True, error_model="numpy")
def _first_refused(pool, lanes, orders):
    """The first UAS, lane · U + i, whose action is not finite; ACCEPTED where there is none."""
    if _all_finite(lanes.asked.reshape(-1)):
        return ACCEPTED
    for lane in range(lanes.scenario.shape[0]):
        if orders[lane] != FLY:
            continue
        at = pool.spans[lanes.scenario[lane]]
        n_uas = at.uas[1] - at.uas[0]
        i = first_not_finite(borrow(lanes.asked, lane, (n_uas, lanes.asked.shape[2])))
        if i != ACCEPTED:
            return lane * lanes.asked.shape[1] + i
    return ACCEPTED


@njit(cache=True, error_model="numpy")
def step_batch(
    pool, tables, worlds, lanes, orders, kind, weights, nonlinear, return_mode, safety_filter,
    autoreset, before, observation,
):  # fmt: skip
    """Fly all lanes for one step, or begin missions in them.

    One kernel for both: each takes ten seconds to compile.

    Args:
        pool: `ArenaPool`.
        tables: `LearnerTables`.
        worlds: `WorldState` of all lanes; written.
        lanes: `Lanes` with `asked` filled in; written.
        orders: (L,) what each lane does; `lanes.orders`, or an array of its own.
        kind: See `step_learners`, also the next four.
        weights: (R,).
        nonlinear: Whether.
        return_mode: Whether.
        safety_filter: Whether.
        autoreset: NEXT_STEP, SAME_STEP or DISABLED.
        before: (L, U, OBSERVATION_SIZE) float32, the observations of the step before.
        observation: (L, U, OBSERVATION_SIZE) float32, another array; written.

    Returns:
        ACCEPTED, or lane · U + i of the first UAS whose action is not finite; then nothing has
        changed.
    """
    refused = _first_refused(pool, lanes, orders)
    if refused == ACCEPTED:
        for lane in range(lanes.scenario.shape[0]):
            step_lane(
                pool, tables, worlds, lanes, lane, orders[lane], 0, kind, weights, nonlinear,
                return_mode, safety_filter, autoreset, before, observation,
            )  # fmt: skip
    return refused


@njit(cache=True, error_model="numpy", parallel=True)
def step_batch_in_threads(
    pool, tables, worlds, lanes, orders, kind, weights, nonlinear, return_mode, safety_filter,
    autoreset, before, observation,
):  # fmt: skip
    """`step_batch`, the lanes shared among numba's threads.

    A function of its own: to start threads takes longer than to fly a few lanes, and numba's cache
    cannot tell two ways to compile one function apart.
    """
    refused = _first_refused(pool, lanes, orders)
    if refused == ACCEPTED:
        for lane in prange(lanes.scenario.shape[0]):
            step_lane(
                pool, tables, worlds, lanes, lane, orders[lane], get_thread_id(), kind, weights,
                nonlinear, return_mode, safety_filter, autoreset, before, observation,
            )  # fmt: skip
    return refused
