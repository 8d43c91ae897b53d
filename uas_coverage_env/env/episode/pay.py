"""The rewards of all UAS: the terms of a version as one kernel, others at their address."""

from collections.abc import Sequence
from functools import cache
from typing import Any

import numpy as np
from numba import types
from numpy.typing import NDArray

from uas_coverage_env.compiled.calls import Signature
from uas_coverage_env.compiled.kernels import inlined_kernel, rarely
from uas_coverage_env.compiled.views import slice_view
from uas_coverage_env.entities.state import STATE
from uas_coverage_env.env.episode.memory import LEARNERS, SCRATCH, TABLES, Paying
from uas_coverage_env.env.episode.parts import handed_over
from uas_coverage_env.env.report import FIRST_TERM
from uas_coverage_env.env.rewards import RewardTerm
from uas_coverage_env.world.arena import ARENA

Terms = tuple[RewardTerm, ...]


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


def paying_of(terms: Sequence[RewardTerm], weights: NDArray[np.float64], own: Terms) -> Paying:
    """Compile the terms, or load them from the cache.

    Args:
        terms: Of a reward.
        weights: (R,) theirs.
        own: Of the version.

    Raises:
        ValueError: A term cannot be compiled.
    """
    parts = handed_over(terms, own, lambda term: _SIGNATURE.address_of(term.value))
    return Paying(weights, *parts)


def _paid(terms: Terms, term: int, first: int) -> Any:
    """One kernel that writes the values of terms in turn, from a column and a parameter on.

    Those that are off by default are computed only where they have a weight.
    """
    if not terms:

        @inlined_kernel
        def pay_nothing(arena, state, tables, learners, scratch, paying, i):
            pass

        return pay_nothing
    value, n = terms[0].value, len(terms[0].parameters)
    rest = _paid(terms[1:], term + 1, first + n)
    may_be_off = terms[0].weight == 0.0

    @inlined_kernel
    def pay_both(arena, state, tables, learners, scratch, paying, i):
        if may_be_off and paying.weights[term] == 0.0:
            learners.amounts[i, FIRST_TERM + term] = 0.0
        else:
            learners.amounts[i, FIRST_TERM + term] = value(
                arena, state, tables, learners, scratch, i, slice_view(paying.parameters, first, n)
            )
        rest(arena, state, tables, learners, scratch, paying, i)

    return pay_both


@cache
def compute_rewards_with(own: Terms, *, calls: bool = True) -> Any:
    """A kernel that computes rewards, of which some terms are part.

    Args:
        own: These.
        calls: Whether it can call others at their address, which a GPU cannot.

    Returns:
        `compute_rewards(arena, state, tables, learners, scratch, paying)`: writes the weighted
        terms of every UAS that flew in this step, or has now landed for good; those of the others
        are zero.
    """
    pay = _paid(own, 0, 0)

    @inlined_kernel
    def pay_own(arena, state, tables, learners, scratch, paying, i):
        pay(arena, state, tables, learners, scratch, paying, i)

    @inlined_kernel
    def pay_all(arena, state, tables, learners, scratch, paying, i):
        if paying.begins_as_version[0]:
            pay(arena, state, tables, learners, scratch, paying, i)
        if rarely(paying.calls.shape[0] > 0):
            for t in range(paying.calls.shape[0]):
                call = paying.calls[t]
                learners.amounts[i, FIRST_TERM + call.column] = _value_of(
                    call.address, arena, state, tables, learners, scratch, i,
                    slice_view(paying.parameters, call.first, call.parameters),
                )  # fmt: skip

    pay_terms = pay_all if calls else pay_own

    @inlined_kernel
    def compute_rewards(arena, state, tables, learners, scratch, paying):
        amounts = learners.amounts
        n_terms = paying.weights.shape[0]
        for i in range(amounts.shape[0]):
            if not (scratch.outcome[i].flew or scratch.outcome[i].landed):
                for term in range(n_terms):
                    amounts[i, FIRST_TERM + term] = 0.0
                continue
            pay_terms(arena, state, tables, learners, scratch, paying, i)
            for term in range(n_terms):
                # adding zero makes -0.0 a plain zero
                amount = amounts[i, FIRST_TERM + term]
                amounts[i, FIRST_TERM + term] = amount * paying.weights[term] + 0.0

    return compute_rewards
