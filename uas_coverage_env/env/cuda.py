"""Many missions of one scenario on a GPU: the kernels of the world compiled for CUDA.

Numba compiles the same functions for a GPU that it compiles for the processor; one thread of the
GPU flies one mission. What cannot run there is what makes arrays: guidance (the waypoint action),
return mode and safety filter. For all else the step is that of `CoverageParallelEnv`, in double
precision; the GPU's own roots and exponentials may differ in the last digit.

Without a GPU, numba's simulator runs it: `NUMBA_ENABLE_CUDASIM=1`, for tests.
"""

from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numba import config, cuda
from numpy.typing import NDArray

from uas_coverage_env.compiled.kernels import kernel
from uas_coverage_env.compiled.random import SEEDS
from uas_coverage_env.compiled.views import copy_arrays, lane_view
from uas_coverage_env.disturbances.act import begin_random
from uas_coverage_env.disturbances.on_gpu import are_own, disturb_with
from uas_coverage_env.env.act import (
    acting_of,
    begin_command,
    first_not_finite,
    is_own,
    refuse_unflyable,
    write_commands,
)
from uas_coverage_env.env.kernel import ACCEPTED, finish_step
from uas_coverage_env.env.memory import (
    FIRST_OBSERVATION,
    LEARNERS,
    REWARD,
    SCRATCH,
    STATUS,
    FirstObservation,
    Learners,
    Scratch,
)
from uas_coverage_env.env.observation import OBSERVATION
from uas_coverage_env.env.observe import observing_of
from uas_coverage_env.env.pool import (
    MissionPool,
    ScenarioPool,
    first_learners_at,
    first_observation_at,
    learners_of,
    tables_at,
)
from uas_coverage_env.env.reward_kernel import paying_of
from uas_coverage_env.env.rewards import REWARD as DEFAULT_REWARD
from uas_coverage_env.env.settings import MissionSettings
from uas_coverage_env.scenario import Scenario
from uas_coverage_env.simulation.pool import arena_of, lanes_of, start_of, state_of
from uas_coverage_env.simulation.step import (
    begin_step,
    carry_out,
    judge,
    move_all,
    write_all_inputs,
)
from uas_coverage_env.world import FLYING, SWAPPING, WorldState
from uas_coverage_env.world.arena import ARENA
from uas_coverage_env.world.events import begin_events, goes_home, heed
from uas_coverage_env.world.state import STATE, as_told

THREADS_PER_BLOCK = 64


class Missions(NamedTuple):
    """All missions of N lanes; the first axis of every array is the lane."""

    worlds: WorldState
    learners: Learners
    first_observations: FirstObservation
    scratch: Scratch
    rewards: NDArray[np.float64]
    """(N, U) of each UAS for the latest step."""
    ended: NDArray[np.bool_]
    """(N,) the mission is over; its next step begins a new one and flies nothing."""
    refused: NDArray[np.bool_]
    """(N,) an action was not finite, and so nothing was flown."""
    acted: NDArray[np.int64]
    """(N,) agent-steps flown since the beginning."""
    seed: NDArray[np.uint64]
    """(N,) of what disturbances draw."""
    mission: NDArray[np.int64]
    """(N,) number of the mission since the beginning, from 0 on."""


_scratch_of = lane_view(SCRATCH, sized_by=ARENA)
_look_of = lane_view(FIRST_OBSERVATION, sized_by=ARENA)


@kernel
def _flies(pool, missions, lane):
    """Whether a lane flies in this step: it refuses an action, or begins a mission, where not."""
    state = state_of(missions.worlds, lane, pool.arenas, 0)
    learners = learners_of(missions.learners, lane, pool.arenas, 0)
    missions.refused[lane] = first_not_finite(learners.asked) != ACCEPTED
    if missions.refused[lane]:
        return False
    if missions.ended[lane]:
        seen = _look_of(missions.first_observations, lane, pool.arenas, 0)
        missions.ended[lane] = False
        missions.mission[lane] += 1
        copy_arrays(start_of(pool.starts, 0), state)
        arena = arena_of(pool.arenas, 0)
        seed, mission = missions.seed[lane], missions.mission[lane]
        begin_random(arena.disturbances, state.disturbance_random, seed, mission)
        begin_events(arena, state, seed, mission)
        copy_arrays(first_learners_at(pool.learners, 0), learners)
        copy_arrays(first_observation_at(pool.first_observations, 0), seen)
        for i in range(state.status.shape[0]):
            missions.rewards[lane, i] = 0.0
        return False
    return True


@kernel
def _decide(pool, acting, missions, lane):
    """Begin a step with the commands of the actions."""
    state = state_of(missions.worlds, lane, pool.arenas, 0)
    learners = learners_of(missions.learners, lane, pool.arenas, 0)
    scratch = _scratch_of(missions.scratch, lane, pool.arenas, 0)
    arena, tables = arena_of(pool.arenas, 0), tables_at(pool.tables, 0)
    seen = as_told(arena, state)
    write_commands(arena, seen, tables, learners, scratch, acting, True)
    begin_step(state, scratch.commands, scratch.outcome)
    if arena.rules[0].eventful:
        heed(arena, state, scratch.outcome)


