"""Where the time of a step goes: its parts timed one by one, in compiled loops over many lanes.

Each part runs over the states that random missions in the village have come to, as it would in a
step, and does again what it has just done. Taken apart, the parts share less of what is in cache
and in registers, and every loop costs a little: their sum is not exactly the whole.
"""

import time
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numba import njit
from rich.table import Table

from uas_coverage_env.autopilot.control import command_wrench
from uas_coverage_env.compiled.views import lane_view, rows_view, slice_view
from uas_coverage_env.entities.state import FLYING
from uas_coverage_env.env import CoverageBatch
from uas_coverage_env.env.batch.pool import learners_of, tables_at
from uas_coverage_env.env.episode.act import acting_of, write_commands_with
from uas_coverage_env.env.episode.memory import SCRATCH, Learners, Scratch
from uas_coverage_env.env.episode.observe import noted, observe_one_with, observing_of
from uas_coverage_env.env.episode.pay import compute_rewards_with, paying_of
from uas_coverage_env.env.episode.step import Rules, step_learners_with
from uas_coverage_env.env.observation import OBSERVATION_SIZE, ObservationBlock
from uas_coverage_env.env.observation.nearest import nearest_waypoints
from uas_coverage_env.env.versions import V0
from uas_coverage_env.simulation.flight import feature_code
from uas_coverage_env.simulation.pool import arena_of, state_of
from uas_coverage_env.simulation.step import advance
from uas_coverage_env.vehicle import lpv_step
from uas_coverage_env.vehicle.layout import N_STATES
from uas_coverage_env.world.arena import ARENA
from uas_coverage_env.world.contacts import (
    check_fence_and_battery,
    check_limits,
    check_obstacles,
    check_separation,
    count_breaches,
)
from uas_coverage_env.world.coverage import cover, land

N_LANES = 256
N_STEPS = 60
WHOLE = "the whole step"

_scratch_of = lane_view(SCRATCH, sized_by=ARENA)

compiled = njit(error_model="numpy")

NO_ASSISTANTS = np.zeros(0, np.int64)
"""No assistants."""

write_commands = write_commands_with(V0.actions)
compute_rewards = compute_rewards_with(V0.reward)
observe_one = observe_one_with(V0.observation)
step_learners = step_learners_with(V0)


class View(NamedTuple):
    """What `step_learners` needs of one lane."""

    learners: Learners
    scratch: Scratch


@compiled
def _whole(arena, state, tables, view, rules, spare, row):
    step_learners(arena, state, tables, view.learners, view.scratch, rules, False, row)


@compiled
def _world(arena, state, tables, view, rules, spare, row):
    advance(arena, state, view.scratch.commands, False, NO_ASSISTANTS, None, view.scratch.outcome)


@compiled
def _observation(arena, state, tables, view, rules, spare, row):
    for i in range(state.uas.shape[0]):
        if state.uas[i].status == FLYING:
            observe_one(arena, state, tables, view.learners, rules.observing, i, row[i])


@compiled
def _actions(arena, state, tables, view, rules, spare, row):
    write_commands(arena, state, tables, view.learners, view.scratch, rules.acting)


@compiled
def _inner_loop(arena, state, tables, view, rules, spare, row):
    for i in range(state.uas.shape[0]):
        if state.uas[i].status == FLYING:
            command = view.scratch.commands[i]
            reference = state.uas[i].reference_mps[:]
            command_wrench(arena.vehicles[i], state.x[i], reference, command, spare)


@compiled
def _model(arena, state, tables, view, rules, spare, row):
    for i in range(state.uas.shape[0]):
        if state.uas[i].status == FLYING:
            lpv_step(arena.vehicles[i], state.x[i], view.scratch.outcome[i].u, spare)


@compiled
def _obstacles(arena, state, tables, view, rules, spare, row):
    check_obstacles(arena, state, view.scratch.outcome)


@compiled
def _other_contacts(arena, state, tables, view, rules, spare, row):
    check_separation(arena, state, view.scratch.outcome)
    check_fence_and_battery(arena, state, view.scratch.outcome)
    count_breaches(arena, state, view.scratch.outcome)
    check_limits(arena, state, False, view.scratch.outcome)


@compiled
def _coverage(arena, state, tables, view, rules, spare, row):
    cover(arena, state, state.step[0] + 1, view.scratch.outcome)
    land(arena, state, view.scratch.outcome)


@compiled
def _reward(arena, state, tables, view, rules, spare, row):
    compute_rewards(arena, state, tables, view.learners, view.scratch, rules.paying)


