"""The rewards of all UAS, compiled: the default terms as one kernel, others at their address."""

from collections.abc import Sequence
from functools import cache

import numpy as np
from numba import types
from numpy.typing import NDArray

from uas_coverage_env.compiled.calls import Signature
from uas_coverage_env.compiled.kernels import inlined_kernel, rarely
from uas_coverage_env.compiled.views import slice_view
from uas_coverage_env.entities.state import STATE
from uas_coverage_env.env.episode.memory import (
    FIRST_TERM,
    LEARNERS,
    SCRATCH,
    TABLES,
    TERM,
    TERM_ADDRESS,
    TERM_FIRST,
    TERM_PARAMETERS,
    Paying,
)
from uas_coverage_env.env.rewards import REWARD, REWARD_TERMS, RewardTerm
from uas_coverage_env.env.rewards import terms as default
from uas_coverage_env.files.blocks import numbered
from uas_coverage_env.world.arena import ARENA

_AT = numbered(REWARD_TERMS, range(len(REWARD)))


@cache
def _types() -> tuple[types.Type, ...]:
    """Of the arguments of a term's kernel."""
    return (
        ARENA.numba_type(), STATE.numba_type(), TABLES.numba_type(), LEARNERS.numba_type(),
        SCRATCH.numba_type(), types.int64, types.Array(types.float64, 1, "C"),
    )  # fmt: skip


_SIGNATURE = Signature(
    "arena state tables learners scratch i parameters", _types, result=types.float64
)
_value_of = _SIGNATURE.call


def paying_of(terms: Sequence[RewardTerm], weights: NDArray[np.float64]) -> Paying:
    """Compile the terms, or load them from the cache.

    Args:
        terms: Of a reward.
        weights: (R,) theirs.

    Raises:
        ValueError: A term cannot be compiled.
    """
    same = [term.value is usual.value for term, usual in zip(terms, REWARD, strict=False)]
    begins_as_usual = len(same) == len(REWARD) and all(same)
    calls = []
    parameters: list[float] = []
    for k, term in enumerate(terms):
        if not begins_as_usual or k >= len(REWARD):
            address = _SIGNATURE.address_of(term.value)
            calls.append((address, k, len(parameters), len(term.parameters)))
            parameters.extend(term.parameters)
    return Paying(
        weights=weights,
        begins_as_usual=np.array([begins_as_usual]),
        calls=np.array(calls, dtype=np.int64).reshape(-1, TERM_PARAMETERS + 1),
        parameters=np.array(parameters, dtype=np.float64),
    )


@inlined_kernel
def _pay_as_usual(arena, state, tables, learners, scratch, i):
    """Write the terms of `REWARD`, not yet weighted."""
    paid = learners.amounts[i]
    row = slice_view(paid, FIRST_TERM, paid.shape[0] - FIRST_TERM)
    none = slice_view(paid, 0, 0)
    row[_AT.coverage] = default.coverage(arena, state, tables, learners, scratch, i, none)
    row[_AT.team_coverage] = default.team_coverage(arena, state, tables, learners, scratch, i, none)
    row[_AT.energy] = default.energy(arena, state, tables, learners, scratch, i, none)
    row[_AT.violation] = default.violation(arena, state, tables, learners, scratch, i, none)
    row[_AT.home] = default.home(arena, state, tables, learners, scratch, i, none)
    row[_AT.stranded] = default.stranded(arena, state, tables, learners, scratch, i, none)
    row[_AT.filter] = default.filter_change(arena, state, tables, learners, scratch, i, none)
    row[_AT.time] = default.time(arena, state, tables, learners, scratch, i, none)


@inlined_kernel
def compute_rewards(arena, state, tables, learners, scratch, paying, on_gpu):
    """Write the weighted terms of every UAS that flew in this step, or has now landed for good.

    Those of the others are zero.

    Args:
        arena: The arena.
        state: The state of the world after the step.
        tables: `Tables`.
        learners: `Learners`; the terms of its amounts are written.
        scratch: `Scratch`.
        paying: `Paying`.
        on_gpu: None on the processor. A GPU calls nothing at an address: it knows `REWARD` alone.
    """
    amounts = learners.amounts
    n_terms = paying.weights.shape[0]
    for i in range(amounts.shape[0]):
        if not (scratch.outcome[i].flew or scratch.outcome[i].landed):
            for term in range(n_terms):
                amounts[i, FIRST_TERM + term] = 0.0
            continue
        if on_gpu is not None:
            _pay_as_usual(arena, state, tables, learners, scratch, i)
        else:
            if paying.begins_as_usual[0]:
                _pay_as_usual(arena, state, tables, learners, scratch, i)
            if rarely(paying.calls.shape[0] > 0):
                for t in range(paying.calls.shape[0]):
                    call = paying.calls[t]
                    amounts[i, FIRST_TERM + call[TERM]] = _value_of(
                        call[TERM_ADDRESS], arena, state, tables, learners, scratch, i,
                        slice_view(paying.parameters, call[TERM_FIRST], call[TERM_PARAMETERS]),
                    )  # fmt: skip
        for term in range(n_terms):
            # adding zero makes -0.0 a plain zero
            amount = amounts[i, FIRST_TERM + term]
            amounts[i, FIRST_TERM + term] = amount * paying.weights[term] + 0.0
