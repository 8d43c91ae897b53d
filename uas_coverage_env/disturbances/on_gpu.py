"""Disturbances on a GPU, which calls nothing at an address: their kernels are parts of the step."""

from collections.abc import Callable, Sequence
from typing import Any

from uas_coverage_env.compiled.kernels import kernel
from uas_coverage_env.compiled.views import slice_view
from uas_coverage_env.disturbances.act import check_and_clip, clear
from uas_coverage_env.disturbances.wind import blow
from uas_coverage_env.world.state import FLYING


def are_own(kernels: Sequence[Any]) -> bool:
    """Whether one of these kernels of disturbances is not of the package."""
    return any(act is not blow for act in kernels)


def disturb_with(kernels: Sequence[Any]) -> Callable[..., None]:
    """`act.disturb` with these kernels as parts of it.

    Args:
        kernels: Of the disturbances, in the order of `Arena.disturbances`; at least one.

    Returns:
        A compiled function (arena, state, outcome).
    """
    act = _one_of(kernels)

    @kernel
    def disturb(arena, state, outcome):
        for i in range(state.status.shape[0]):
            clear(outcome[i])
            if state.status[i] != FLYING:
                continue
            for d in range(arena.disturbances.shape[0]):
                block = arena.disturbances[d]
                if block.acts:
                    parameters = slice_view(arena.disturbance_parameters, block.first, block.n)
                    memory = state.disturbance_memory[i, d]
                    random = state.disturbance_random[i, d]
                    act(d, arena, state, outcome, i, parameters, memory, random)
            check_and_clip(arena, i, outcome[i])

    return disturb


def _one_of(kernels: Sequence[Any], first: int = 0) -> Any:
    """A compiled function that calls kernel d of those from the first on."""
    own = kernels[first]
    others = _one_of(kernels, first + 1) if first + 1 < len(kernels) else _none

    @kernel
    def act(d, arena, state, outcome, i, parameters, memory, random):
        if d == first:
            own(arena, state, outcome, i, parameters, memory, random)
        else:
            others(d, arena, state, outcome, i, parameters, memory, random)

    return act


@kernel
def _none(d, arena, state, outcome, i, parameters, memory, random):
    pass
