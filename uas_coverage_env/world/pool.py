"""Many scenarios end to end in a few arrays, for kernels that fly another one in every lane."""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.borrow import borrow
from uas_coverage_env.kernels import inlined_kernel, lending_kernel
from uas_coverage_env.scenario import Scenario
from uas_coverage_env.world.arena import N_WAYPOINT_COLUMNS, Arena, build_arena
from uas_coverage_env.world.boxes import N_COLUMNS, padded
from uas_coverage_env.world.outcome import OUTCOME_DTYPE
from uas_coverage_env.world.simulation import initial_state
from uas_coverage_env.world.state import FLYING, WorldState
from uas_coverage_env.world.step import begin_mission

_SPANNED = (*Arena._fields, "start_x", "start_uncovered")

SPANS_DTYPE = np.dtype(
    (np.record, np.dtype([*((field, "i8", (2,)) for field in _SPANNED), ("n_samples", "i8")]))
)
"""Where a scenario lies in each array of a pool: its first row, and the row after its last."""


class ArenaPool(NamedTuple):
    """The arenas of S scenarios, field by field end to end; equal blocks are stored once.

    Fields that have as many axes as in `Arena` are its rows; the others are flat.
    """

    vehicles: NDArray[np.void]
    uas: NDArray[np.void]
    obstacles: NDArray[np.void]
    obstacle_columns: NDArray[np.float64]
    """Flat."""
    normals: NDArray[np.float64]
    offsets_m: NDArray[np.float64]
    moving: NDArray[np.void]
    moving_path_m: NDArray[np.float64]
    """Flat."""
    moving_velocity_mps: NDArray[np.float64]
    """Flat."""
    waypoints: NDArray[np.void]
    waypoint_columns: NDArray[np.float64]
    """Flat."""
    rules: NDArray[np.void]
    nodes_m: NDArray[np.float64]
    node_distance_m: NDArray[np.float64]
    """Flat."""
    start_x: NDArray[np.float64]
    """(all UAS, 14) states at t = 0."""
    start_uncovered: NDArray[np.bool_]
    """(all waypoints,) what lies out of reach of the starts."""
    spans: NDArray[np.void]
    """(S,) of SPANS_DTYPE."""


_FLAT = (
    "obstacle_columns",
    "waypoint_columns",
    "moving_path_m",
    "moving_velocity_mps",
    "node_distance_m",
)


def end_to_end(blocks: Sequence[NDArray]) -> tuple[NDArray, NDArray[np.int64]]:
    """Blocks of rows as one array; equal blocks are stored once.

    Args:
        blocks: Arrays that differ in their first axis only; at least one.

    Returns:
        (N, ...) all rows, and for each block (B, 2) its first row and the row after its last.
    """
    spans = np.zeros((len(blocks), 2), dtype=np.int64)
    first_rows: dict[bytes, int] = {}
    kept = []
    n_rows = 0
    for span, block in zip(spans, blocks, strict=True):
        content = block.tobytes()
        if content not in first_rows:
            first_rows[content] = n_rows
            kept.append(block)
            n_rows += len(block)
        span[0] = first_rows[content]
        span[1] = span[0] + len(block)
    # not np.concatenate: it would repack aligned records
    rows = np.empty((n_rows, *blocks[0].shape[1:]), dtype=blocks[0].dtype)
    filled = 0
    for block in kept:
        rows[filled : filled + len(block)] = block
        filled += len(block)
    return rows, spans


def pool_arenas(scenarios: Sequence[Scenario], *, measured_m: float = math.inf) -> ArenaPool:
    """The arenas of scenarios with any numbers of UAS, waypoints and obstacles.

    Args:
        scenarios: At least one.
        measured_m: See `build_arena`.

    Raises:
        ValueError: There is no scenario.
    """
    if not scenarios:
        raise ValueError("there is no scenario to fly; give at least one")
    columns: dict[str, list[NDArray]] = {field: [] for field in _SPANNED}
    spans = np.zeros(len(scenarios), dtype=SPANS_DTYPE)
    for s, scenario in enumerate(scenarios):
        arena = build_arena(scenario, measured_m=measured_m)
        start = initial_state(scenario)
        begin_mission(arena, start, np.zeros(len(scenario.uas), dtype=OUTCOME_DTYPE))
        spans["n_samples"][s] = len(arena.moving_path_m)
        for field, array in zip(Arena._fields, arena, strict=True):
            columns[field].append(array.ravel() if field in _FLAT else array)
        columns["start_x"].append(start.x)
        columns["start_uncovered"].append(start.uncovered)
    arrays = {}
    for field, blocks in columns.items():
        arrays[field], spans[field] = end_to_end(blocks)
    return ArenaPool(**arrays, spans=spans)


