"""Who helps to fly: return mode, guidance and safety filter, each compiled by itself.

Numba puts the machine code of what a kernel calls into that kernel, and optimises it again in each
kernel above. The assistants are more code than all the rest of a step. So a step does not contain
them: it is given their addresses, and calls what lies there. What nobody asks for is not compiled.
"""

from collections.abc import Callable, Sequence
from functools import cache
from typing import Any

import numpy as np
from numba import config, typeof, types
from numba.core import cgutils, errors
from numba.extending import intrinsic
from numpy.typing import NDArray

from uas_coverage_env.world.arena import ARENA
from uas_coverage_env.world.guidance import steer
from uas_coverage_env.world.outcome import OUTCOME_DTYPE
from uas_coverage_env.world.return_mode import call_home
from uas_coverage_env.world.safety import filter_commands
from uas_coverage_env.world.state import STATE

AssistantCode = NDArray[np.int64] | Sequence[Callable[..., None]]
"""Addresses of the assistants' machine code, in the order in which they are called; with
NUMBA_DISABLE_JIT=1 the functions themselves. Addresses hold for one process: they must not be kept
in what travels to another."""

_COMPILED = not config.DISABLE_JIT  # pyright: ignore[reportAttributeAccessIssue]


def assistants(return_mode: bool, safety_filter: bool, *, goes_to: bool = True) -> AssistantCode:
    """Compile the assistants that are asked for, or load them from numba's cache.

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
    wanted = [assistant for assistant, asked in asked_for if asked]
    if not _COMPILED:
        return wanted
    return np.array([_address_of(assistant) for assistant in wanted], dtype=np.int64)


@cache  # numba takes milliseconds to find it again
def _address_of(assistant: Any) -> int:
    compiled = assistant.get_compile_result(types.none(*_types()))
    return compiled.library.get_pointer_to_function(compiled.fndesc.llvm_func_name)


@cache
def _types() -> tuple[types.Type, ...]:
    """Of the arguments of every assistant: arena, state, nonlinear and outcome."""
    outcome = typeof(np.empty(0, OUTCOME_DTYPE))
    return ARENA.numba_type(), STATE.numba_type(), types.boolean, outcome


def assist(assistant: Any, arena: Any, state: Any, nonlinear: Any, outcome: Any) -> None:
    """Call an assistant, one of `AssistantCode`, in a kernel.

    Args:
        assistant: Which.
        arena: The arena.
        state: The state.
        nonlinear: Whether the world flies the 6-DOF plant.
        outcome: (U,) of OUTCOME_DTYPE; what the assistant decides is written to applied_command.
    """
    assistant(arena, state, nonlinear, outcome)


def _call_at_address(typing_context, assistant, arena, state, nonlinear, outcome):
    given = (arena, state, types.unliteral(nonlinear), outcome)
    expected = _types()
    if given != expected:
        # at an address there is nothing that would notice
        raise errors.TypingError(f"an assistant takes {expected}, not {given}")

    def generate(context, builder, signature, arguments):
        convention = context.call_conv
        code = convention.get_function_type(types.none, expected)
        at = builder.inttoptr(arguments[0], code.as_pointer())
        status, _ = convention.call_function(builder, at, types.none, expected, arguments[1:])
        with cgutils.if_unlikely(builder, status.is_error):
            convention.return_status_propagate(builder, status)
        return context.get_dummy_value()

    return types.none(types.int64, *expected), generate


if _COMPILED:
    assist = intrinsic(_call_at_address)  # pyright: ignore[reportAssignmentType]
