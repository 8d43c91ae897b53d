"""One step of many missions, compiled: in blocks of lanes, with the stages of a single one."""

import math
from functools import cache
from typing import Any, NamedTuple

import numpy as np
from numba import get_thread_id, prange, types

from uas_coverage_env.compiled.calls import Signature
from uas_coverage_env.compiled.kernels import (
    allocating_kernel,
    in_turn,
    inlined_kernel,
    kernel,
    prefetch,
    rare_kernel,
    rarely,
    stack_array_i64,
)
from uas_coverage_env.compiled.random import counted
from uas_coverage_env.compiled.views import Handover, copy_arrays, lane_view, rows_view
from uas_coverage_env.entities.state import ABSENT, FLYING, SWAPPING, as_observed
from uas_coverage_env.env.batch.memory import (
    DRAW,
    FLY,
    LANES_AT_ONCE,
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
from uas_coverage_env.env.episode.step import ACCEPTED, Rules, stages_with
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

scratch_of = lane_view(SCRATCH, sized_by=ARENA)
"""In a kernel, (`Missions.scratch`, place, `MissionPool.arenas`, s) -> what it flies a lane in."""


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


@cache
def begin_lane_with(begin_features: Any) -> Any:
    """A kernel that begins a mission in a lane.

    Args:
        begin_features: See `simulation.points.begin_features`.
    """

    @rare_kernel
    def begin_lane(pool, missions, code, lane, order, observation, width):
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

    return begin_lane


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


class Given(NamedTuple):
    """What all steps of all lanes work on."""

    pool: MissionPool
    missions: Missions
    rules: Rules


def _example() -> Given:
    pool = ScenarioPool("open_field")
    paying = paying_of(V0.reward, np.zeros(len(V0.reward)), V0.reward)
    acting = acting_of(V0.actions[0], V0.actions)
    none = np.zeros(0, np.int64)
    observing = observing_of(V0.observation, V0.observation)
    rules = Rules(acting, 0, none, none, paying, observing)
    return Given(pool.arrays, new_missions(pool.sizes, 1, 1), rules)


GIVEN = Handover(_example)
"""How kernels are given it."""

_take = GIVEN.take


@kernel
def _first_refused(given, orders):
    """The first UAS, lane · U + i, whose action is not finite; ACCEPTED where there is none."""
    pool, missions, _ = _take(given)
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


def _loop_with(stage: Any, width: int, *, looks: bool) -> Any:
    """A stage of a step as a loop over lanes; its arguments are `_LOOP`.

    Args:
        stage: See `Stages`.
        width: V. To know it when this is compiled makes a step a tenth faster.
        looks: Whether it is one of those that observe.
    """

    @rare_kernel
    def loop(given, lanes, n, room, observation):
        pool, missions, rules = _take(given)
        scene = missions.lanes.scene
        k = 0
        while k < n:
            # arrays of a scene are looked up once for all lanes that follow one another in it
            s = scene[lanes[k]]
            arena = arena_of(pool.arenas, s)
            tables = tables_at(pool.tables, s)
            while k < n and scene[lanes[k]] == s:
                lane = lanes[k]
                state = state_of(missions.worlds, lane, pool.arenas, s)
                learners = learners_of(missions.learners, lane, pool.arenas, s)
                scratch = scratch_of(missions.scratch, room + k, pool.arenas, s)
                if looks:
                    rows = rows_view(observation, lane, (arena.uas.shape[0], width))
                    stage(
                        arena, as_observed(state), tables, learners, rules.observing,
                        scratch.looks, rows,
                    )  # fmt: skip
                else:
                    stage(arena, state, tables, learners, scratch, rules)
                k += 1

    return loop


_LOOP = "given, lanes, n, room, observation"


@cache
def finish_lane_with(begin_features: Any, width: int) -> Any:
    """What a lane does at the end of a step: add up, or whatever else than fly it was to do.

    Args:
        begin_features: See `simulation.points.begin_features`.
        width: V. To know it when this is compiled makes a step a tenth faster.

    Returns:
        `finish_lane(pool, missions, rules, lane, order, autoreset, before, observation)`: `order`
        is what the lane does. The rest is as for `step_batch`.
    """
    begin_lane = begin_lane_with(begin_features)

    @inlined_kernel
    def finish_lane(pool, missions, rules, lane, order, autoreset, before, observation):
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
            learners = learners_of(missions.learners, lane, pool.arenas, s)
            max_steps = arena_of(pool.arenas, s).rules[0].max_steps
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
            begin_lane(pool, missions, rules.code, lane, order, observation, width)

    return finish_lane


@cache
def keep_lane_with(width: int, *, fetches: bool) -> Any:
    """What a lane does before it flies: `keep_lane(pool, missions, lane, before, observation)`.

    Args:
        width: V.
        fetches: Whether memory is fetched ahead, for which a GPU has no instruction.
    """

    @inlined_kernel
    def keep_lane(pool, missions, lane, before, observation):
        s = missions.lanes.scene[lane]
        state = state_of(missions.worlds, lane, pool.arenas, s)
        n_uas = state.uas.shape[0]
        if fetches:
            learners = learners_of(missions.learners, lane, pool.arenas, s)
            _fetch_ahead(state, learners, rows_view(observation, lane, (n_uas, width)))
        _keep_last_looks(missions.worlds, missions.settled, lane, n_uas, before, observation, width)

    return keep_lane


@cache
def step_block_with(version: Version, width: int) -> Any:
    """Some lanes of `step_batch`, each stage flown by all before the next one begins.

    The machine code of a whole step fits into no cache.

    Returns:
        `step_block(given, orders, by_scene, first, n, thread, autoreset, before, observation)`:
        flies the lanes by_scene[first : first + n], LANES_AT_ONCE at most; `thread` is which thread
        flies them, from 0 on; the rest is as for `step_batch`.
    """
    flight, looks = stages_with(version)
    loops = [_loop_with(stage, width, looks=False) for stage in flight]
    loops += [_loop_with(look, width, looks=True) for look in looks]
    fly = in_turn(loops, _LOOP)
    keep_lane = keep_lane_with(width, fetches=True)
    finish_lane = finish_lane_with(begin_features, width)

    @kernel
    def step_block(given, orders, by_scene, first, n, thread, autoreset, before, observation):
        pool, missions, rules = _take(given)
        flown = stack_array_i64(LANES_AT_ONCE)
        n_flown = np.int64(0)  # a constant would be a type of its own
        for k in range(first, first + n):
            lane = by_scene[k]
            if orders[lane] == FLY:
                flown[n_flown] = lane
                n_flown += 1
                keep_lane(pool, missions, lane, before, observation)
        fly(given, flown, n_flown, thread * LANES_AT_ONCE, observation)
        for k in range(first, first + n):
            lane = by_scene[k]
            finish_lane(pool, missions, rules, lane, orders[lane], autoreset, before, observation)

    return step_block


def _block_types() -> tuple[types.Type, ...]:
    number, observations = types.int64, types.Array(types.float32, 3, "C")
    numbers = types.Array(number, 1, "C")
    return numbers, numbers, numbers, number, number, number, number, observations, observations


_BLOCK = Signature(
    "given orders by_scene first n thread autoreset before observation", _block_types
)
_step_block_at = _BLOCK.call


def block_code(version: Version, width: int) -> int:
    """Compile the step of a block of lanes, or load it from the cache.

    It takes ten seconds to compile, and is called at its address: once for all kernels below.

    Args:
        version: Of the environment.
        width: Numbers of an observation.
    """
    return _BLOCK.address_of(step_block_with(version, width))


@kernel
def step_batch(given, orders, by_scene, autoreset, step_block, before, observation):
    """Fly all lanes for one step, or begin missions in them.

    Args:
        given: What `GIVEN` says of `Given`; `asked` is filled in, the missions are written.
        orders: (L,) what each lane does; `lanes.orders`, or an array of its own.
        by_scene: (L,) the lanes, those of one scene one after the other; in any other order it
            takes longer.
        autoreset: NEXT_STEP, SAME_STEP, DISABLED or WAITS.
        step_block: Address of the step of a block of lanes, see `block_code`.
        before: (L, U, V) float32, the observations of the step before.
        observation: (L, U, V) float32, another array; written.

    Returns:
        ACCEPTED, or lane · U + i of the first UAS whose action is not finite; then nothing has
        changed.
    """
    refused = _first_refused(given, orders)
    if refused == ACCEPTED:
        n_lanes = orders.shape[0]
        for first in range(0, n_lanes, LANES_AT_ONCE):
            _step_block_at(
                step_block, given, orders, by_scene, first, min(LANES_AT_ONCE, n_lanes - first), 0,
                autoreset, before, observation,
            )  # fmt: skip
    return refused


@allocating_kernel(parallel=True)
def step_batch_in_threads(given, orders, by_scene, autoreset, step_block, before, observation):
    """`step_batch`, the lanes shared among numba's threads.

    A function of its own: to start threads takes longer than to fly a few lanes, and numba's cache
    cannot tell two ways to compile one function apart.
    """
    refused = _first_refused(given, orders)
    if refused == ACCEPTED:
        n_lanes = orders.shape[0]
        for block in prange((n_lanes + LANES_AT_ONCE - 1) // LANES_AT_ONCE):
            first = np.int64(block) * LANES_AT_ONCE
            _step_block_at(
                step_block, given, orders, by_scene, first, min(LANES_AT_ONCE, n_lanes - first),
                np.int64(get_thread_id()), autoreset, before, observation,
            )  # fmt: skip
    return refused
