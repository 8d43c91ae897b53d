"""One step of many missions on a GPU: the stages of a batch's step, by a thread a UAS or a mission.

Numba compiles the same functions for a GPU that it compiles for the processor. It calls nothing at
an address there, so all kernels of observation, reward, action and features are part of the step,
and guidance and return mode where they are asked for. What cannot run there is what makes arrays:
the safety filter, and the search for a way past overhangs.

A step is a few launches, one after the other. What each UAS does whatever the others do (`EachUas`,
and what it observes) has a thread for each UAS; the rest has one for each mission.
"""

from collections.abc import Mapping
from functools import cache
from itertools import groupby
from typing import Annotated, Any, NamedTuple

import numpy as np
from numba import cuda
from numpy.typing import NDArray

from uas_coverage_env.autopilot.room import ROOM, Room
from uas_coverage_env.compiled.kernels import in_turn, inlined_kernel, kernel
from uas_coverage_env.compiled.memory import Memory
from uas_coverage_env.compiled.views import Handover, lane_view, rows_view
from uas_coverage_env.entities.state import FLYING, as_observed
from uas_coverage_env.env.batch.kernel import scratch_of
from uas_coverage_env.env.batch.lane import finish_lane_with, keep_lane_with
from uas_coverage_env.env.batch.memory import FLY, NEXT_STEP, MissionPool, Missions, new_missions
from uas_coverage_env.env.batch.pool import ScenarioPool, learners_of, tables_at
from uas_coverage_env.env.episode.act import begin_command, first_not_finite, refuse_unflyable
from uas_coverage_env.env.episode.memory import ACTING, OBSERVING, PAYING, Acting, Observing, Paying
from uas_coverage_env.env.episode.observe import LOOK, looks_with
from uas_coverage_env.env.episode.pay import compute_rewards_with
from uas_coverage_env.env.episode.step import ACCEPTED, STAGE, Rules, stages_of
from uas_coverage_env.simulation.on_gpu import begin_features_of, stages_on_gpu
from uas_coverage_env.simulation.pool import arena_of, state_of
from uas_coverage_env.simulation.step import EachUas
from uas_coverage_env.world.arena import ARENA


class Marks(NamedTuple):
    """What is told of lanes beside what a batch tells."""

    flies: Annotated[NDArray[np.bool_], "L"]
    """It flies in this step."""
    ended: Annotated[NDArray[np.bool_], "L"]
    """The mission is over; the next step begins another and flies nothing."""
    refused: Annotated[NDArray[np.bool_], "L"]
    """An action was none: nothing was flown; or its kernel wrote what cannot be flown."""
    acted: Annotated[NDArray[np.int64], "L"]
    """Agent-steps flown since the beginning."""
    due: Annotated[NDArray[np.bool_], "L"]
    """An event has happened at this sample, or a waypoint is asked for again."""


MARKS = Memory(Marks)


class Given(NamedTuple):
    """What all launches of a step work on."""

    pool: MissionPool
    missions: Missions
    marks: Marks
    acting: Acting
    paying: Paying
    observing: Observing
    rooms: Room
    """Of guidance, with an axis of all UAS of all lanes in front; of none without it."""
    observation: NDArray[np.float32]
    """(L, U, V)."""


def _example() -> Given:
    pool = ScenarioPool("open_field")
    none = dict.fromkeys((*ACTING.names, *PAYING.names, *OBSERVING.names), 0)
    missions, marks = new_missions(pool.sizes, 1, 1), MARKS.zeros({"L": 1})
    seen = np.zeros((1, 1, 1), np.float32)
    return Given(
        pool.arrays, missions, marks, ACTING.zeros(none), PAYING.zeros(none),
        OBSERVING.zeros(none), new_rooms(pool.sizes, 0), seen,
    )  # fmt: skip


def new_rooms(sizes: Mapping[str, int], n: int) -> Room:
    """For n UAS, whose missions have no overhangs."""
    return ROOM.zeros({**sizes, "places": 0, "cells": 0}, lanes=n)


_room_of = lane_view(ROOM, sized_by=ARENA)

