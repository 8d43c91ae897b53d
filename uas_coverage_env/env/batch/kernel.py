"""One step of many missions, compiled: in blocks of lanes, with the stages of a single one."""

import math
from functools import cache
from typing import Any, NamedTuple, Self

import numpy as np
from numba import get_thread_id, prange, types
from numpy.typing import NDArray

from uas_coverage_env.compiled.calls import Signature
from uas_coverage_env.compiled.kernels import (
    allocating_kernel,
    in_turn,
    kernel,
    rare_kernel,
    stack_array_i64,
)
from uas_coverage_env.compiled.memory import Pool
from uas_coverage_env.compiled.views import Handover, lane_view, rows_view
from uas_coverage_env.entities.state import WorldState, as_observed
from uas_coverage_env.env.batch.lane import finish_lane_with, keep_lane_with
from uas_coverage_env.env.batch.memory import (
    FLY,
    UAS_AT_ONCE,
    Missions,
    new_missions,
)
from uas_coverage_env.env.batch.pool import (
    MissionPool,
    ScenarioPool,
    learners_of,
    tables_at,
)
from uas_coverage_env.env.episode.act import acting_of, first_not_finite
from uas_coverage_env.env.episode.memory import SCRATCH, Learners, Scratch
from uas_coverage_env.env.episode.observe import observing_of
from uas_coverage_env.env.episode.pay import paying_of
from uas_coverage_env.env.episode.step import ACCEPTED, Rules, stages_with
from uas_coverage_env.env.versions import V0, Version
from uas_coverage_env.simulation.points import begin_features
from uas_coverage_env.simulation.pool import arena_of, state_of
from uas_coverage_env.world.arena import ARENA

scratch_of = lane_view(SCRATCH, sized_by=ARENA)
"""In a kernel, (`Missions.scratch`, place, `MissionPool.arenas`, s) -> what it flies a lane in."""


@kernel
def _all_finite(numbers):
    finite = True
    for k in range(numbers.shape[0]):
        # no early end: so it is a few vector instructions
        finite &= math.isfinite(numbers[k])
    return finite


class Flight(NamedTuple):
    """What the stages of a step work on."""

    arenas: Pool
    tables: Pool
    worlds: WorldState
    learners: Learners
    scratch: Scratch
    scene: NDArray[np.int64]
    """Of `SubEnvironments`."""
    rules: Rules


class Given(NamedTuple):
    """What all steps of all lanes work on."""

    flight: Flight
    pool: MissionPool
    missions: Missions

    @classmethod
    def of(cls, pool: MissionPool, missions: Missions, rules: Rules) -> Self:
        """For a pool and missions."""
        flight = Flight(
            pool.arenas, pool.tables, missions.worlds, missions.learners, missions.scratch,
            missions.lanes.scene, rules,
        )  # fmt: skip
        return cls(flight, pool, missions)


def _example() -> Given:
    pool = ScenarioPool("open_field")
    paying = paying_of(V0.reward, np.zeros(len(V0.reward)), V0.reward)
    acting = acting_of(V0.actions[0], V0.actions)
    none = np.zeros(0, np.int64)
    observing = observing_of(V0.observation, V0.observation)
    rules = Rules(acting, 0, none, none, paying, observing)
    return Given.of(pool.arrays, new_missions(pool.sizes, 1, 1), rules)


GIVEN = Handover(_example)
"""How kernels are given it."""

_take, _take_flight = GIVEN.take, GIVEN.take_first


@kernel
def _first_refused(given, orders):
    """The first UAS, lane · U + i, whose action is not finite; ACCEPTED where there is none."""
    flight = _take_flight(given)
    asked = flight.learners.asked
    if _all_finite(rows_view(asked, 0, (asked.size,))):
        return ACCEPTED
    for lane in range(asked.shape[0]):
        if orders[lane] != FLY:
            continue
        s = flight.scene[lane]
        i = first_not_finite(learners_of(flight.learners, lane, flight.arenas, s).asked)
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
        arenas, all_tables, worlds, all_learners, all_scratch, scene, rules = _take_flight(given)
        k = 0
        while k < n:
            # arrays of a scene are looked up once for all lanes that follow one another in it
            s = scene[lanes[k]]
            arena = arena_of(arenas, s)
            tables = tables_at(all_tables, s)
            while k < n and scene[lanes[k]] == s:
                lane = lanes[k]
                state = state_of(worlds, lane, arenas, s)
                learners = learners_of(all_learners, lane, arenas, s)
                scratch = scratch_of(all_scratch, room + k, arenas, s)
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