@compiled
def _nearest(arena, state, tables, view, rules, spare, row):
    for i in range(state.uas.shape[0]):
        if state.uas[i].status == FLYING:
            nearest_waypoints(arena, state, i, view.learners.candidates[i])


def _block(block: ObservationBlock, column: int) -> Any:
    """A block, with what it needs that no block before it has noted."""
    notes = tuple(set(block.needs) - _noted)
    _noted.update(notes)
    write, size, note = block.write, block.size, noted(notes)

    @compiled
    def write_block(arena, state, tables, view, rules, spare, row):
        for i in range(state.uas.shape[0]):
            if state.uas[i].status == FLYING:
                note(arena, state, tables, view.learners, i)
                columns = slice_view(row[i], column, size)
                write(arena, state, tables, view.learners, i, rules.observing.parameters, columns)

    return write_block


_noted: set[Any] = set()
_columns = np.cumsum([0, *(block.size for block in V0.observation)]).tolist()

PARTS: dict[str, Callable[..., None]] = {
    "actions into commands": _actions,
    "inner loop": _inner_loop,
    "LPV model and battery": _model,
    "contacts with obstacles": _obstacles,
    "other contacts and breaches": _other_contacts,
    "coverage and landing": _coverage,
    "reward": _reward,
    "observation: nearest waypoints": _nearest,
    **{
        f"observation: {block.name.replace('_', ' ')}": _block(block, column)
        for block, column in zip(V0.observation, _columns, strict=False)
    },
    "the whole observation": _observation,
    "the whole world": _world,
    WHOLE: _whole,
}
"""In the order in which they are timed, each from the same states."""


def _over_lanes(timed: Any) -> Callable[..., None]:
    # part of the loop, as it is part of a step: to call it with a hundred words takes as long
    timed = njit(error_model="numpy", forceinline=True)(timed.py_func)

    @compiled
    def run(pool, missions, scratch, rules, spare, observation):
        arena = arena_of(pool.arenas, 0)
        tables = tables_at(pool.tables, 0)
        n_uas = arena.uas.shape[0]
        for lane in range(observation.shape[0]):
            state = state_of(missions.worlds, lane, pool.arenas, 0)
            # views that count no references, as in the batch
            view = View(
                learners_of(missions.learners, lane, pool.arenas, 0),
                _scratch_of(scratch, lane, pool.arenas, 0),
            )
            row = rows_view(observation, lane, (n_uas, OBSERVATION_SIZE))
            timed(arena, state, tables, view, rules, spare, row)

    return run


def nanoseconds(repeats: int, n_lanes: int = N_LANES) -> dict[str, float]:
    """Time of each part per agent-step, the quickest of some repeats [ns]."""
    batch = CoverageBatch(n_lanes)
    batch.reset(0)
    rng = np.random.default_rng(0)
    shape = batch.learners.asked.shape
    for _ in range(N_STEPS):
        batch.step(rng.uniform(-1, 1, shape).astype(np.float32))
    paying = paying_of(V0.reward, np.ones(len(V0.reward)), V0.reward)
    acting = acting_of(V0.actions[0], V0.actions)
    observing = observing_of(V0.observation, V0.observation)
    rules = Rules(
        acting, False, NO_ASSISTANTS, feature_code((), otherwise=False), paying, observing
    )
    arguments: tuple[Any, ...] = (
        batch.pool.arrays, batch.missions,
        SCRATCH.zeros(batch.pool.sizes, lanes=n_lanes), rules, np.zeros(N_STATES),
        batch.observation,
    )  # fmt: skip
    # once, so that there are outcomes for the parts to go on from
    _over_lanes(PARTS[WHOLE])(*arguments)
    result = {}
    flying = int(batch.flying.sum())
    kept = batch.worlds.copy()
    for name, timed in PARTS.items():
        run = _over_lanes(timed)
        run(*arguments)
        best_s = np.inf
        for _ in range(repeats):
            for array, before in zip(batch.worlds, kept, strict=True):
                array[:] = before
            start_s = time.process_time()
            run(*arguments)
            best_s = min(best_s, (time.process_time() - start_s) / flying)
        result[name] = best_s * 1e9
    return result


def profile_table(repeats: int) -> Table:
    """The times as a table, with shares of the whole step."""
    times_ns = nanoseconds(max(repeats, 60))
    table = Table("part", "ns per agent-step", "share")
    for name, time_ns in times_ns.items():
        table.add_row(name, f"{time_ns:.0f}", f"{time_ns / times_ns[WHOLE]:.0%}")
    return table