GIVEN = Handover(_example)
"""How kernels are given it: numba takes a millisecond to hand over a hundred arrays."""

_take = GIVEN.take


class Launch(NamedTuple):
    """A part of a step."""

    kernel: Any
    """To be launched with what `GIVEN` says of `Given`."""
    of_uas: bool
    """It takes a thread for each UAS of each mission; else one for each mission."""


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
def _write_command_with(write: Any, own: bool) -> Any:
    """`act.write_command_with` of one kernel, of a kind of the version or of one's own."""

    @inlined_kernel
    def write_command(arena, state, tables, learners, scratch, acting, i):
        begin_command(tables, learners, scratch, acting, i)
        if not own or state.uas[i].status == FLYING:
            command, values = scratch.commands[i], scratch.values[i]
            write(arena, state, tables, learners, i, acting.parameters, values, command)
            if own:
                refuse_unflyable(arena, learners, acting, i, command)

    return write_command


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


PART = "given, lane, i"
"""The arguments of a part of a step: `Given`, the mission, and the UAS of a part of UAS."""


@cache
def _begin_with(choices: int, width: int) -> Any:
    """The part of a mission before it flies."""
    is_refused, keep_lane = _is_refused_with(choices), keep_lane_with(width, fetches=False)

    @inlined_kernel
    def begin(given, lane, i):
        pool, missions, marks = given.pool, given.missions, given.marks
        flies = missions.lanes.orders[lane] == FLY
        s = missions.lanes.scene[lane]
        asked = learners_of(missions.learners, lane, pool.arenas, s).asked
        marks.due[lane] = False
        marks.refused[lane] = flies and is_refused(asked)
        marks.flies[lane] = flies and not marks.refused[lane]
        if marks.flies[lane]:
            keep_lane(pool, missions, lane, given.observation, given.observation)

    return begin


@cache
def _fly_with(stages: tuple[Any, ...], nonlinear: bool, guided: bool) -> Any:
    """The part of a mission, or of a UAS, that flies through stages one after the other."""
    of_uas = isinstance(stages[0], EachUas)
    kernels = [stage.kernel for stage in stages] if of_uas else stages
    run = in_turn(kernels, f"{STAGE}, i" if of_uas else STAGE)

    @inlined_kernel
    def fly(given, lane, i):
        if not given.marks.flies[lane]:
            return
        pool, missions = given.pool, given.missions
        s = missions.lanes.scene[lane]
        arena, tables = arena_of(pool.arenas, s), tables_at(pool.tables, s)
        state = state_of(missions.worlds, lane, pool.arenas, s)
        learners = learners_of(missions.learners, lane, pool.arenas, s)
        scratch = scratch_of(missions.scratch, lane, pool.arenas, s)
        room = None
        if guided:
            k = lane * given.observation.shape[1] + i
            room = _room_of(given.rooms, k, pool.arenas, s)
        rules = Rules(given.acting, nonlinear, room, None, given.paying, given.observing)
        if not of_uas:
            run(arena, state, tables, learners, scratch, rules)
        elif i < state.uas.shape[0]:
            run(arena, state, tables, learners, scratch, rules, i)

    return fly


@cache
def _finish_with(begin_features: Any, width: int, changes: bool) -> Any:
    """The part of a mission that has flown, or begins."""
    finish_lane = finish_lane_with(begin_features, width)

    @inlined_kernel
    def finish(given, lane, i):
        pool, missions, marks = given.pool, given.missions, given.marks
        lanes, observation = missions.lanes, given.observation
        if marks.refused[lane]:
            return
        s = lanes.scene[lane]
        rules = Rules(given.acting, 0, None, None, given.paying, given.observing)
        finish_lane(
            pool, missions, rules, lane, lanes.orders[lane], NEXT_STEP, observation, observation
        )
        marks.ended[lane] = lanes.terminated[lane] or lanes.truncated[lane]
        if marks.flies[lane]:
            # as a kind of action does that wrote what cannot be flown
            asked = learners_of(missions.learners, lane, pool.arenas, s).asked
            marks.refused[lane] = first_not_finite(asked) != ACCEPTED
            outcome = scratch_of(missions.scratch, lane, pool.arenas, s).outcome
            for k in range(outcome.shape[0]):
                marks.acted[lane] += outcome[k].flew
            if changes:
                marks.due[lane] = _is_due(state_of(missions.worlds, lane, pool.arenas, s))

    return finish


