"""Disturbances in a step: their kernels are called at their addresses, and so compiled alone.

What calls them is called at an address, too: the step in still air stays as short as it
was.
"""

import math
from collections.abc import Sequence
from functools import cache

import numpy as np
from numba import typeof, types
from numpy.typing import NDArray

from uas_coverage_env.compiled.array_views import slice_view
from uas_coverage_env.compiled.calls import Signature
from uas_coverage_env.compiled.kernels import inlined_kernel, kernel, rare_kernel
from uas_coverage_env.compiled.random import counted
from uas_coverage_env.disturbances.wind import blow
from uas_coverage_env.vehicle import LIFT, TAU_Z, clip_wrench
from uas_coverage_env.world.arena import ARENA
from uas_coverage_env.world.disturbance import Disturbance
from uas_coverage_env.world.outcome import OUTCOME_DTYPE
from uas_coverage_env.world.state import FLYING, STATE

DisturbanceCode = NDArray[np.int64]
"""The address of what calls them all, then theirs, in the order of `Arena.disturbances`; where
there are none, a zero. They hold for one process."""


@cache
def _types() -> tuple[types.Type, ...]:
    """Of the arguments of a disturbance's kernel."""
    numbers = types.Array(types.float64, 1, "C")
    return (
        ARENA.numba_type(), STATE.numba_type(), typeof(np.empty(0, OUTCOME_DTYPE)), types.int64,
        numbers, numbers, types.Array(types.uint64, 1, "C"),
    )  # fmt: skip


_SIGNATURE = Signature("arena state outcome i parameters memory random", _types)
_act = _SIGNATURE.call


@cache
def _types_of_all() -> tuple[types.Type, ...]:
    arena, state, outcome, *_ = _types()
    return arena, state, types.Array(types.int64, 1, "C"), outcome


_ALL = Signature("arena state disturbances outcome", _types_of_all)
_act_all = _ALL.call


def disturbance_code(disturbances: Sequence[Disturbance]) -> DisturbanceCode:
    """Compile the kernels, or load them from the cache.

    Raises:
        ValueError: One cannot be compiled.
    """
    code = np.zeros(1 + len(disturbances), dtype=np.int64)
    if disturbances:
        code[0] = _ALL.address_of(_disturb)
    for d, disturbance in enumerate(disturbances):
        code[1 + d] = _SIGNATURE.address_of(disturbance.act)
    return code


@rare_kernel
def begin_random(disturbances, random, seed, mission):
    """Put all generators where a mission begins: a function of seed and mission alone.

    Args:
        disturbances: `Arena.disturbances`.
        random: `WorldState.disturbance_random`; written.
        seed: uint64.
        mission: Number of the mission since seeding, from 0 on.
    """
    for i in range(random.shape[0]):
        for d in range(disturbances.shape[0]):
            of_disturbance = counted(seed, mission) ^ disturbances[d].key
            random[i, d, 0] = counted(of_disturbance, 0 if disturbances[d].common else i + 1)


@inlined_kernel
def disturb(arena, state, disturbances, outcome):
    """Write what acts on each UAS in this step: wind, force and inputs.

    Args:
        arena: The arena.
        state: The state at sample k; what disturbances keep is written.
        disturbances: `DisturbanceCode`; None on a GPU, which calls nothing at an address and flies
            those of the package alone with this (see `on_gpu` for others).
        outcome: (U,) of OUTCOME_DTYPE with the inputs; written.

    Raises:
        ValueError: What acts is not finite.
    """
    if disturbances is None:
        _act_on_all(arena, state, disturbances, outcome)
    else:
        _act_all(disturbances[0], arena, state, disturbances, outcome)


@kernel
def _disturb(arena, state, disturbances, outcome):
    _act_on_all(arena, state, disturbances, outcome)


@inlined_kernel
def _act_on_all(arena, state, disturbances, outcome):
    for i in range(state.status.shape[0]):
        clear(outcome[i])
        if state.status[i] != FLYING:
            continue
        for d in range(arena.disturbances.shape[0]):
            block = arena.disturbances[d]
            if not block.acts:
                continue
            parameters = slice_view(arena.disturbance_parameters, block.first, block.n)
            memory = state.disturbance_memory[i, d]
            random = state.disturbance_random[i, d]
            if disturbances is None:
                blow(arena, state, outcome, i, parameters, memory, random)
            else:
                _act(disturbances[1 + d], arena, state, outcome, i, parameters, memory, random)
        check_and_clip(arena, i, outcome[i])


@inlined_kernel
def clear(event):
    """Begin with still air and no force."""
    for axis in range(3):
        event.wind_mps[axis] = 0.0
        event.force_N[axis] = 0.0
    event.dod_lost = 0.0


@inlined_kernel
def check_and_clip(arena, i, event):
    """Refuse what is not finite, and keep the inputs of UAS i within the limits."""
    total = event.dod_lost
    for axis in range(3):
        total += abs(event.wind_mps[axis]) + abs(event.force_N[axis])
    for k in range(LIFT, TAU_Z + 1):
        total += abs(event.u[k])
    if not math.isfinite(total):
        raise ValueError("what disturbances do to a UAS is not finite; correct their kernels")
    clip_wrench(arena.vehicles[i], event.u)
