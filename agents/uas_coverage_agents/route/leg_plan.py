"""The search of `leg_search` for a step, for Python and for other kernels.

In still air both call it at its address: it is more code than all that calls it, and so is compiled
once, by itself.
"""

from __future__ import annotations

from functools import cache

import numpy as np
from numba import typeof, types
from numpy.typing import NDArray

from uas_coverage_agents.route.layers import Layers
from uas_coverage_agents.route.leg_search import HORIZON, Workspace, search_along, search_workspace
from uas_coverage_env.compiled.calls import Signature
from uas_coverage_env.compiled.kernels import allocating_kernel
from uas_coverage_env.world import Arena
from uas_coverage_env.world.arena import ARENA


@cache
def _types() -> tuple[types.Type, ...]:
    """Of the arguments of `search_along` in still air."""
    row, table = np.zeros(1), np.zeros((HORIZON, 3))
    layers = Layers(table, row, table, row, row, row)
    return (
        ARENA.numba_type(), ARENA.numba_type(), types.int64, typeof(row), typeof(row),
        typeof(np.zeros(1, np.int64)), typeof(layers), typeof(table), types.boolean,
        typeof(np.random.default_rng(0)), typeof(search_workspace(1)), types.none,
    )  # fmt: skip


_SIGNATURE = Signature(
    "arena around i x reference targets layers plan kept rng workspace belief",
    _types,
    types.boolean,
)

search_by = _SIGNATURE.call
"""In a kernel, (still_air_code(), *arguments, None): `search_along` in still air."""


@cache
def still_air_code() -> int:
    """Compile `search_along` for still air, or load it from the cache.

    Returns:
        Its address, for one process.
    """
    return _SIGNATURE.address_of(search_along)


@allocating_kernel
def _search_by(code, arena, around, i, x, reference, targets, layers, plan, kept, rng, workspace):
    return search_by(
        code, arena, around, i, x, reference, targets, layers, plan, kept, rng, workspace, None
    )


def plan_along(
    arena: Arena,
    around: Arena,
    i: int,
    x: NDArray[np.float64],
    reference: NDArray[np.float64],
    targets: NDArray[np.int64],
    layers: Layers,
    plan: NDArray[np.float64],
    kept: bool,
    rng: np.random.Generator,
    workspace: Workspace,
    belief: NDArray[np.float64] | None = None,
) -> bool:
    """Write the plan whose first row is to be flown; see `search_along`."""
    still = (arena, around, i, x, reference, targets, layers, plan, kept, rng, workspace)
    if belief is None:
        return _search_by(still_air_code(), *still)
    return search_along(*still, belief)
