"""The features of a mission on a GPU, which calls nothing at an address: they are compiled in."""

from functools import cache
from typing import Any

from uas_coverage_env.autopilot.guidance import steer_of
from uas_coverage_env.autopilot.return_mode import call_home_of
from uas_coverage_env.compiled.kernels import inlined_kernel
from uas_coverage_env.compiled.random import counted
from uas_coverage_env.features.feature import MissionFeature, Point
from uas_coverage_env.simulation.flight import fly, fly_otherwise_with
from uas_coverage_env.simulation.step import WorldStages, plain_stages_with, stages_with


@cache
def _assist_with(return_mode: bool) -> tuple[Any, Any]:
    """What assists one UAS, and what all of them: guidance, and before it return mode."""

    @inlined_kernel
    def assist_one(room, arena, measured, nonlinear, outcome, i):
        if return_mode:
            call_home_of(arena, measured, i)
        steer_of(arena, measured, nonlinear, outcome, i, room)

    @inlined_kernel
    def assist_all(room, arena, measured, nonlinear, outcome):
        for i in range(measured.uas.shape[0]):
            assist_one(room, arena, measured, nonlinear, outcome, i)

    return assist_one, assist_all


@cache
def stages_on_gpu(
    features: tuple[MissionFeature, ...], otherwise: bool, return_mode: bool = False
) -> WorldStages:
    """The stages of `step.advance` with the kernels of features and assistants, without code.

    In place of the assistants they take a `Room`; None: guidance is not needed.

    Args:
        features: In the order of `Arena.features`.
        otherwise: Whether the 6-DOF plant or true vehicles are flown, whatever features do.
        return_mode: Whether UAS are brought home in time.
    """
    assist_one, assist_all = _assist_with(return_mode)
    kernels = tuple(
        (int(point), f, feature.kernels[point])
        for point in Point
        for f, feature in enumerate(features)
        if point != Point.BEGIN and point in feature.kernels
    )
    call_features = _in_turn(kernels)
    otherwise = otherwise or any(feature.disturbs for feature in features)
    if not otherwise and all(point >= Point.JUDGED for point, _, _ in kernels):
        return plain_stages_with(call_features, assist_one)
    flight = fly_otherwise_with(call_features) if otherwise else fly
    return stages_with(call_features, flight, assist_all)


def _in_turn(kernels: tuple[tuple[int, int, Any], ...]) -> Any:
    """`points.call_features` that calls these: their point, number of the feature, and kernel."""
    if not kernels:

        @inlined_kernel
        def call_none(point, arena, state, code, outcome):
            pass

        return call_none
    (at, f, own), rest = kernels[0], _in_turn(kernels[1:])

    @inlined_kernel
    def call_features(point, arena, state, code, outcome):
        if point == at and arena.features[f].acts:
            own(arena, state, outcome, f)
        rest(point, arena, state, code, outcome)

    return call_features


@cache
def begin_features_of(features: tuple[MissionFeature, ...], first: int = 0) -> Any:
    """`points.begin_features` with the kernels of features from one on."""
    if first == len(features):

        @inlined_kernel
        def begin_none(arena, state, code, seed, mission):
            pass

        return begin_none
    rest = begin_features_of(features, first + 1)
    own = features[first].kernels.get(Point.BEGIN)
    if own is None:
        return rest

    @inlined_kernel
    def begin_features(arena, state, code, seed, mission):
        if arena.features[first].acts:
            own(arena, state, first, counted(seed, mission) ^ arena.features[first].key)
        rest(arena, state, code, seed, mission)

    return begin_features
