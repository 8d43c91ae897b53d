"""One step of many missions, compiled: every lane is flown by `step_learners`, as a single one."""

import math
from typing import NamedTuple

import numpy as np
from numba import prange
from numba.np.ufunc import get_thread_id
from numpy.typing import NDArray

from uas_coverage_env.borrow import borrow
from uas_coverage_env.env.actions import first_not_finite
from uas_coverage_env.env.kernel import (
    ACCEPTED,
    CONTACT_WITH,
    COVERED,
    ENERGY,
    REPORT_SIZE,
    REWARD,
    STATUS,
    step_learners,
)
from uas_coverage_env.env.layout import K_WAYPOINTS, OBSERVATION_SIZE
from uas_coverage_env.env.nearest import NO_TARGET
from uas_coverage_env.env.pool import first_look_of, tables_of
from uas_coverage_env.env.rewards import REWARD_TERMS
from uas_coverage_env.kernels import allocating_kernel, inlined_kernel, kernel
from uas_coverage_env.world import FLYING
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
    company: NDArray[np.float32]
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
    settled: NDArray[np.bool_]
    """(L, U) it does not fly, and what it saw last lies in both arrays of observations."""
    final_observation: NDArray[np.float32]
    """(L, U, OBSERVATION_SIZE) of the last mission that ended in a lane; SAME_STEP only."""
    final_report: NDArray[np.float64]
    """(L, U, REPORT_SIZE), likewise."""
    final_swarm: NDArray[np.float64]
    """(L, SWARM_SIZE), likewise."""
    final_candidates: NDArray[np.int64]
    """(L, U, K_WAYPOINTS), likewise."""


