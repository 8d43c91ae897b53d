"""The points of a step at which features are called: at addresses, so each is compiled alone."""

from functools import cache

import numpy as np
from numba import typeof, types
from numpy.typing import NDArray

from uas_coverage_env.compiled.calls import Signature
from uas_coverage_env.compiled.kernels import inlined_kernel, rarely
from uas_coverage_env.compiled.random import counted
from uas_coverage_env.entities.outcome import OUTCOME_DTYPE
from uas_coverage_env.entities.state import STATE
from uas_coverage_env.features.feature import Point
from uas_coverage_env.world.arena import ARENA

FeatureCode = NDArray[np.int64]
"""The address of what flies a step otherwise than in still air by the linear model, 0 where no
mission does; where the calls of each point begin, and where the last ones end; and the calls:
number of the feature and address of its kernel. They hold for one process."""

FLY = len(Point) + 1
"""Place of that address."""

FIRST = FLY + 1

BEGIN, COMMAND, ACT, MOVED, JUDGED, SENSED = map(int, Point)


@cache
def _types() -> tuple[types.Type, ...]:
    outcome = typeof(np.empty(0, OUTCOME_DTYPE))
    return ARENA.numba_type(), STATE.numba_type(), outcome, types.int64


@cache
def _types_at_begin() -> tuple[types.Type, ...]:
    return ARENA.numba_type(), STATE.numba_type(), types.int64, types.uint64


@cache
def _types_of_flight() -> tuple[types.Type, ...]:
    arena, state, outcome, _ = _types()
    return arena, state, types.boolean, types.Array(types.int64, 1, "C"), outcome


AT_BEGIN = Signature("arena state f seed", _types_at_begin)
IN_STEP = Signature("arena state outcome f", _types)
FLIGHT = Signature("arena state nonlinear code outcome", _types_of_flight)
_begin, _call, fly_at = AT_BEGIN.call, IN_STEP.call, FLIGHT.call


@inlined_kernel
def begin_features(arena, state, code, seed, mission):
    """Put the memory of all features where a mission begins: it follows from seed and number.

    Args:
        arena: The arena.
        state: The state at t = 0; written.
        code: `FeatureCode`.
        seed: uint64.
        mission: Number of the mission since seeding, from 0 on.
    """
    of_mission = counted(seed, mission)
    for k in range(code[BEGIN], code[BEGIN + 1], 2):
        own = arena.features[code[k]]
        if own.acts:
            _begin(code[k + 1], arena, state, code[k], of_mission ^ own.key)


@inlined_kernel
def call_features(point, arena, state, code, outcome):
    """Call what the features of a mission do at a point of the step.

    Args:
        point: One of `Point`, after BEGIN.
        arena: The arena.
        state: The state.
        code: `FeatureCode`; None: no mission has any.
        outcome: (U,) of OUTCOME_DTYPE.
    """
    if code is not None and rarely(code[point] < code[point + 1]):
        for k in range(code[point], code[point + 1], 2):
            if arena.features[code[k]].acts:
                _call(code[k + 1], arena, state, outcome, code[k])
