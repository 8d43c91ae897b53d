"""One step of many missions, compiled: every lane is flown by `step_learners`, as a single one."""

import math
from functools import cache
from typing import Any, NamedTuple

import numpy as np
from numba import get_thread_id, prange, types

from uas_coverage_env.compiled.calls import Signature
from uas_coverage_env.compiled.kernels import (
    allocating_kernel,
    inlined_kernel,
    kernel,
    prefetch,
    rare_kernel,
    rarely,
)
from uas_coverage_env.compiled.random import counted
from uas_coverage_env.compiled.views import Handover, copy_arrays, lane_view, rows_view
from uas_coverage_env.entities.state import ABSENT, FLYING, SWAPPING
from uas_coverage_env.env.batch.memory import (
    DRAW,
    FLY,
    NEXT_STEP,
    REST,
    SAME_STEP,
    SWARM_COVERED,
    SWARM_ENERGY,
    SWARM_FIRST_TERM,
    SWARM_REWARD,
    WAITS,
    Missions,
    new_missions,
)
from uas_coverage_env.env.batch.pool import (
    MissionPool,
    ScenarioPool,
    first_learners_at,
    first_observation_at,
    learners_of,
    tables_at,
)
from uas_coverage_env.env.episode.act import acting_of, first_not_finite
from uas_coverage_env.env.episode.memory import SCRATCH
from uas_coverage_env.env.episode.observe import observing_of
from uas_coverage_env.env.episode.pay import paying_of
from uas_coverage_env.env.episode.step import ACCEPTED, Rules, step_learners_with
from uas_coverage_env.env.observation import K_WAYPOINTS
from uas_coverage_env.env.observation.nearest import NO_TARGET
from uas_coverage_env.env.report import (
    CONTACT_WITH,
    COVERED,
    ENERGY,
    FIRST_TERM,
    REPORT_SIZE,
    REWARD,
    STATUS,
)
from uas_coverage_env.env.versions import V0, Version
from uas_coverage_env.simulation.points import begin_features
from uas_coverage_env.simulation.pool import arena_of, start_of, state_of
from uas_coverage_env.world.arena import ARENA
from uas_coverage_env.world.events import begin_events

_scratch_of = lane_view(SCRATCH, sized_by=ARENA)


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
    return np.int64(counted(seed, mission) % np.uint64(n))


@kernel
def _copy(source, target):
    """Copy the rows of an array into another of the same shape."""
    for i in range(target.shape[0]):
        for k in range(target.shape[1]):
            target[i, k] = source[i, k]


@rare_kernel
def _begin_lane(pool, missions, code, lane, order, observation, width):
    """Begin a mission in a lane, as `Episode.reset` does for a single one."""
    lanes = missions.lanes
    s = order
    if order == DRAW:
        s = drawn(lanes.seed[lane], lanes.mission[lane] + 1, pool.starts.sizes.shape[0])
    lanes.scenario[lane] = s
    lanes.scene[lane] = s
    for k in range(lanes.changes.shape[1]):
        lanes.changes[lane, k] = -1
    lanes.mission[lane] += 1
    lanes.orders[lane] = FLY
    state = state_of(missions.worlds, lane, pool.arenas, s)
    copy_arrays(start_of(pool.starts, s), state)
    arena = arena_of(pool.arenas, s)
    begin_events(arena, state, lanes.seed[lane], lanes.mission[lane])
    begin_features(arena, state, code, lanes.seed[lane], lanes.mission[lane])
    first = first_learners_at(pool.learners, s)
    copy_arrays(first, learners_of(missions.learners, lane, pool.arenas, s))
    n_uas = first.report.shape[0]
    n_covered = first.report[0, COVERED]
    seen = first_observation_at(pool.first_observations, s).observation
    _copy(seen, rows_view(observation, lane, seen.shape))
    report = missions.learners.report
    for i in range(n_uas, report.shape[1]):
        missions.worlds.uas[lane, i].status = ABSENT
        missions.learners.targets[lane, i] = NO_TARGET
        for k in range(K_WAYPOINTS):
            missions.learners.candidates[lane, i, k] = -1
        for k in range(width):
            observation[lane, i, k] = 0.0
        for column in range(REPORT_SIZE):
            report[lane, i, column] = 0
        report[lane, i, CONTACT_WITH] = -1
        report[lane, i, STATUS] = ABSENT
        report[lane, i, COVERED] = n_covered
    for i in range(report.shape[1]):
        missions.settled[lane, i] = False
    for column in range(lanes.swarm.shape[1]):
        lanes.swarm[lane, column] = 0.0
    lanes.swarm[lane, SWARM_COVERED] = n_covered