@kernel
def _mixed(z):
    """The output function of SplitMix64 (Steele, Lea, Flood 2014): every bit depends on all."""
    z = (z ^ (z >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    z = (z ^ (z >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return z ^ (z >> np.uint64(31))


@kernel
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


@kernel
def _copy(source, target):
    """Copy the rows of an array into another of the same shape."""
    for i in range(target.shape[0]):
        for k in range(target.shape[1]):
            target[i, k] = source[i, k]


@inlined_kernel
def _begin_lane(pool, tables, worlds, lanes, lane, order, observation):
    """Begin a mission in a lane, as `Episode.reset` does for a single one."""
    s = order
    if order == DRAW:
        s = drawn(lanes.seed[lane], lanes.mission[lane] + 1, pool.spans.shape[0])
    candidates, company, seen = first_look_of(tables, s)
    n_uas, n_waypoints = candidates.shape[0], company.shape[0]
    state = state_of(worlds, lane, n_uas, n_waypoints)
    begin(pool, s, state)
    lanes.scenario[lane] = s
    lanes.mission[lane] += 1
    lanes.orders[lane] = FLY
    n_covered = 0
    for w in range(n_waypoints):
        n_covered += not state.uncovered[w]
    for i in range(lanes.report.shape[1]):
        if i >= n_uas:
            worlds.status[lane, i] = ABSENT
            for k in range(K_WAYPOINTS):
                lanes.candidates[lane, i, k] = -1
            for k in range(OBSERVATION_SIZE):
                observation[lane, i, k] = 0.0
        lanes.targets[lane, i] = NO_TARGET
        lanes.settled[lane, i] = False
        for column in range(REPORT_SIZE):
            lanes.report[lane, i, column] = 0.0
        lanes.report[lane, i, CONTACT_WITH] = -1.0
        lanes.report[lane, i, STATUS] = worlds.status[lane, i]
        lanes.report[lane, i, COVERED] = n_covered
    for column in range(SWARM_SIZE):
        lanes.swarm[lane, column] = 0.0
    lanes.swarm[lane, SWARM_COVERED] = n_covered
    _copy(candidates, borrow(lanes.candidates, lane, candidates.shape))
    _copy(company, borrow(lanes.company, lane, company.shape))
    _copy(seen, borrow(observation, lane, seen.shape))


@inlined_kernel
def _settle(worlds, lanes, lane, n_uas, max_steps):
    """Add up what a step has brought, in the order of UAS and terms; says if the mission is over.

    The order matters: sums of floats depend on it, and a lane must equal a single mission.
    """
    report = borrow(lanes.report, lane, (n_uas, REPORT_SIZE))
    flies = False
    for i in range(lanes.rewards.shape[1]):
        lanes.rewards[lane, i] = 0.0
        if i < n_uas:
            flies |= worlds.status[lane, i] == FLYING
            lanes.rewards[lane, i] = report[i, REWARD]
    swarm = borrow(lanes.swarm, lane, (SWARM_SIZE,))
    for column in range(SWARM_COVERED):
        swarm[column] = 0.0
    for i in range(n_uas):
        for column in range(SWARM_COVERED):
            swarm[column] += report[i, column]
    reward = 0.0
    for term in range(N_TERMS):
        reward += swarm[term]
    swarm[SWARM_COVERED] = report[0, COVERED]
    swarm[SWARM_REWARD] = reward
    lanes.terminated[lane] = not flies
    lanes.truncated[lane] = flies and worlds.step[lane, 0] >= max_steps
    return lanes.terminated[lane] or lanes.truncated[lane]


@inlined_kernel
def _keep_last_looks(worlds, lanes, lane, n_uas, before, observation):
    """What a UAS that does not fly has seen last stays its observation.

    Two arrays take turns: once it lies in both, nothing has to be copied any more.
    """
    for i in range(observation.shape[1]):
        flies = i < n_uas and worlds.status[lane, i] == FLYING
        if not flies and not lanes.settled[lane, i]:
            for k in range(OBSERVATION_SIZE):
                observation[lane, i, k] = before[lane, i, k]
        lanes.settled[lane, i] = not flies


@inlined_kernel
def step_lane(
    pool, tables, worlds, lanes, lane, order, thread, kind, weights, nonlinear, assistants,
    autoreset, before, observation,
):  # fmt: skip
    """One lane of `step_batch`."""
    whole = (observation.shape[1], OBSERVATION_SIZE)
    if order == REST:
        _copy(borrow(before, lane, whole), borrow(observation, lane, whole))
        return
    begins = order != FLY
    if begins:
        lanes.terminated[lane] = False
        lanes.truncated[lane] = False
        for i in range(lanes.rewards.shape[1]):
            lanes.rewards[lane, i] = 0.0
    else:
        s = lanes.scenario[lane]
        arena = arena_of(pool, s)
        ranges, scales, neighbours = tables_of(tables, s)
        n_uas, n_waypoints = arena.uas.shape[0], arena.waypoints.shape[0]
        max_steps = arena.rules[0].max_steps
        state = state_of(worlds, lane, n_uas, n_waypoints)
        _keep_last_looks(worlds, lanes, lane, n_uas, before, observation)
        step_learners(
            arena, state, kind, ranges, scales, neighbours, weights, nonlinear, assistants,
            borrow(lanes.asked, lane, (n_uas, lanes.asked.shape[2])),
            borrow(lanes.targets, lane, (n_uas,)),
            borrow(lanes.candidates, lane, (n_uas, K_WAYPOINTS)),
            borrow(lanes.company, lane, (n_waypoints, 2)),
            borrow(lanes.commands, thread, (n_uas,)), borrow(lanes.outcome, thread, (n_uas,)),
            borrow(lanes.report, lane, (n_uas, REPORT_SIZE)), max_steps,
            borrow(observation, lane, (n_uas, OBSERVATION_SIZE)),
        )  # fmt: skip
        over = _settle(worlds, lanes, lane, n_uas, max_steps)
        if over and autoreset == NEXT_STEP:
            lanes.orders[lane] = DRAW
        elif over and autoreset == SAME_STEP:
            _copy(borrow(observation, lane, whole), borrow(lanes.final_observation, lane, whole))
            _copy(lanes.report[lane], lanes.final_report[lane])
            _copy(lanes.candidates[lane], lanes.final_candidates[lane])
            for column in range(SWARM_SIZE):
                lanes.final_swarm[lane, column] = lanes.swarm[lane, column]
            begins = True
            order = DRAW
    if begins:
        _begin_lane(pool, tables, worlds, lanes, lane, order, observation)


@kernel
def _all_finite(numbers):
    finite = True
    for k in range(numbers.shape[0]):
        # no early end: so it is a few vector instructions
        finite &= math.isfinite(numbers[k])
    return finite


@kernel
def _first_refused(pool, lanes, orders):
    """The first UAS, lane · U + i, whose action is not finite; ACCEPTED where there is none."""
    if _all_finite(borrow(lanes.asked, 0, (lanes.asked.size,))):
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


@kernel
def step_batch(
    pool, tables, worlds, lanes, orders, kind, weights, nonlinear, assistants, autoreset,
    before, observation,
):  # fmt: skip
    """Fly all lanes for one step, or begin missions in them.

    One kernel for both: each takes ten seconds to compile.

    Args:
        pool: `ArenaPool`.
        tables: `LearnerTables`.
        worlds: `WorldState` of all lanes; written.
        lanes: `Lanes` with `asked` filled in; written.
        orders: (L,) what each lane does; `lanes.orders`, or an array of its own.
        kind: See `step_learners`, also the next three.
        weights: (R,).
        nonlinear: Whether.
        assistants: Who helps to fly.
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
                assistants, autoreset, before, observation,
            )  # fmt: skip
    return refused


@allocating_kernel(parallel=True)
def step_batch_in_threads(
    pool, tables, worlds, lanes, orders, kind, weights, nonlinear, assistants, autoreset,
    before, observation,
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
                nonlinear, assistants, autoreset, before, observation,
            )  # fmt: skip
    return refused
