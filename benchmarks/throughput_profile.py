"""Where the time of a step goes: its parts timed one by one, in compiled loops over many lanes.

Each part runs over the states that random missions in the village have come to, as it would in a
step, and does again what it has just done. Taken apart, the parts share less of what is in cache
and in registers, and every loop costs a little: their sum is not exactly the whole.
"""

import time
from collections.abc import Callable
from typing import Any

import numpy as np
from numba import njit
from rich.table import Table

from uas_coverage_env.env import CoverageBatch
from uas_coverage_env.env.actions import write_commands
from uas_coverage_env.env.kernel import step_learners
from uas_coverage_env.env.nearest import moving_obstacles, nearest_waypoints, others, waypoints
from uas_coverage_env.env.observation import observe
from uas_coverage_env.env.pool import tables_of
from uas_coverage_env.env.rewards import REWARD_TERMS, pay
from uas_coverage_env.env.surroundings import surroundings
from uas_coverage_env.vehicle import lpv_step
from uas_coverage_env.world import COMMAND_DTYPE, FLYING, OUTCOME_DTYPE, VELOCITY, advance
from uas_coverage_env.world.contacts import (
    count_breaches,
    judge_limits,
    judge_obstacles,
    judge_separation,
)
from uas_coverage_env.world.control import command_wrench
from uas_coverage_env.world.coverage import cover, land
from uas_coverage_env.world.pool import arena_of, state_of

N_LANES = 256
N_STEPS = 60
WHOLE = "the whole step"

compiled = njit(error_model="numpy")


@compiled
def _whole(arena, state, tables, lanes, commands, outcome, lane, weights, spare, row):
    ranges, scales, neighbours = tables
    step_learners(
        arena, state, VELOCITY, ranges, scales, neighbours, weights, False, False, False,
        lanes.asked[lane], lanes.targets[lane], lanes.candidates[lane], lanes.company[lane],
        commands[lane], outcome[lane], lanes.report[lane],
        arena.rules[0].max_steps, row,
    )  # fmt: skip


@compiled
def _world(arena, state, tables, lanes, commands, outcome, lane, weights, spare, row):
    advance(arena, state, commands[lane], False, False, False, outcome[lane])


@compiled
def _observation(arena, state, tables, lanes, commands, outcome, lane, weights, spare, row):
    observe(
        arena, state, tables[1], lanes.company[lane], state.status == FLYING, lanes.targets[lane],
        arena.rules[0].max_steps, lanes.candidates[lane], row,
    )  # fmt: skip


@compiled
def _actions(arena, state, tables, lanes, commands, outcome, lane, weights, spare, row):
    write_commands(
        state, VELOCITY, tables[0], lanes.asked[lane], lanes.candidates[lane], lanes.targets[lane],
        commands[lane],
    )  # fmt: skip


@compiled
def _inner_loop(arena, state, tables, lanes, commands, outcome, lane, weights, spare, row):
    for i in range(state.status.shape[0]):
        if state.status[i] == FLYING:
            command = commands[lane, i]
            reference = state.reference[i]
            command_wrench(arena.vehicles[i], state.x[i], reference, command, spare)


@compiled
def _model(arena, state, tables, lanes, commands, outcome, lane, weights, spare, row):
    for i in range(state.status.shape[0]):
        if state.status[i] == FLYING:
            lpv_step(arena.vehicles[i], state.x[i], outcome[lane, i].u, spare)


@compiled
def _obstacles(arena, state, tables, lanes, commands, outcome, lane, weights, spare, row):
    judge_obstacles(arena, state, outcome[lane])


@compiled
def _other_contacts(arena, state, tables, lanes, commands, outcome, lane, weights, spare, row):
    judge_separation(arena, state, outcome[lane])
    judge_limits(arena, state, outcome[lane])
    count_breaches(arena, state, outcome[lane])


@compiled
def _coverage(arena, state, tables, lanes, commands, outcome, lane, weights, spare, row):
    cover(arena, state, outcome[lane])
    land(arena, state, outcome[lane])


@compiled
def _reward(arena, state, tables, lanes, commands, outcome, lane, weights, spare, row):
    pay(arena, state, commands[lane], outcome[lane], weights, False, lanes.report[lane])


