"""One step of many missions on a GPU: one thread flies one mission, by the code of a batch.

Numba compiles the same functions for a GPU that it compiles for the processor. It calls nothing at
an address there, so all kernels of observation, reward, action and features are part of the step.
What cannot run there is what makes arrays: guidance, return mode and safety filter.
"""

from functools import cache
from typing import Annotated, Any, NamedTuple

import numpy as np
from numba import cuda
from numpy.typing import NDArray

from uas_coverage_env.compiled.kernels import in_turn, inlined_kernel, kernel
from uas_coverage_env.compiled.memory import Memory
from uas_coverage_env.compiled.views import rows_view
from uas_coverage_env.entities.state import FLYING, as_observed
from uas_coverage_env.env.actions.kind import ActionKind
from uas_coverage_env.env.batch.kernel import scratch_of
from uas_coverage_env.env.batch.lane import finish_lane_with, keep_lane_with
from uas_coverage_env.env.batch.memory import FLY, NEXT_STEP
from uas_coverage_env.env.batch.pool import learners_of, tables_at
from uas_coverage_env.env.episode.act import begin_command, first_not_finite, refuse_unflyable
from uas_coverage_env.env.episode.observe import LOOK, looks_with
from uas_coverage_env.env.episode.pay import compute_rewards_with
from uas_coverage_env.env.episode.settings import MissionSettings
from uas_coverage_env.env.episode.step import ACCEPTED, STAGE, Rules, Stages, stages_of
from uas_coverage_env.features.feature import MissionFeature
from uas_coverage_env.simulation.on_gpu import begin_features_of, stages_on_gpu
from uas_coverage_env.simulation.pool import arena_of, state_of


class Marks(NamedTuple):
    """What is told of lanes beside what a batch tells."""

    ended: Annotated[NDArray[np.bool_], "L"]
    """The mission is over; the next step begins another and flies nothing."""
    refused: Annotated[NDArray[np.bool_], "L"]
    """An action was none: nothing was flown; or its kernel wrote what cannot be flown."""
    acted: Annotated[NDArray[np.int64], "L"]
    """Agent-steps flown since the beginning."""
    due: Annotated[NDArray[np.bool_], "L"]
    """An event has happened at this sample, or a waypoint is asked for again."""


MARKS = Memory(Marks)


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
def _write_commands_with(write: Any, own: bool) -> Any:
    """`act.write_commands_with` of one kernel, of a kind of the version or of one's own."""

    @inlined_kernel
    def write_commands(arena, state, tables, learners, scratch, acting):
        for i in range(scratch.commands.shape[0]):
            begin_command(tables, learners, scratch, acting, i)
            if not own or state.uas[i].status == FLYING:
                command, values = scratch.commands[i], scratch.values[i]
                write(arena, state, tables, learners, i, acting.parameters, values, command)
                if own:
                    refuse_unflyable(arena, learners, acting, i, command)

    return write_commands


@cache
def _fly_lane_with(stages: Stages, begin_features: Any, width: int) -> Any:
    """What one lane does in a step; a thread has no others to fly with it."""
    fly, look = in_turn(stages.flight, STAGE), in_turn(stages.looks, LOOK)
    keep_lane = keep_lane_with(width, fetches=False)
    finish_lane = finish_lane_with(begin_features, width)

    @inlined_kernel
    def fly_lane(pool, missions, rules, lane, order, observation):
        if order == FLY:
            keep_lane(pool, missions, lane, observation, observation)
            s = missions.lanes.scene[lane]
            arena, tables = arena_of(pool.arenas, s), tables_at(pool.tables, s)
            state = state_of(missions.worlds, lane, pool.arenas, s)
            learners = learners_of(missions.learners, lane, pool.arenas, s)
            scratch = scratch_of(missions.scratch, lane, pool.arenas, s)
            fly(arena, state, tables, learners, scratch, rules)
            rows = rows_view(observation, lane, (arena.uas.shape[0], width))
            seen = as_observed(state)
            look(arena, seen, tables, learners, rules.observing, scratch.looks, rows)
        finish_lane(pool, missions, rules, lane, order, NEXT_STEP, observation, observation)

    return fly_lane


@cache
def _is_refused_with(choices: int) -> Any:
    """Whether one of the actions (U, size) of a lane is none."""

    @kernel
    def is_refused(asked):
        refused = first_not_finite(asked) != ACCEPTED
        for i in range(asked.shape[0]):
            if choices > 0 and not refused:
                chosen = asked[i, 0]
                refused = not 0.0 <= chosen < choices or chosen != int(chosen)
        return refused

    return is_refused


def step_with(
    settings: MissionSettings,
    kind: ActionKind,
    features: tuple[MissionFeature, ...],
    otherwise: bool,
    changes: bool,
) -> Any:
    """The step of all lanes, to be launched.

    Args:
        settings: How missions are flown and paid; all of its kernels are part of the step.
        kind: Of the actions.
        features: What the mission has of what few missions have.
        otherwise: Whether others are flown than are believed.
        changes: Whether the scene may change.

    Returns:
        `step(pool, missions, marks, acting, paying, observing, observation)`: as
        `step_batch`, and observations are written where those of the step before lie.
    """
    nonlinear, width = settings.dynamics == "nonlinear", settings.observation_size
    write = kind.write
    own = all(write is not each.write for each in settings.version.actions)
    stages = stages_of(
        _write_commands_with(write, own),
        stages_on_gpu(features, nonlinear or otherwise),
        compute_rewards_with(settings.reward, calls=False),
        looks_with(settings.observation, calls=False),
    )
    fly_lane = _fly_lane_with(stages, begin_features_of(features), width)
    is_refused = _is_refused_with(kind.choices)
    return _launched(fly_lane, is_refused, nonlinear, changes)


@cache  # to compile it again takes minutes
def _launched(fly_lane: Any, is_refused: Any, nonlinear: bool, changes: bool) -> Any:
    @kernel
    def step_lane(pool, missions, marks, acting, paying, observing, observation, lane):
        lanes = missions.lanes
        order = lanes.orders[lane]
        scene = lanes.scene[lane]
        asked = learners_of(missions.learners, lane, pool.arenas, scene).asked
        marks.due[lane] = False
        marks.refused[lane] = order == FLY and is_refused(asked)
        if marks.refused[lane]:
            return
        rules = Rules(acting, nonlinear, None, None, paying, observing)
        fly_lane(pool, missions, rules, lane, order, observation)
        marks.ended[lane] = lanes.terminated[lane] or lanes.truncated[lane]
        if order == FLY:
            # as a kind of action does that wrote what cannot be flown
            marks.refused[lane] = first_not_finite(asked) != ACCEPTED
            outcome = scratch_of(missions.scratch, lane, pool.arenas, scene).outcome
            for i in range(outcome.shape[0]):
                marks.acted[lane] += outcome[i].flew
            if changes:
                marks.due[lane] = _is_due(state_of(missions.worlds, lane, pool.arenas, scene))

    @cuda.jit
    def step(pool, missions, marks, acting, paying, observing, observation):
        lane = cuda.grid(1)  # pyrefly: ignore[missing-argument]
        if lane < marks.ended.shape[0]:
            step_lane(pool, missions, marks, acting, paying, observing, observation, lane)

    return step


def _take_actions(given, asked):
    lane = cuda.grid(1)  # pyrefly: ignore[missing-argument]
    if lane < asked.shape[0]:
        for k in range(asked.shape[1]):
            asked[lane, k] = given[lane, k]


take_actions: Any = cuda.jit(_take_actions)
"""Copies actions of any floats, to be launched; numba's own way waits until it is done."""
