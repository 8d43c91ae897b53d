"""The observations of all UAS: the default blocks as one kernel, others at their address."""

from collections.abc import Sequence
from functools import cache

import numpy as np
from numba import types

from uas_coverage_env.compiled.calls import Signature
from uas_coverage_env.compiled.kernels import inlined_kernel, kernel, rarely
from uas_coverage_env.compiled.views import slice_view
from uas_coverage_env.entities.state import STATE
from uas_coverage_env.env.episode.memory import (
    BLOCK_ADDRESS,
    BLOCK_COLUMN,
    BLOCK_FIRST,
    BLOCK_PARAMETERS,
    BLOCK_SIZE,
    LEARNERS,
    TABLES,
    Observing,
)
from uas_coverage_env.env.observation import OBSERVATION, ObservationBlock
from uas_coverage_env.env.observation.block import firsts_of
from uas_coverage_env.env.observation.home import write_home
from uas_coverage_env.env.observation.moving_obstacles import write_moving_obstacles
from uas_coverage_env.env.observation.nearest import nearest_waypoints
from uas_coverage_env.env.observation.others import write_others
from uas_coverage_env.env.observation.own import write_own
from uas_coverage_env.env.observation.remaining import write_remaining
from uas_coverage_env.env.observation.surroundings import write_surroundings
from uas_coverage_env.env.observation.waypoints import write_waypoints
from uas_coverage_env.world.arena import ARENA

_AT = firsts_of(OBSERVATION)
_SIZE = type(_AT)(*(block.size for block in OBSERVATION))


@cache
def _types() -> tuple[types.Type, ...]:
    """Of the arguments of a block's kernel."""
    return (
        ARENA.numba_type(), STATE.numba_type(), TABLES.numba_type(), LEARNERS.numba_type(),
        types.int64, types.Array(types.float64, 1, "C"), types.Array(types.float32, 1, "C"),
    )  # fmt: skip


_SIGNATURE = Signature("arena state tables learners i parameters row", _types)
_write_block = _SIGNATURE.call


def observing_of(blocks: Sequence[ObservationBlock]) -> Observing:
    """Compile the blocks, or load them from the cache.

    Args:
        blocks: Of an observation.

    Raises:
        ValueError: A block cannot be compiled.
    """
    blocks = tuple(blocks)
    begins_as_usual = blocks[: len(OBSERVATION)] == OBSERVATION
    calls = []
    parameters: list[float] = []
    column = 0
    for k, block in enumerate(blocks):
        if not begins_as_usual or k >= len(OBSERVATION):
            address = _SIGNATURE.address_of(block.write)
            calls.append((address, column, block.size, len(parameters), len(block.parameters)))
            parameters.extend(block.parameters)
        column += block.size
    return Observing(
        begins_as_usual=np.array([begins_as_usual]),
        calls=np.array(calls, dtype=np.int64).reshape(-1, BLOCK_PARAMETERS + 1),
        parameters=np.array(parameters, dtype=np.float64),
    )


@inlined_kernel
def _observe_as_usual(arena, state, tables, learners, i, row):
    """Write the blocks of `OBSERVATION`; what two of them need is computed once."""
    home_dod = write_home(arena, state, i, slice_view(row, _AT.home, _SIZE.home))
    open_share = write_remaining(arena, state, i, slice_view(row, _AT.remaining, _SIZE.remaining))
    write_own(arena, state, tables, i, home_dod, open_share, slice_view(row, _AT.own, _SIZE.own))
    write_surroundings(arena, state, i, slice_view(row, _AT.surroundings, _SIZE.surroundings))
    write_waypoints(
        arena, state, tables, learners, i, slice_view(row, _AT.waypoints, _SIZE.waypoints)
    )
    write_others(arena, state, tables, i, slice_view(row, _AT.others, _SIZE.others))
    write_moving_obstacles(
        arena, state, tables, i, slice_view(row, _AT.moving_obstacles, _SIZE.moving_obstacles)
    )


@inlined_kernel
def observe_one(arena, state, tables, learners, observing, i, row, on_gpu):
    """Write the observation of UAS i, and the waypoints that it chooses among.

    Args:
        arena: The arena.
        state: The state of the world.
        tables: `Tables`.
        learners: `Learners`; candidates are written.
        observing: `Observing`.
        i: Which.
        row: (V,) float32; written.
        on_gpu: None on the processor, see `pay`.
    """
    nearest_waypoints(arena, state, i, learners.candidates[i])
    if on_gpu is not None:
        _observe_as_usual(arena, state, tables, learners, i, row)
    else:
        if observing.begins_as_usual[0]:
            _observe_as_usual(arena, state, tables, learners, i, row)
        if rarely(observing.calls.shape[0] > 0):
            for b in range(observing.calls.shape[0]):
                call = observing.calls[b]
                _write_block(
                    call[BLOCK_ADDRESS], arena, state, tables, learners, i,
                    slice_view(observing.parameters, call[BLOCK_FIRST], call[BLOCK_PARAMETERS]),
                    slice_view(row, call[BLOCK_COLUMN], call[BLOCK_SIZE]),
                )  # fmt: skip


@kernel
def observe(arena, state, tables, learners, observing, observes, observation):
    """Write the observations of those UAS that are to observe; the others' stay.

    Args:
        arena: The arena.
        state: The state of the world.
        tables: `Tables`.
        learners: `Learners`; candidates are written.
        observing: See `observe_one`.
        observes: (U,) which.
        observation: (U, V) float32; written.
    """
    for i in range(state.uas.shape[0]):
        if observes[i]:
            observe_one(arena, state, tables, learners, observing, i, observation[i], None)