@cache
def _look_with(looks: tuple[Any, ...], width: int) -> Any:
    """The part of a UAS that looks around, after `finish`, which begins no mission that flew."""
    run = in_turn(looks, LOOK)

    @inlined_kernel
    def look(given, lane, i):
        pool, missions = given.pool, given.missions
        s = missions.lanes.scene[lane]
        n_uas = arena_of(pool.arenas, s).uas.shape[0]
        if i < n_uas and given.marks.flies[lane] and missions.scratch.looks[lane, i]:
            arena, tables = arena_of(pool.arenas, s), tables_at(pool.tables, s)
            seen = as_observed(state_of(missions.worlds, lane, pool.arenas, s))
            learners = learners_of(missions.learners, lane, pool.arenas, s)
            rows = rows_view(given.observation, lane, (n_uas, width))
            run(arena, seen, tables, learners, given.observing, rows, i)

    return look


def is_guided(pool: ScenarioPool) -> bool:
    """Whether a step needs guidance."""
    settings = pool.settings
    return pool.actions.kind.goes_to or settings.return_mode or pool.goes_home


def step_with(pool: ScenarioPool) -> tuple[Launch, ...]:
    """The step of all lanes, to be launched one part after the other.

    Observations are written where those of the step before lie. All kernels of the settings are
    part of the step.

    Args:
        pool: What is flown.
    """
    settings, features, kind = pool.settings, pool.features, pool.actions.kind
    nonlinear, width = settings.dynamics == "nonlinear", settings.observation_size
    write = kind.write
    own = all(write is not each.write for each in settings.version.actions)
    stages = stages_of(
        _write_command_with(write, own),
        stages_on_gpu(features, nonlinear or pool.sizes["true vehicles"] > 0, settings.return_mode),
        compute_rewards_with(settings.reward, calls=False),
        looks_with(settings.observation, calls=False),
    )
    parts = [(False, _begin_with(kind.choices, width))]
    for of_uas, group in groupby(stages.flight, _is_of_uas):
        parts.append((of_uas, _fly_with(tuple(group), nonlinear, is_guided(pool))))
    together = groupby(parts, lambda part: part[0])
    launches = [_launch(of_uas, tuple(run for _, run in group)) for of_uas, group in together]
    finish = _finish_with(begin_features_of(features), width, pool.changes)
    # apart from one another they need fewer registers, so that more UAS look at once
    looks = (stages.looks[:2], *((look,) for look in stages.looks[2:]))
    apart = [_launch(True, (_look_with(each, width),)) for each in looks]
    return (*launches, _launch(False, (finish,)), *apart)


def _is_of_uas(stage: Any) -> bool:
    return isinstance(stage, EachUas)


@cache  # to compile it again takes half a minute
def _launch(of_uas: bool, parts: tuple[Any, ...]) -> Launch:
    run = in_turn(parts, PART)

    @kernel
    def part(numbers, thread):
        given = _take(numbers)
        n_lanes, n_uas = given.observation.shape[:2]
        threads = n_uas if of_uas else 1
        if thread < n_lanes * threads:
            run(given, thread // threads, thread % threads)

    @cuda.jit
    def launch(numbers):
        part(numbers, cuda.grid(1))  # pyrefly: ignore[missing-argument]

    return Launch(launch, of_uas)


def _take_actions(given, asked):
    lane = cuda.grid(1)  # pyrefly: ignore[missing-argument]
    if lane < asked.shape[0]:
        for k in range(asked.shape[1]):
            asked[lane, k] = given[lane, k]


take_actions: Any = cuda.jit(_take_actions)
"""Copies actions of any floats, to be launched; numba's own way waits until it is done."""
