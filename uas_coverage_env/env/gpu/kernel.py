"""One step of many missions on a GPU: one thread flies one mission.

Numba compiles the same functions for a GPU that it compiles for the processor. What cannot run
there is what makes arrays: guidance (the waypoint action), return mode and safety filter.
"""

from functools import cache
from typing import Any, NamedTuple

import numpy as np
from numba import cuda
from numpy.typing import NDArray

from uas_coverage_env.compiled.kernels import kernel
from uas_coverage_env.compiled.views import copy_arrays, lane_view
from uas_coverage_env.entities.state import FLYING, STATE, SWAPPING, as_observed
from uas_coverage_env.env.batch.pool import (
    ScenarioPool,
    first_learners_at,
    first_observation_at,
    learners_of,
    tables_at,
)
from uas_coverage_env.env.episode.act import begin_command, first_not_finite, refuse_unflyable
from uas_coverage_env.env.episode.memory import (
    FIRST_OBSERVATION,
    LEARNERS,
    SCRATCH,
    FirstObservation,
    Learners,
    Scratch,
)
from uas_coverage_env.env.episode.observe import Blocks, observe_one_with
from uas_coverage_env.env.episode.pay import Terms, compute_rewards_with
from uas_coverage_env.env.episode.settings import MissionSettings
from uas_coverage_env.env.episode.step import ACCEPTED, look_around_with, pay_step_with
from uas_coverage_env.env.report import REWARD, STATUS
from uas_coverage_env.features.feature import MissionFeature, Point
from uas_coverage_env.simulation.flight import check_all, fly_still, move_all, write_all_inputs
from uas_coverage_env.simulation.on_gpu import called_at, called_at_begin
from uas_coverage_env.simulation.pool import arena_of, start_of, state_of
from uas_coverage_env.simulation.step import begin_step, judge
from uas_coverage_env.world import WorldState
from uas_coverage_env.world.arena import ARENA
from uas_coverage_env.world.events import begin_events


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
    scene: NDArray[np.int64]
    """(N, 1) index in the pool of what it flies: 0, or its scene since that has changed."""
    changes: NDArray[np.int64]
    """(N, changes) see `SubEnvironments.changes`."""
    due: NDArray[np.bool_]
    """(N,) an event has happened at this sample, or a waypoint is asked for again."""


_scratch_of = lane_view(SCRATCH, sized_by=ARENA)
_look_of = lane_view(FIRST_OBSERVATION, sized_by=ARENA)


@kernel
def _is_due(state):
    """Whether anything happens at this sample that may change the scene."""
    due = False
    for e in range(state.events.shape[0]):
        due |= state.events[e].step == state.step[0]
    for w in range(state.due_step.shape[0]):
        due |= state.due_step[w] == state.step[0]
    return due


@cache
def _begin_with(features: tuple[MissionFeature, ...]) -> Any:
    """A function that begins the next mission of a lane."""
    begin_features = called_at_begin(features)

    @kernel
    def begin(pool, missions, lane):
        missions.ended[lane] = False
        missions.mission[lane] += 1
        missions.scene[lane, 0] = 0
        for k in range(missions.changes.shape[1]):
            missions.changes[lane, k] = -1
        arena, state = arena_of(pool.arenas, 0), state_of(missions.worlds, lane, pool.arenas, 0)
        copy_arrays(start_of(pool.starts, 0), state)
        seed, mission = missions.seed[lane], missions.mission[lane]
        begin_events(arena, state, seed, mission)
        begin_features(arena, state, seed, mission)
        learners = learners_of(missions.learners, lane, pool.arenas, 0)
        copy_arrays(first_learners_at(pool.learners, 0), learners)
        seen = _look_of(missions.first_observations, lane, pool.arenas, 0)
        copy_arrays(first_observation_at(pool.first_observations, 0), seen)
        for i in range(state.uas.shape[0]):
            missions.rewards[lane, i] = 0.0

    return begin


@cache
def _flies_with(features: tuple[MissionFeature, ...]) -> Any:
    begin = _begin_with(features)

    @kernel
    def flies(pool, missions, lane):
        """Whether a lane flies: it refuses an action, or begins a mission, where not."""
        learners = learners_of(missions.learners, lane, pool.arenas, missions.scene[lane, 0])
        missions.due[lane] = False
        missions.refused[lane] = first_not_finite(learners.asked) != ACCEPTED
        if missions.refused[lane]:
            return False
        if missions.ended[lane]:
            begin(pool, missions, lane)
            return False
        return True

    return flies


@kernel
def _decide(pool, missions, lane):
    """Begin a step with the commands that are written already."""
    scene = missions.scene[lane, 0]
    state = state_of(missions.worlds, lane, pool.arenas, scene)
    scratch = _scratch_of(missions.scratch, lane, pool.arenas, scene)
    begin_step(state, scratch.commands, scratch.outcome)


@cache
def _finish_with(observation: Blocks, reward: Terms) -> Any:
    """A function that rewards and observes a step that was flown."""
    pay_step = pay_step_with(compute_rewards_with(reward, calls=False))
    look_around = look_around_with(observe_one_with(observation, calls=False))

    @kernel
    def finish(pool, paying, observing, missions, lane):
        """Reward and observe a step that was flown."""
        scene = missions.scene[lane, 0]
        state = state_of(missions.worlds, lane, pool.arenas, scene)
        learners = learners_of(missions.learners, lane, pool.arenas, scene)
        scratch = _scratch_of(missions.scratch, lane, pool.arenas, scene)
        arena, tables = arena_of(pool.arenas, scene), tables_at(pool.tables, scene)
        seen = _look_of(missions.first_observations, lane, pool.arenas, scene)
        pay_step(arena, state, tables, learners, scratch, paying)
        look_around(arena, state, tables, learners, scratch, observing, False, seen.observation)
        flies = False
        for i in range(state.uas.shape[0]):
            missions.rewards[lane, i] = learners.amounts[i, REWARD]
            missions.acted[lane] += scratch.outcome[i].flew
            status = learners.report[i, STATUS]
            flies = flies or status == FLYING
            flies = flies or status == SWAPPING
        missions.ended[lane] = not flies or state.step[0] >= arena.rules[0].max_steps
        missions.due[lane] = _is_due(state)

    return finish