@inlined_kernel
def _add_up(worlds, lanes, learners, lane, max_steps):
    """Add up what a step has brought, in the order of UAS and terms; says if the mission is over.

    The order matters: sums of floats depend on it, and a lane must equal a single mission.
    """
    report, amounts = learners.report, learners.amounts
    n_uas = report.shape[0]
    flies = False
    for i in range(lanes.rewards.shape[1]):
        lanes.rewards[lane, i] = 0.0
        if i < n_uas:
            flies |= worlds.uas[lane, i].status in (FLYING, SWAPPING)
            lanes.rewards[lane, i] = amounts[i, REWARD]
    swarm = rows_view(lanes.swarm, lane, (lanes.swarm.shape[1],))
    # sums in variables: memory that has just been written is read late
    energy_Wh = 0.0
    for i in range(n_uas):
        energy_Wh += amounts[i, ENERGY]
    swarm[SWARM_ENERGY] = energy_Wh
    reward = 0.0
    for term in range(amounts.shape[1] - FIRST_TERM):
        paid = 0.0
        for i in range(n_uas):
            paid += amounts[i, FIRST_TERM + term]
        swarm[SWARM_FIRST_TERM + term] = paid
        reward += paid
    swarm[SWARM_REWARD] = reward
    swarm[SWARM_COVERED] = report[0, COVERED]
    lanes.terminated[lane] = not flies
    lanes.truncated[lane] = flies and worlds.step[lane, 0] >= max_steps
    return lanes.terminated[lane] or lanes.truncated[lane]


@inlined_kernel
def _keep_last_looks(worlds, settled, lane, n_uas, before, observation, width):
    """What a UAS that does not fly has seen last stays its observation.

    Two arrays take turns: once it lies in both, nothing has to be copied any more.
    """
    for i in range(observation.shape[1]):
        flies = i < n_uas and worlds.uas[lane, i].status == FLYING
        if not flies and not settled[lane, i]:
            for k in range(width):
                observation[lane, i, k] = before[lane, i, k]
        # one that swaps packs looks around
        settled[lane, i] = not flies and (i >= n_uas or worlds.uas[lane, i].status != SWAPPING)


@inlined_kernel
def _fetch_ahead(state, learners, observation):
    """While the UAS fly, fetch what observing them reads and writes.

    Of 1000 missions most lies far from the processor.
    """
    prefetch(learners.around)
    for i in range(observation.shape[0]):
        if state.uas[i].status == FLYING:
            prefetch(observation[i])


@rare_kernel
def _keep_end(missions, lane, observation, width):
    """Keep the end of a mission, before the next begins in the same step."""
    final = missions.final
    whole = (observation.shape[1], width)
    _copy(rows_view(observation, lane, whole), rows_view(final.observation, lane, whole))
    _copy(missions.learners.report[lane], final.report[lane])
    _copy(missions.learners.candidates[lane], final.candidates[lane])
    for column in range(final.swarm.shape[1]):
        final.swarm[lane, column] = missions.lanes.swarm[lane, column]


@rare_kernel
def _pay_nothing(missions, lane):
    """A mission that has ended and waits is paid once."""
    lanes, amounts = missions.lanes, missions.learners.amounts
    for i in range(lanes.rewards.shape[1]):
        lanes.rewards[lane, i] = 0.0
        for column in range(REWARD, amounts.shape[2]):
            amounts[lane, i, column] = 0.0
    for column in range(SWARM_REWARD, lanes.swarm.shape[1]):
        lanes.swarm[lane, column] = 0.0


@kernel
def _all_finite(numbers):
    finite = True
    for k in range(numbers.shape[0]):
        # no early end: so it is a few vector instructions
        finite &= math.isfinite(numbers[k])
    return finite


@kernel
def _first_refused(pool, missions, orders):
    """The first UAS, lane · U + i, whose action is not finite; ACCEPTED where there is none."""
    asked = missions.learners.asked
    if _all_finite(rows_view(asked, 0, (asked.size,))):
        return ACCEPTED
    for lane in range(asked.shape[0]):
        if orders[lane] != FLY:
            continue
        s = missions.lanes.scene[lane]
        i = first_not_finite(learners_of(missions.learners, lane, pool.arenas, s).asked)
        if i != ACCEPTED:
            return lane * asked.shape[1] + i
    return ACCEPTED


class BatchRules(NamedTuple):
    """What holds for all steps of all lanes."""

    rules: Rules
    autoreset: int
    """NEXT_STEP, SAME_STEP, DISABLED or WAITS."""
    step_lane: int
    """Address of the step of a lane, see `lane_code`."""


class _Given(NamedTuple):
    """What the lanes are given, in one piece."""

    pool: MissionPool
    missions: Missions
    rules: Rules


def _example() -> _Given:
    pool = ScenarioPool("open_field")
    paying = paying_of(V0.reward, np.zeros(len(V0.reward)), V0.reward)
    acting = acting_of(V0.actions[0], V0.actions)
    none = np.zeros(0, np.int64)
    observing = observing_of(V0.observation, V0.observation)
    rules = Rules(acting, False, none, none, paying, observing)
    return _Given(pool.arrays, new_missions(pool.sizes, 1, 1), rules)


