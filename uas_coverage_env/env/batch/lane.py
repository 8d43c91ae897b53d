"""What a lane of a batch does beside the flight: begin a mission, keep what was seen, add up."""

from functools import cache
from typing import Any

import numpy as np

from uas_coverage_env.compiled.kernels import (
    inlined_kernel,
    kernel,
    prefetch,
    rare_kernel,
    rarely,
)
from uas_coverage_env.compiled.random import counted
from uas_coverage_env.compiled.views import copy_arrays, rows_view
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
)
from uas_coverage_env.env.batch.pool import (
    first_learners_at,
    first_observation_at,
    learners_of,
)
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
from uas_coverage_env.simulation.pool import arena_of, start_of, state_of
from uas_coverage_env.world.events import begin_events


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