@cache
def _write_with(write: Any) -> Any:
    """A function that writes commands with the kernel of a kind of action."""

    @kernel
    def write_commands(pool, acting, missions, lane):
        # before the step: an action that cannot be flown is refused as one that is not finite
        scene = missions.scene[lane, 0]
        arena = arena_of(pool.arenas, scene)
        state = state_of(missions.worlds, lane, pool.arenas, scene)
        tables = tables_at(pool.tables, scene)
        learners = learners_of(missions.learners, lane, pool.arenas, scene)
        scratch = _scratch_of(missions.scratch, lane, pool.arenas, scene)
        if missions.ended[lane] or first_not_finite(learners.asked) != ACCEPTED:
            return
        for i in range(state.uas.shape[0]):
            begin_command(tables, learners, scratch, acting, i)
            if state.uas[i].status == FLYING:
                command = scratch.commands[i]
                values = scratch.values[i]
                seen = as_observed(state)
                write(arena, seen, tables, learners, i, acting.parameters, values, command)
                refuse_unflyable(arena, learners, acting, i, command)

    return write_commands


@cache  # to compile it again takes seconds
def _fly_with(
    features: tuple[MissionFeature, ...], nonlinear: bool, has_true_vehicles: bool
) -> Any:
    """Fly and judge a step with what the features do."""
    command, act, moved, judged, sensed = (
        called_at(point, features) for point in Point if point != Point.BEGIN
    )
    disturbed = any(feature.disturbs for feature in features)
    otherwise = nonlinear or has_true_vehicles or disturbed

    @kernel
    def fly_step(pool, missions, lane):
        scene = missions.scene[lane, 0]
        arena = arena_of(pool.arenas, scene)
        state = state_of(missions.worlds, lane, pool.arenas, scene)
        outcome = _scratch_of(missions.scratch, lane, pool.arenas, scene).outcome
        command(arena, state, outcome)
        if otherwise:
            if arena.rules[0].disturbed:
                write_all_inputs(arena, state, nonlinear, outcome)
                act(arena, state, outcome)
                check_all(arena, state, outcome)
            move_all(arena, state, nonlinear, outcome)
        else:
            fly_still(arena, state, outcome)
        moved(arena, state, outcome)
        judge(arena, state, nonlinear, outcome)
        judged(arena, state, outcome)
        sensed(arena, state, outcome)

    return fly_step


@cache
def _step_of(write: Any, flies: Any, fly: Any, finish: Any) -> Any:
    """The step of all lanes, made of these functions."""

    @cuda.jit
    def step(pool, acting, paying, observing, missions):
        lane = cuda.grid(1)  # pyrefly: ignore[missing-argument]
        if lane < missions.ended.shape[0]:
            write(pool, acting, missions, lane)
            if flies(pool, missions, lane):
                _decide(pool, missions, lane)
                fly(pool, missions, lane)
                finish(pool, paying, observing, missions, lane)

    return step


def step_with(
    settings: MissionSettings, features: tuple[MissionFeature, ...], has_true_vehicles: bool
) -> Any:
    """The step of all lanes, to be launched.

    Args:
        settings: How missions are flown and paid; all of its kernels are part of the step.
        features: What the mission has of what few missions have.
        has_true_vehicles: Whether others are flown than are believed.
    """
    return _step_of(
        _write_with(settings.kind.write),
        _flies_with(features),
        _fly_with(features, settings.dynamics == "nonlinear", has_true_vehicles),
        _finish_with(settings.observation, settings.reward),
    )


def new_missions(pool: ScenarioPool, num_envs: int, seed: int) -> Missions:
    """Missions at t = 0, on the host.

    Args:
        pool: Of one scenario.
        num_envs: N.
        seed: Of the first lane.
    """
    sizes = pool.sizes
    missions = Missions(
        STATE.zeros(sizes, lanes=num_envs),
        LEARNERS.zeros(sizes, lanes=num_envs),
        FIRST_OBSERVATION.zeros(sizes, lanes=num_envs),
        SCRATCH.zeros(sizes, lanes=num_envs),
        np.zeros((num_envs, sizes["U"])),
        np.zeros(num_envs, dtype=np.bool_),
        np.zeros(num_envs, dtype=np.bool_),
        np.zeros(num_envs, dtype=np.int64),
        np.arange(num_envs, dtype=np.uint64) + np.uint64(seed),
        np.full(num_envs, -1, dtype=np.int64),
        np.zeros((num_envs, 1), dtype=np.int64),
        np.zeros((num_envs, sizes["changes"]), dtype=np.int64),
        np.zeros(num_envs, dtype=np.bool_),
    )
    _begin_all(_begin_with(pool.features))(pool.arrays, missions)
    return missions


@cache
def _begin_all(begin: Any) -> Any:
    @kernel
    def begin_all(pool, missions):
        for lane in range(missions.ended.shape[0]):
            begin(pool, missions, lane)

    return begin_all