@kernel
def _finish(pool, paying, observing, missions, lane):
    """Reward and observe a step that was flown."""
    state = state_of(missions.worlds, lane, pool.arenas, 0)
    learners = learners_of(missions.learners, lane, pool.arenas, 0)
    scratch = _scratch_of(missions.scratch, lane, pool.arenas, 0)
    arena, tables = arena_of(pool.arenas, 0), tables_at(pool.tables, 0)
    seen = _look_of(missions.first_observations, lane, pool.arenas, 0)
    finish_step(arena, state, tables, learners, scratch, paying, observing, seen.observation, True)
    flies = False
    for i in range(state.status.shape[0]):
        missions.rewards[lane, i] = learners.amounts[i, REWARD]
        missions.acted[lane] += scratch.outcome[i].flew
        status = learners.report[i, STATUS]
        flies = flies or status == FLYING
        flies = flies or status == SWAPPING
    missions.ended[lane] = not flies or state.step[0] >= arena.rules[0].max_steps


@kernel
def _write_as_usual(pool, acting, missions, lane):
    """The commands of the usual kinds of action are written by `write_commands`."""


@cache
def _write_with(write: Any) -> Any:
    """A function that writes commands with the kernel of a kind of action of one's own."""

    @kernel
    def write_own(pool, acting, missions, lane):
        # before the step: an action that cannot be flown is refused as one that is not finite
        arena = arena_of(pool.arenas, 0)
        state = state_of(missions.worlds, lane, pool.arenas, 0)
        tables = tables_at(pool.tables, 0)
        learners = learners_of(missions.learners, lane, pool.arenas, 0)
        scratch = _scratch_of(missions.scratch, lane, pool.arenas, 0)
        if missions.ended[lane] or first_not_finite(learners.asked) != ACCEPTED:
            return
        for i in range(state.status.shape[0]):
            begin_command(tables, learners, scratch, acting, i)
            if state.status[i] == FLYING:
                command = scratch.commands[i]
                values = scratch.values[i]
                seen = as_told(arena, state)
                write(arena, seen, tables, learners, i, acting.parameters, values, command)
                refuse_unflyable(arena, learners, acting, i, command)

    return write_own


@kernel
def _fly_as_usual(pool, missions, nonlinear, lane):
    """Fly and judge a step, with the disturbances of the package."""
    state = state_of(missions.worlds, lane, pool.arenas, 0)
    scratch = _scratch_of(missions.scratch, lane, pool.arenas, 0)
    carry_out(arena_of(pool.arenas, 0), state, nonlinear, None, scratch.outcome)


@cache  # to compile it again takes seconds
def _fly_with(kernels: tuple[Any, ...]) -> Any:
    """The same with disturbances of one's own, of which these are the kernels."""
    disturb = disturb_with(kernels)

    @kernel
    def fly_disturbed(pool, missions, nonlinear, lane):
        arena = arena_of(pool.arenas, 0)
        state = state_of(missions.worlds, lane, pool.arenas, 0)
        scratch = _scratch_of(missions.scratch, lane, pool.arenas, 0)
        write_all_inputs(arena, state, nonlinear, scratch.outcome)
        disturb(arena, state, scratch.outcome)
        move_all(arena, state, nonlinear, scratch.outcome)
        judge(arena, state, nonlinear, scratch.outcome)

    return fly_disturbed


@cache
def _step_of(write: Any, fly: Any) -> Any:
    """The step of all lanes, made of these functions."""

    @cuda.jit
    def step(pool, acting, paying, observing, missions, nonlinear):
        lane = cuda.grid(1)  # pyright: ignore[reportCallIssue]
        if lane < missions.ended.shape[0]:
            write(pool, acting, missions, lane)
            if _flies(pool, missions, lane):
                _decide(pool, acting, missions, lane)
                fly(pool, missions, nonlinear, lane)
                _finish(pool, paying, observing, missions, lane)

    return step


def _on_device(array: NDArray) -> Any:
    # the simulator's own arrays are strange to what is called by its kernels; it takes plain ones
    simulated = config.ENABLE_CUDASIM  # pyright: ignore[reportAttributeAccessIssue]
    return array.copy() if simulated else cuda.to_device(array)


def _all_on_device(arrays: Any) -> Any:
    """The same named tuple, of arrays and named tuples, with its arrays on the device."""
    if isinstance(arrays, np.ndarray):
        return _on_device(arrays)
    return arrays._make(map(_all_on_device, arrays))