@lending_kernel
def arena_of(pool, s):
    """The arena of scenario s, in a kernel: borrowed views into the arrays of the pool.

    Args:
        pool: `ArenaPool`.
        s: Index of the scenario.
    """
    at = pool.spans[s]
    n_uas = at.uas[1] - at.uas[0]
    n_obstacles = at.obstacles[1] - at.obstacles[0]
    n_moving = at.moving[1] - at.moving[0]
    n_planes = at.normals[1] - at.normals[0]
    n_waypoints = at.waypoints[1] - at.waypoints[0]
    n_nodes = at.nodes_m[1] - at.nodes_m[0]
    path_shape = (at.n_samples, n_moving, 3)
    return Arena(
        borrow(pool.vehicles, at.vehicles[0], (n_uas,)),
        borrow(pool.uas, at.uas[0], (n_uas,)),
        borrow(pool.obstacles, at.obstacles[0], (n_obstacles,)),
        borrow(pool.obstacle_columns, at.obstacle_columns[0], (N_COLUMNS, padded(n_obstacles))),
        borrow(pool.normals, at.normals[0], (n_planes, 3)),
        borrow(pool.offsets_m, at.offsets_m[0], (n_planes,)),
        borrow(pool.moving, at.moving[0], (n_moving,)),
        borrow(pool.moving_path_m, at.moving_path_m[0], path_shape),
        borrow(pool.moving_velocity_mps, at.moving_velocity_mps[0], path_shape),
        borrow(pool.waypoints, at.waypoints[0], (n_waypoints,)),
        borrow(pool.waypoint_columns, at.waypoint_columns[0], (N_WAYPOINT_COLUMNS, n_waypoints)),
        borrow(pool.rules, at.rules[0], (1,)),
        borrow(pool.nodes_m, at.nodes_m[0], (n_nodes, 2)),
        borrow(pool.node_distance_m, at.node_distance_m[0], (n_waypoints + n_uas, n_nodes)),
    )


@inlined_kernel
def begin(pool, s, state):
    """Put a world of scenario s at t = 0.

    Args:
        pool: `ArenaPool`.
        s: Index of the scenario.
        state: `WorldState` with as many UAS and waypoints as the scenario; written.
    """
    at = pool.spans[s]
    for i in range(state.status.shape[0]):
        for k in range(state.x.shape[1]):
            state.x[i, k] = pool.start_x[at.start_x[0] + i, k]
        state.reference[i, 0] = 0.0
        state.reference[i, 1] = 0.0
        state.status[i] = FLYING
        state.departed[i] = False
        state.returning[i] = False
    for w in range(state.uncovered.shape[0]):
        state.uncovered[w] = pool.start_uncovered[at.start_uncovered[0] + w]
    state.step[0] = 0


def n_of(pool: ArenaPool, field: str) -> NDArray[np.int64]:
    """How many rows of a field each scenario has, (S,): "uas", "waypoints", ..."""
    spans = pool.spans[field]
    return spans[:, 1] - spans[:, 0]


def lanes_of(n_lanes: int, pool: ArenaPool) -> WorldState:
    """States for lanes that fly any scenario of the pool, each field with an axis of lanes before.

    Scenario s uses the first rows of its lane: `state.x[lane, :n_uas]`, `state.step[lane]`.
    """
    n_uas, n_waypoints = int(n_of(pool, "uas").max()), int(n_of(pool, "waypoints").max())
    return WorldState(
        x=np.zeros((n_lanes, n_uas, pool.start_x.shape[1])),
        reference=np.zeros((n_lanes, n_uas, 2)),
        status=np.full((n_lanes, n_uas), FLYING),
        departed=np.zeros((n_lanes, n_uas), dtype=np.bool_),
        returning=np.zeros((n_lanes, n_uas), dtype=np.bool_),
        uncovered=np.zeros((n_lanes, n_waypoints), dtype=np.bool_),
        step=np.zeros((n_lanes, 1), dtype=np.int64),
    )


@lending_kernel
def state_of(lanes, lane, n_uas, n_waypoints):
    """The state of one lane, of the size of its scenario, in a kernel: borrowed views."""
    return WorldState(
        borrow(lanes.x, lane, (n_uas, lanes.x.shape[2])),
        borrow(lanes.reference, lane, (n_uas, 2)),
        borrow(lanes.status, lane, (n_uas,)),
        borrow(lanes.departed, lane, (n_uas,)),
        borrow(lanes.returning, lane, (n_uas,)),
        borrow(lanes.uncovered, lane, (n_waypoints,)),
        borrow(lanes.step, lane, (1,)),
    )