class BlockParts(NamedTuple):
    """What a block of lanes does in a step, one after the other; arguments as for `step_batch`."""

    gather: Any
    """`gather(given, orders, by_scene, first, n, flown, before, observation)`: writes into `flown`
    which of the lanes by_scene[first : first + n] fly; returns how many."""
    loops: tuple[Any, ...]
    """Each stage of the flight and of what is observed, `loop(given, flown, n_flown, room,
    observation)`; `room` is the first of their places in the scratch."""
    finish: Any
    """`finish(given, orders, by_scene, first, n, autoreset, before, observation)`: adds up, begins
    missions and keeps those that rest."""


@cache
def block_parts_with(version: Version, width: int) -> BlockParts:
    """The parts of a version, compiled for observations of so many numbers."""
    flight, looks = stages_with(version).whole
    keep_lane = keep_lane_with(width, fetches=True)
    finish_lane = finish_lane_with(begin_features, width)

    @rare_kernel
    def gather(given, orders, by_scene, first, n, flown, before, observation):
        _, pool, missions = _take(given)
        n_flown = 0
        for k in range(first, first + n):
            lane = by_scene[k]
            if orders[lane] == FLY:
                flown[n_flown] = lane
                n_flown += 1
                keep_lane(pool, missions, lane, before, observation)
        return n_flown

    @rare_kernel
    def finish(given, orders, by_scene, first, n, autoreset, before, observation):
        flight, pool, missions = _take(given)
        for k in range(first, first + n):
            lane = by_scene[k]
            finish_lane(
                pool, missions, flight.rules, lane, orders[lane], autoreset, before, observation
            )

    loops = [_loop_with(stage, width, looks=False) for stage in flight]
    loops += [_loop_with(look, width, looks=True) for look in looks]
    return BlockParts(gather, tuple(loops), finish)


@cache
def step_block_with(version: Version, width: int) -> Any:
    """Some lanes of `step_batch`, each stage flown by all before the next one begins.

    The machine code of a whole step fits into no cache.

    Returns:
        `step_block(given, orders, by_scene, first, n, room, autoreset, before, observation)`, see
        `BlockParts`.
    """
    gather, loops, finish = block_parts_with(version, width)
    fly = in_turn(loops, _LOOP)

    @kernel
    def step_block(given, orders, by_scene, first, n, room, autoreset, before, observation):
        flown = stack_array_i64(UAS_AT_ONCE)
        n_flown = gather(given, orders, by_scene, first, n, flown, before, observation)
        fly(given, flown, n_flown, room, observation)
        finish(given, orders, by_scene, first, n, autoreset, before, observation)

    return step_block


def _block_types() -> tuple[types.Type, ...]:
    number, observations = types.int64, types.Array(types.float32, 3, "C")
    numbers = types.Array(number, 1, "C")
    return numbers, numbers, numbers, number, number, number, number, observations, observations


_BLOCK = Signature("given orders by_scene first n room autoreset before observation", _block_types)
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
def step_batch(given, orders, by_scene, at_once, autoreset, step_block, before, observation):
    """Fly all lanes for one step, or begin missions in them.

    Args:
        given: What `GIVEN` says of `Given`; `asked` is filled in, the missions are written.
        orders: (L,) what each lane does; `lanes.orders`, or an array of its own.
        by_scene: (L,) the lanes, those of one scene one after the other; in any other order it
            takes longer.
        at_once: See `lanes_at_once`; UAS_AT_ONCE at most.
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
        for first in range(0, n_lanes, at_once):
            _step_block_at(
                step_block, given, orders, by_scene, first, min(at_once, n_lanes - first), 0,
                autoreset, before, observation,
            )  # fmt: skip
    return refused


@allocating_kernel(parallel=True)
def step_batch_in_threads(
    given, orders, by_scene, at_once, autoreset, step_block, before, observation
):
    """`step_batch`, the lanes shared among numba's threads.

    A function of its own: to start threads takes longer than to fly a few lanes, and numba's cache
    cannot tell two ways to compile one function apart.
    """
    refused = _first_refused(given, orders)
    if refused == ACCEPTED:
        n_lanes = orders.shape[0]
        for block in prange((n_lanes + at_once - 1) // at_once):
            first, room = np.int64(block) * at_once, np.int64(get_thread_id()) * at_once
            _step_block_at(
                step_block, given, orders, by_scene, first, min(at_once, n_lanes - first), room,
                autoreset, before, observation,
            )  # fmt: skip
    return refused