class CudaMissions:
    """N missions of one scenario on the GPU.

    A lane whose mission has ended begins the next one in the step after, whatever it is asked.

    Args:
        num_envs: N.
        scenario: Name of a shipped scenario, path of a scenario file, or a scenario.
        seed: Of all that disturbances draw; lane i has the seed `seed` + i.
        **settings: See `MissionSettings`; what does not run on a GPU is refused.

    Attributes:
        missions: `Missions` on the device; to be read only, but for `learners.asked`.

    Raises:
        ValueError: An argument is none of what is allowed.
        numba.cuda.CudaSupportError: There is no GPU.
    """

    def __init__(
        self,
        num_envs: int,
        scenario: str | Path | Scenario = "village",
        *,
        seed: int = 0,
        **settings: Any,
    ) -> None:
        if isinstance(num_envs, bool) or not isinstance(num_envs, int) or num_envs < 1:
            raise ValueError(f"num_envs is {num_envs!r}; give a whole number from 1 on")
        whole = isinstance(seed, int | np.integer) and not isinstance(seed, bool)
        if not whole or not 0 <= seed <= SEEDS - num_envs:
            raise ValueError(f"seed is {seed!r}; give a whole number from 0 to 2**64 - num_envs")
        given = MissionSettings.of(settings)
        if given.kind.goes_to or given.return_mode or given.safety_filter:
            raise ValueError(
                "actions that go to places (waypoint), return_mode and safety_filter do not run on "
                "a GPU; take another action and leave both switches off"
            )
        if given.observation != OBSERVATION or given.reward != DEFAULT_REWARD:
            raise ValueError(
                "on a GPU observation and reward are OBSERVATION and REWARD; leave them out"
            )
        pool = ScenarioPool(scenario, given)
        if pool.changes:
            raise ValueError(
                f"scenario {pool.scenarios[0].name!r} has events or again_after_s by which the "
                f"scene changes, which does not run on a GPU; take make_vec"
            )
        if goes_home(pool.scenarios[0]):
            raise ValueError(
                f"scenario {pool.scenarios[0].name!r} has an event that sends UAS home, which does "
                f'not run on a GPU; let them do another thing (then = "hover")'
            )
        acting = acting_of(given.kind, on_gpu=True)
        acts = tuple(disturbance.act for disturbance in pool.disturbances)
        self._launched = _step_of(
            _write_with(given.kind.write) if is_own(acting) else _write_as_usual,
            _fly_with(acts) if are_own(acts) else _fly_as_usual,
        )
        paying = paying_of(DEFAULT_REWARD, given.weights)
        observing = observing_of(OBSERVATION)
        n_uas = pool.sizes["U"]
        missions = Missions(
            lanes_of(num_envs, pool.arrays.starts),
            LEARNERS.zeros(pool.sizes, lanes=num_envs),
            FIRST_OBSERVATION.zeros(pool.sizes, lanes=num_envs),
            SCRATCH.zeros(pool.sizes, lanes=num_envs),
            np.zeros((num_envs, n_uas)),
            np.zeros(num_envs, dtype=np.bool_),
            np.zeros(num_envs, dtype=np.bool_),
            np.zeros(num_envs, dtype=np.int64),
            np.arange(num_envs, dtype=np.uint64) + np.uint64(seed),
            np.zeros(num_envs, dtype=np.int64),
        )
        _begin_all(pool.arrays, missions)
        self.missions: Missions = _all_on_device(missions)
        self._blocks = -(-num_envs // THREADS_PER_BLOCK)
        self._arguments = (
            _all_on_device(pool.arrays),
            _all_on_device(acting),
            _all_on_device(paying),
            _all_on_device(observing),
            self.missions,
            given.dynamics == "nonlinear",
        )

    def step(self, asked: Any = None) -> None:
        """Fly all lanes for one step.

        Args:
            asked: (N, U, size) actions, on the host or on the device; None: what is in
                `missions.learners.asked`. Of a lane with one that is not finite nothing is flown,
                and `missions.refused` is set.
        """
        if asked is not None:
            self.missions.learners.asked[:] = asked
        self._launched[self._blocks, THREADS_PER_BLOCK](*self._arguments)


def _begin_all(pool: MissionPool, missions: Missions) -> None:
    """Put all lanes at t = 0."""
    parts = (
        (missions.worlds, STATE.mission(pool.starts, 0)),
        (missions.learners, LEARNERS.mission(pool.learners, 0)),
        (missions.first_observations, FIRST_OBSERVATION.mission(pool.first_observations, 0)),
    )
    for arrays, first in parts:
        for array, start in zip(arrays, first, strict=True):
            array[:] = start
    arena = ARENA.mission(pool.arenas, 0)
    if len(arena.disturbances) or arena.rules["eventful"][0]:
        _begin_random_of_all(pool, missions)


@kernel
def _begin_random_of_all(pool, missions):
    arena = arena_of(pool.arenas, 0)
    for lane in range(missions.seed.shape[0]):
        state = state_of(missions.worlds, lane, pool.arenas, 0)
        seed, mission = missions.seed[lane], missions.mission[lane]
        begin_random(arena.disturbances, state.disturbance_random, seed, mission)
        begin_events(arena, state, seed, mission)
