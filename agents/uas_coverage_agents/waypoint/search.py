"""Decisions tried out before they are flown: missions simulated to their end, in the same world.

A plan is the targets that each UAS takes, in order. From a plan others are made: it is followed up
to some decision, there another choice is drawn from the policy, and from there on either the
policy goes on alone, or the rest of the plan is kept as far as it fits. The cheapest is flown, and
is where the next decision begins to look. Moving obstacles are not simulated, as it is unknown what
they will do; what they cover now comes last.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from uas_coverage_agents.waypoint.layout import HOME_CHOICE, K
from uas_coverage_agents.waypoint.observation import NO_TARGET
from uas_coverage_agents.waypoint.scorer import best_choice, write_scores
from uas_coverage_agents.waypoint.team import (
    ENERGY,
    LEFT,
    LOST_UAS,
    NO_UAS,
    NOT_HOME,
    TIME,
    Choices,
    choose,
    fly_on_by,
)
from uas_coverage_env.compiled.kernels import allocating_kernel
from uas_coverage_env.compiled.views import copy_arrays
from uas_coverage_env.entities.commands import HOME
from uas_coverage_env.world import WorldState

PRICES_WH = {ENERGY: 1.0, TIME: 0.1, LEFT: 20.0, LOST_UAS: 100.0, NOT_HOME: 100.0}
"""What a mission costs [Wh]: as in training, energy and the time of the team; see `settings`."""

_PRICES_WH = np.array([PRICES_WH.get(column, 0.0) for column in range(LEFT + 1)])


NEVER = -1


class TargetPlan(NamedTuple):
    """Targets of each UAS in their order."""

    targets: NDArray[np.int64]
    """(U, W+1) waypoints, or HOME."""
    length: NDArray[np.int64]
    """(U,) how many of them."""
    following: NDArray[np.int64]
    """(U,) the next of them."""


def no_plan(n_uas: int, n_waypoints: int) -> TargetPlan:
    """Nothing planned yet."""
    return TargetPlan(
        targets=np.full((n_uas, 2 * n_waypoints + 2), NO_TARGET),
        length=np.zeros(n_uas, dtype=np.int64),
        following=np.zeros(n_uas, dtype=np.int64),
    )


class Moment(NamedTuple):
    """From where missions are simulated."""

    state: WorldState
    targets: NDArray[np.int64]
    """(U,) where each flies to then."""
    blocked: NDArray[np.bool_]
    """(W,) what comes last."""


class Workspace(NamedTuple):
    """Arrays of one simulated mission: its state, an observation and what follows from it."""

    state: WorldState
    commands: NDArray[np.void]
    outcome: NDArray[np.void]
    choices: Choices
    scores: NDArray[np.float64]
    flight: int
    """The `team.flight_code` that flies it: of this process, so it is given with each call."""


@allocating_kernel
def _draw(scores, legal, not_this, rng):
    """A choice drawn with the probabilities of the policy, another one than `not_this`.

    Returns:
        The choice, or -1 where there is no other.
    """
    best = -np.inf
    drawn = -1
    for k in range(K + 1):
        if legal[k] and k != not_this:
            # the largest of the scores plus Gumbel noise is drawn with their probabilities
            noisy = scores[k] - np.log(-np.log(rng.random() + 1e-300) + 1e-300)
            if noisy > best:
                best = noisy
                drawn = k
    return drawn


@allocating_kernel
def planned(uncovered, plan, at, i, candidates, legal):
    """The choice that a plan has for UAS i, or -1; `at` (U,) moves on, over what is done too."""
    while at[i] < plan.length[i]:
        target = plan.targets[i, at[i]]
        at[i] += 1
        if target == HOME:
            return HOME_CHOICE if legal[HOME_CHOICE] else -1
        if uncovered[target]:
            for k in range(K):
                if candidates[k] == target and legal[k]:
                    return k
            return -1
    return -1


@allocating_kernel
def simulate(
    arena,
    legs,
    weights,
    start,
    return_mode,
    assistants,
    plan,
    change_at,
    keep_on,
    workspace,
    rng,
    new,
):
    """Fly one mission to its end.

    Args:
        arena: Without moving obstacles.
        legs: `Legs`.
        weights: `Weights`.
        start: `Moment` from which it goes on.
        return_mode: Whether the world brings UAS home in time.
        assistants: See `world.advance`.
        plan: What is followed.
        change_at: Number of the decision at which another choice is drawn; NEVER for none.
        keep_on: Whether the plan is followed after that, as far as it fits; else, and where the
            plan has nothing for a UAS, the policy decides.
        workspace: Written.
        rng: Random numbers.
        new: `TargetPlan`; what was flown is written.

    Returns:
        (cost [Wh], number of decisions).
    """
    state = workspace.state
    copy_arrays(start.state, state)
    targets = start.targets.copy()
    blocked = start.blocked.copy()
    candidates, legal, observation = workspace.choices
    account = np.zeros(_PRICES_WH.shape[0])
    at = plan.following.copy()
    new.length[:] = 0
    new.following[:] = 0
    n = 0
    while True:
        i = fly_on_by(
            workspace.flight, arena, legs, state, return_mode, assistants, blocked, targets,
            workspace.commands, workspace.outcome, workspace.choices, account,
        )  # fmt: skip
        if i == NO_UAS:
            break
        choice = -1
        if n <= change_at or keep_on:
            choice = planned(state.uncovered, plan, at, i, candidates, legal)
        if n == change_at:
            write_scores(weights, observation, workspace.scores)
            other = _draw(workspace.scores, legal, choice, rng)
            if other >= 0:
                choice = other
                at[i] = max(at[i] - 1, 0)  # what was to be next may come after it
        if choice < 0:
            choice = best_choice(weights, observation, legal, workspace.scores)
        choose(targets, candidates, i, choice)
        if new.length[i] < new.targets.shape[1]:
            new.targets[i, new.length[i]] = targets[i]
            new.length[i] += 1
        n += 1
    return (account * _PRICES_WH).sum(), n


@allocating_kernel
def improve(
    arena,
    legs,
    weights,
    now,
    return_mode,
    assistants,
    plan,
    n_simulations,
    workspace,
    rng,
    trial,
    best,
):
    """The cheapest plan that some simulations find.

    Args:
        arena: See `simulate`.
        legs: See `simulate`.
        weights: See `simulate`.
        now: `Moment` before the choice that is asked for.
        return_mode: See `simulate`.
        assistants: See `simulate`.
        plan: The plan so far; may be empty.
        n_simulations: How many are tried.
        workspace: Written.
        rng: Random numbers.
        trial: `TargetPlan`; written.
        best: `TargetPlan`; written.

    Returns:
        Cost of the best plan [Wh].
    """
    best_Wh, n_decisions = simulate(
        arena, legs, weights, now, return_mode, assistants, plan, NEVER, True, workspace, rng, best
    )
    for n in range(n_simulations - 1):
        # first the policy alone: no plan is worse than that
        change_at = NEVER if n == 0 else rng.integers(0, max(n_decisions, 1))
        keep_on = n > 0 and rng.random() < 0.5
        cost_Wh, n_new = simulate(
            arena, legs, weights, now, return_mode, assistants, best, change_at, keep_on, workspace,
            rng,
            trial,
        )  # fmt: skip
        if cost_Wh < best_Wh:
            best_Wh = cost_Wh
            n_decisions = n_new
            best.targets[:] = trial.targets
            best.length[:] = trial.length
            best.following[:] = 0
    return best_Wh
