"""One step of a mission for learners, compiled: commands, the world, rewards, observations."""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.borrow import part
from uas_coverage_env.env.actions import first_not_finite, write_commands
from uas_coverage_env.env.layout import OBSERVATION_SIZE
from uas_coverage_env.env.memory import (
    CONTACT,
    CONTACT_WITH,
    COVERED,
    ENERGY,
    EPISODE,
    FILTERED,
    RETURNING,
    REWARD,
    STATUS,
)
from uas_coverage_env.env.nearest import count_company
from uas_coverage_env.env.observation import look
from uas_coverage_env.env.rewards import pay
from uas_coverage_env.kernels import inlined_kernel, kernel
from uas_coverage_env.world import FLYING, advance

ACCEPTED = -1


class Rules(NamedTuple):
    """What holds for all steps of a mission."""

    kind: int
    """Kind of command that the actions become."""
    weights: NDArray[np.float64]
    """(R,) of the reward terms."""
    nonlinear: bool
    """Whether the 6-DOF plant is flown."""
    assistants: Any
    """Who helps to fly, see `world.advance`."""


@inlined_kernel
def finish_step(arena, state, tables, learners, scratch, weights, max_cycles, observation):
    """Pay for a step that was flown and look around; arguments as for `step_learners`."""
    over = state.step[0] >= max_cycles
    report = learners.report
    outcome = scratch.outcome
    pay(arena, state, scratch.commands, outcome, weights, over, report)
    newly_covered = 0
    for i in range(report.shape[0]):
        newly_covered += outcome[i].newly_covered
    for i in range(report.shape[0]):
        event = outcome[i]
        report[i, ENERGY] += event.energy_Wh
        report[i, CONTACT] = event.contact
        report[i, CONTACT_WITH] = event.contact_with
        report[i, STATUS] = state.status[i]
        report[i, FILTERED] = event.filtered
        report[i, RETURNING] = event.returning
        report[i, COVERED] += newly_covered
        report[i, REWARD] = 0.0
        for term in range(weights.shape[0]):
            report[i, REWARD] += report[i, term]
    if newly_covered > 0:
        count_company(state.uncovered, tables.neighbours, learners.company)
    for i in range(report.shape[0]):
        if outcome[i].flew:
            look(
                arena, state, tables.scales[i], learners.company, i, learners.targets, max_cycles,
                learners.candidates[i], observation[i],
            )  # fmt: skip


@inlined_kernel
def step_learners(arena, state, tables, learners, scratch, rules, max_cycles, observation):
    """Fly one step, pay for it and look around.

    Args:
        arena: The arena.
        state: The state of the world; written.
        tables: `Tables`.
        learners: `Learners` with the actions, all finite; written.
        scratch: `Scratch`; written.
        rules: `Rules`.
        max_cycles: Steps after which the episode is cut.
        observation: (U, OBSERVATION_SIZE) float32; that of a UAS that did not fly stays.
    """
    write_commands(
        state, rules.kind, tables.ranges, learners.asked, learners.candidates, learners.targets,
        scratch.commands,
    )  # fmt: skip
    advance(arena, state, scratch.commands, rules.nonlinear, rules.assistants, scratch.outcome)
    finish_step(arena, state, tables, learners, scratch, rules.weights, max_cycles, observation)


_views = EPISODE.views
_N_NUMBERS = EPISODE.size


@kernel
def step_episode(at, kind, nonlinear, max_cycles, before, observation):
    """`step_learners` called from Python.

    What a UAS that does not fly has seen last, in `before`, stays in `observation`.

    Args:
        at: Where the arrays of `EPISODE` lie, then the assistants: to hand over every array would
            take longer than the flight of a UAS.
        kind: See `Rules`, also the next.
        nonlinear: Whether.
        max_cycles: Steps after which the episode is cut.
        before: (U, OBSERVATION_SIZE) float32, the observation of the step before.
        observation: (U, OBSERVATION_SIZE) float32, another array; written.

    Returns:
        ACCEPTED, or the index of a UAS whose action is not finite; then nothing has changed.
    """
    arena, state, tables, learners, scratch, prices = _views(at)
    invalid = first_not_finite(learners.asked)
    if invalid != ACCEPTED:
        return invalid
    for i in range(observation.shape[0]):
        if state.status[i] != FLYING:
            for k in range(OBSERVATION_SIZE):
                observation[i, k] = before[i, k]
    rules = Rules(kind, prices.weights, nonlinear, part(at, _N_NUMBERS, at.shape[0] - _N_NUMBERS))
    step_learners(arena, state, tables, learners, scratch, rules, max_cycles, observation)
    return ACCEPTED