_HANDOVER = Handover(_example)
_keep, _take = _HANDOVER.keep, _HANDOVER.take


@cache
def step_lane_with(version: Version) -> Any:
    """One lane of `step_batch`.

    Returns:
        `step_lane(kept, lane, order, thread, autoreset, before, observation, width)`: `kept` is
        `_Given`, handed over; `order` what the lane does; `thread` which thread flies it, from 0
        on; `width` is V: to know it when this is compiled makes a step a tenth faster. The rest is
        as for `step_batch`.
    """
    step_learners = step_learners_with(version)

    @kernel
    def step_lane(kept, lane, order, thread, autoreset, before, observation, width):
        pool, missions, rules = _take(kept)
        lanes = missions.lanes
        if rarely(order == REST):
            whole = (observation.shape[1], width)
            _copy(rows_view(before, lane, whole), rows_view(observation, lane, whole))
            if autoreset == WAITS:
                _pay_nothing(missions, lane)
            return
        begins = order != FLY
        if rarely(begins):
            lanes.terminated[lane] = False
            lanes.truncated[lane] = False
            for i in range(lanes.rewards.shape[1]):
                lanes.rewards[lane, i] = 0.0
        else:
            s = lanes.scene[lane]
            arena = arena_of(pool.arenas, s)
            max_steps = arena.rules[0].max_steps
            state = state_of(missions.worlds, lane, pool.arenas, s)
            learners = learners_of(missions.learners, lane, pool.arenas, s)
            n_uas = state.uas.shape[0]
            rows = rows_view(observation, lane, (n_uas, width))
            _fetch_ahead(state, learners, rows)
            _keep_last_looks(
                missions.worlds, missions.settled, lane, n_uas, before, observation, width
            )
            step_learners(
                arena, state, tables_at(pool.tables, s), learners,
                _scratch_of(missions.scratch, thread, pool.arenas, s), rules, False, rows,
            )  # fmt: skip
            over = _add_up(missions.worlds, lanes, learners, lane, max_steps)
            if over and autoreset == NEXT_STEP:
                lanes.orders[lane] = DRAW
            elif over and autoreset == WAITS:
                lanes.orders[lane] = REST
            elif over and autoreset == SAME_STEP:
                _keep_end(missions, lane, observation, width)
                begins = True
                order = DRAW
        if rarely(begins):
            _begin_lane(pool, missions, rules.code, lane, order, observation, width)

    return step_lane


def _lane_types() -> tuple[types.Type, ...]:
    number, observations = types.int64, types.Array(types.float32, 3, "C")
    return number, number, number, number, number, observations, observations, number


_LANE = Signature("kept lane order thread autoreset before observation width", _lane_types)
_step_lane_at = _LANE.call


def lane_code(version: Version, width: int) -> int:
    """Compile the step of a lane, or load it from the cache.

    It takes ten seconds to compile, and is called at its address: once for all kernels below.

    Args:
        version: Of the environment.
        width: Numbers of an observation.
    """
    return _LANE.address_of(step_lane_with(version), width=width)


@kernel
def step_batch(pool, missions, orders, rules, before, observation):
    """Fly all lanes for one step, or begin missions in them.

    Args:
        pool: `MissionPool`.
        missions: `Missions` with `asked` filled in; written.
        orders: (L,) what each lane does; `lanes.orders`, or an array of its own.
        rules: `BatchRules`.
        before: (L, U, V) float32, the observations of the step before.
        observation: (L, U, V) float32, another array; written.

    Returns:
        ACCEPTED, or lane · U + i of the first UAS whose action is not finite; then nothing has
        changed.
    """
    refused = _first_refused(pool, missions, orders)
    if refused == ACCEPTED:
        kept = _keep(_Given(pool, missions, rules.rules))
        for lane in range(orders.shape[0]):
            _step_lane_at(
                rules.step_lane, kept, lane, orders[lane], 0, rules.autoreset, before, observation,
                observation.shape[2],
            )  # fmt: skip
    return refused


@allocating_kernel(parallel=True)
def step_batch_in_threads(pool, missions, orders, rules, before, observation):
    """`step_batch`, the lanes shared among numba's threads.

    A function of its own: to start threads takes longer than to fly a few lanes, and numba's cache
    cannot tell two ways to compile one function apart.
    """
    refused = _first_refused(pool, missions, orders)
    if refused == ACCEPTED:
        kept = _keep(_Given(pool, missions, rules.rules))
        step_lane_at, autoreset = rules.step_lane, rules.autoreset
        for lane in prange(orders.shape[0]):
            _step_lane_at(
                step_lane_at, kept, np.int64(lane), orders[lane], np.int64(get_thread_id()),
                autoreset, before, observation, observation.shape[2],
            )  # fmt: skip
    return refused
