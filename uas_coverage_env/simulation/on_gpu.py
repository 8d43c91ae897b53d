"""The features of a mission on a GPU, which calls nothing at an address: one function a point."""

from collections.abc import Sequence
from functools import cache
from typing import Any

from uas_coverage_env.compiled.kernels import kernel
from uas_coverage_env.compiled.random import counted
from uas_coverage_env.features.feature import MissionFeature, Point


def called_at(point: Point, features: Sequence[MissionFeature]) -> Any:
    """A compiled function that calls the kernels of features at a point, in their order.

    Args:
        point: Which; after BEGIN.
        features: In the order of `Arena.features`.

    Returns:
        (arena, state, outcome) -> None.
    """
    return _chain(_kernels(point, features))


def called_at_begin(features: Sequence[MissionFeature]) -> Any:
    """Likewise where a mission begins: (arena, state, seed, mission) -> None."""
    return _chain_at_begin(_kernels(Point.BEGIN, features))


def _kernels(point: Point, features: Sequence[MissionFeature]) -> tuple[tuple[int, Any], ...]:
    each = ((f, feature.kernels.get(point)) for f, feature in enumerate(features))
    return tuple((f, own) for f, own in each if own is not None)


@cache  # to compile it again takes seconds
def _chain(kernels: tuple[tuple[int, Any], ...]) -> Any:
    if not kernels:
        return _nothing
    (f, own), others = kernels[0], _chain(kernels[1:])

    @kernel
    def call(arena, state, outcome):
        if arena.features[f].acts:
            own(arena, state, outcome, f)
        others(arena, state, outcome)

    return call


@kernel
def _nothing(arena, state, outcome):
    pass


@cache
def _chain_at_begin(kernels: tuple[tuple[int, Any], ...]) -> Any:
    if not kernels:
        return _nothing_begins
    (f, own), others = kernels[0], _chain_at_begin(kernels[1:])

    @kernel
    def begin(arena, state, seed, mission):
        if arena.features[f].acts:
            own(arena, state, f, counted(seed, mission) ^ arena.features[f].key)
        others(arena, state, seed, mission)

    return begin


@kernel
def _nothing_begins(arena, state, seed, mission):
    pass
