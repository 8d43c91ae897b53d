"""What a learner is paid for: named terms, each with a weight."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from numbers import Real
from typing import Any

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.kernels import inlined_kernel, kernel
from uas_coverage_env.world import FLYING
from uas_coverage_env.world.commands import VELOCITY
from uas_coverage_env.world.outcome import NONE


@dataclass(frozen=True)
class Term:
    """One term of the reward.

    Attributes:
        name: Its name in `reward_weights` and `reward_terms`.
        weight: Unless `reward_weights` says otherwise.
        meaning: What is multiplied by the weight, per UAS and step.
    """

    name: str
    weight: float
    meaning: str


TERMS = (
    Term("coverage", 1.0, "weight of the waypoints that it covered first"),
    Term("team_coverage", 0.0, "weight of the waypoints that the others covered first"),
    Term("energy", 0.2, "minus the energy drawn from its battery [Wh]"),
    Term("violation", 10.0, "-1 when it is lost: contact, outside the fence, battery overdrawn"),
    Term("home", 5.0, "when it lands, the share of the waypoints' weight covered by then"),
    Term("stranded", 5.0, "-1 when `max_cycles` ends the episode and it still flies"),
    Term(
        "filter", 0.1, "minus what the safety filter changed (1: the speed limit, or not a speed)"
    ),
    Term("time", 0.01, "-1 while it flies"),
)
"""All terms. What the filter corrects has a price, so that a learner does not come to lean on it;
what it corrects in return mode has none."""

REWARD_TERMS = tuple(term.name for term in TERMS)
"""Names of the terms, in their order."""

LARGEST_WEIGHT = 1e9
"""No reward weight is larger: the sum of a mission stays far from the end of the numbers."""


def rewards_table() -> str:
    """The terms as a Markdown table."""
    lines = ["| term | weight | per UAS and step |", "|---|---|---|"]
    lines += [f"| {term.name} | {term.weight:g} | {term.meaning} |" for term in TERMS]
    return "\n".join(lines)


def weights_of(given: Mapping[str, float] | None) -> NDArray[np.float64]:
    """All weights: those given, and the defaults of the others.

    Returns:
        (R,) in the order of REWARD_TERMS.

    Raises:
        ValueError: A name is no term, or a weight is no number, or beyond ±LARGEST_WEIGHT.
    """
    weights: dict[str, Any] = {term.name: term.weight for term in TERMS}
    if given is not None and not isinstance(given, Mapping):
        raise ValueError(f"reward_weights is {given!r}; give a mapping from term to weight")
    for name, weight in (given or {}).items():
        if name not in weights:
            raise ValueError(f"there is no reward term {name!r}; there are {', '.join(weights)}")
        number = isinstance(weight, Real) and not isinstance(weight, bool)
        # NaN is not below any bound
        if not number or not abs(weight) <= LARGEST_WEIGHT:
            shown = repr(weight)[:80]
            raise ValueError(
                f"reward_weights: {name} is {shown}; give a finite number, at most "
                f"{LARGEST_WEIGHT:g} in size"
            )
        weights[name] = weight
    return np.array(list(weights.values()), dtype=np.float64)


@inlined_kernel
def pay(arena, state, commands, outcome, weights, over, terms):
    """Write the weighted terms of every UAS that flew in this step; those of the others are zero.

    Args:
        arena: The arena.
        state: The state of the world after the step.
        commands: (U,) of COMMAND_DTYPE, as they were asked for.
        outcome: (U,) of OUTCOME_DTYPE, what came of them.
        weights: (R,) in the order of REWARD_TERMS.
        over: The step was the last one allowed.
        terms: (U, R or more) the first R columns are written.
    """
    covered_by_all = 0.0
    for i in range(terms.shape[0]):
        covered_by_all += outcome[i].newly_covered_weight
    for i in range(terms.shape[0]):
        row = terms[i]
        event = outcome[i]
        for term in range(weights.shape[0]):
            row[term] = 0.0
        if not event.flew:
            continue
        row[0] = event.newly_covered_weight
        row[1] = covered_by_all - event.newly_covered_weight
        row[2] = -event.energy_Wh
        if event.contact != NONE:
            row[3] = -1.0
        if event.landed:
            row[4] = _covered_share(arena, state)
        if over and state.status[i] == FLYING:
            row[5] = -1.0
        if event.filtered and not state.returning[i]:
            row[6] = -_change(arena, i, commands[i], event.applied_command)
        row[7] = -1.0
        for term in range(weights.shape[0]):
            # adding zero makes -0.0 a plain zero
            row[term] = row[term] * weights[term] + 0.0


@kernel
def _covered_share(arena, state):
    total = 0.0
    covered = 0.0
    for w in range(state.uncovered.shape[0]):
        weight = arena.waypoints[w].weight
        total += weight
        if not state.uncovered[w]:
            covered += weight
    return covered / total


@kernel
def _change(arena, i, asked, applied):
    """How far the velocity flown is from the one asked for, in units of the limit."""
    if asked.kind != VELOCITY:
        return 1.0
    limit_mps = arena.uas[i].speed_mps
    speed_mps = math.hypot(asked.values[0], asked.values[1])
    shorten = limit_mps / speed_mps if speed_mps > limit_mps else 1.0
    north_mps = applied.values[0] - shorten * asked.values[0]
    east_mps = applied.values[1] - shorten * asked.values[1]
    return math.hypot(north_mps, east_mps) / limit_mps
