"""What helps to fly: return mode, guidance and safety filter, each compiled by itself.

The assistants are more code than all the rest of a step, so a step does not contain them: it is
given their addresses. What is not requested is not compiled.
"""

from functools import cache

import numpy as np
from numba import typeof, types
from numpy.typing import NDArray

from uas_coverage_env.autopilot.guidance import steer
from uas_coverage_env.autopilot.return_mode import call_home
from uas_coverage_env.autopilot.safety import filter_commands
from uas_coverage_env.compiled.calls import Signature
from uas_coverage_env.entities.outcome import OUTCOME_DTYPE
from uas_coverage_env.entities.state import STATE
from uas_coverage_env.world.arena import ARENA

AssistantCode = NDArray[np.int64]
"""Addresses of the assistants' machine code, in the order in which they are called. They hold for
one process: they must not be kept in what travels to another."""


@cache
def _types() -> tuple[types.Type, ...]:
    """Of the arguments of every assistant: arena, state, nonlinear and outcome."""
    outcome = typeof(np.empty(0, OUTCOME_DTYPE))
    return ARENA.numba_type(), STATE.numba_type(), types.boolean, outcome


_SIGNATURE = Signature("arena state nonlinear outcome", _types)

assist = _SIGNATURE.call
"""In a kernel, (assistant, arena, state, nonlinear, outcome): call one of `AssistantCode`, which
writes what it decides to `outcome.applied_command`."""


def assistants(return_mode: bool, safety_filter: bool, *, goes_to: bool = True) -> AssistantCode:
    """Compile the assistants that are asked for, or load them from the cache.

    Args:
        return_mode: Whether UAS are brought home in time.
        safety_filter: Whether commands are kept clear of harm.
        goes_to: Whether commands of kind GO_TO may come.
    """
    asked_for = (
        (call_home, return_mode),
        (steer, return_mode or goes_to),
        (filter_commands, safety_filter),
    )
    wanted = [_SIGNATURE.address_of(assistant) for assistant, asked in asked_for if asked]
    return np.array(wanted, dtype=np.int64)