@compiled
def _nearest(arena, state, tables, lanes, commands, outcome, lane, weights, spare, row):
    for i in range(state.status.shape[0]):
        if state.status[i] == FLYING:
            nearest_waypoints(arena, state, i, lanes.candidates[lane, i])


@compiled
def _waypoints(arena, state, tables, lanes, commands, outcome, lane, weights, spare, row):
    for i in range(state.status.shape[0]):
        if state.status[i] == FLYING:
            waypoints(
                arena, state, tables[1][i], lanes.company[lane], i, lanes.targets[lane],
                lanes.candidates[lane, i], row[i], 0,
            )  # fmt: skip


@compiled
def _surroundings(arena, state, tables, lanes, commands, outcome, lane, weights, spare, row):
    for i in range(state.status.shape[0]):
        if state.status[i] == FLYING:
            surroundings(arena, state, i, row[i], 0)


@compiled
def _movers(arena, state, tables, lanes, commands, outcome, lane, weights, spare, row):
    for i in range(state.status.shape[0]):
        if state.status[i] == FLYING:
            k = others(arena, state, tables[1][i], i, row[i], 0)
            moving_obstacles(arena, state, tables[1][i], i, row[i], k)


PARTS: dict[str, Callable[..., None]] = {
    "actions into commands": _actions,
    "inner loop": _inner_loop,
    "LPV model and battery": _model,
    "contacts with obstacles": _obstacles,
    "other contacts and breaches": _other_contacts,
    "coverage and landing": _coverage,
    "reward": _reward,
    "observation: nearest waypoints": _nearest,
    "observation: their features": _waypoints,
    "observation: rays and clearances": _surroundings,
    "observation: other movers": _movers,
    "the whole observation": _observation,
    "the whole world": _world,
    WHOLE: _whole,
}
"""In the order in which they are timed; from the whole world on, the states change."""


def _over_lanes(part: Callable[..., None]) -> Callable[..., None]:
    @compiled
    def run(arenas, tables, worlds, lanes, commands, outcome, weights, spare, observation):
        arena = arena_of(arenas, 0)
        scales = tables_of(tables, 0)
        n_uas, n_waypoints = arena.uas.shape[0], arena.waypoints.shape[0]
        for lane in range(observation.shape[0]):
            state = state_of(worlds, lane, n_uas, n_waypoints)
            part(
                arena, state, scales, lanes, commands, outcome, lane, weights, spare,
                observation[lane],
            )  # fmt: skip

    return run


def nanoseconds(repeats: int, n_lanes: int = N_LANES) -> dict[str, float]:
    """Time of each part per agent-step, the quickest of some repeats [ns]."""
    batch = CoverageBatch(n_lanes)
    batch.reset(0)
    rng = np.random.default_rng(0)
    shape = batch.lanes.asked.shape
    for _ in range(N_STEPS):
        batch.step(rng.uniform(-1, 1, shape).astype(np.float32))
    fleet = batch.worlds.status.shape
    arguments: tuple[Any, ...] = (
        batch.pool.arenas, batch.pool.tables, batch.worlds, batch.lanes,
        np.zeros(fleet, COMMAND_DTYPE), np.zeros(fleet, OUTCOME_DTYPE),
        np.ones(len(REWARD_TERMS)), np.zeros(14), batch.observation,
    )  # fmt: skip
    # once, so that there are outcomes for the parts to go on from
    _over_lanes(PARTS[WHOLE])(*arguments)
    result = {}
    for name, part in PARTS.items():
        run = _over_lanes(part)
        run(*arguments)
        best_s = np.inf
        for _ in range(repeats):
            flying = int(batch.flying.sum())
            start_s = time.process_time()
            for _ in range(4):
                run(*arguments)
            best_s = min(best_s, (time.process_time() - start_s) / 4 / flying)
        result[name] = best_s * 1e9
    return result


def profile_table(repeats: int) -> Table:
    """The times as a table, with shares of the whole step."""
    times_ns = nanoseconds(max(repeats, 20))
    table = Table("part", "ns per agent-step", "share")
    for name, time_ns in times_ns.items():
        table.add_row(name, f"{time_ns:.0f}", f"{time_ns / times_ns[WHOLE]:.0%}")
    return table
