"""One step of a mission for learners, compiled: commands, the world, rewards, observations."""

from typing import Any, NamedTuple

from uas_coverage_env.compiled.kernels import inlined_kernel, kernel, rarely
from uas_coverage_env.compiled.views import slice_view
from uas_coverage_env.entities.state import SWAPPING, as_observed
from uas_coverage_env.env.episode.act import first_not_finite, write_commands
from uas_coverage_env.env.episode.memory import (
    CONTACT,
    CONTACT_WITH,
    COVERED,
    ENERGY,
    EPISODE,
    FILTERED,
    FIRST_TERM,
    LIMITS,
    RETURNING,
    REWARD,
    STATUS,
    Acting,
    Observing,
    Paying,
)
from uas_coverage_env.env.episode.observe import observe_one
from uas_coverage_env.env.episode.pay import compute_rewards
from uas_coverage_env.env.observation.nearest import NO_TARGET, write_around
from uas_coverage_env.simulation import advance
from uas_coverage_env.world import FLYING

ACCEPTED = -1


class Rules(NamedTuple):
    """What holds for all steps of a mission."""

    acting: Acting
    nonlinear: bool
    """Whether the 6-DOF plant is flown."""
    assistants: Any
    """Which help to fly, see `autopilot.assist`."""
    code: Any
    """What features do, see `simulation.points.FeatureCode`."""
    paying: Paying
    observing: Observing


@inlined_kernel
def pay_step(arena, state, tables, learners, scratch, paying, on_gpu):
    """Reward and report a step; arguments as for `step_learners` and `compute_rewards`."""
    report, amounts = learners.report, learners.amounts
    outcome = scratch.outcome
    compute_rewards(arena, state, tables, learners, scratch, paying, on_gpu)
    newly_covered = 0
    for i in range(report.shape[0]):
        newly_covered += outcome[i].newly_covered
    for i in range(report.shape[0]):
        event = outcome[i]
        report[i, CONTACT] = event.contact
        report[i, CONTACT_WITH] = event.contact_with
        report[i, LIMITS] = event.limits_exceeded
        report[i, STATUS] = state.uas[i].status
        report[i, FILTERED] = event.filtered
        report[i, RETURNING] = event.returning
        report[i, COVERED] += newly_covered
        reward = 0.0
        for term in range(paying.weights.shape[0]):
            reward += amounts[i, FIRST_TERM + term]
        amounts[i, ENERGY] += event.energy_Wh
        amounts[i, REWARD] = reward
    if newly_covered > 0:
        write_around(state.uncovered, tables.neighbours, learners.around)
    for i in range(report.shape[0]):
        if rarely(not outcome[i].flew and state.uas[i].status == FLYING):
            # where it was to go before it swapped packs is forgotten
            learners.targets[i] = NO_TARGET


@inlined_kernel
def look_around(arena, state, tables, learners, scratch, observing, new_scene, observation, on_gpu):
    """Observe a step, or a scene that is new to those that fly; arguments as for `step_learners`.

    In a new scene only those that fly look around; what others have seen last stays.
    """
    if rarely(new_scene):
        write_around(state.uncovered, tables.neighbours, learners.around)
    seen = as_observed(state)
    for i in range(state.uas.shape[0]):
        status = state.uas[i].status
        if status == FLYING or (not new_scene and (scratch.outcome[i].flew or status == SWAPPING)):
            observe_one(arena, seen, tables, learners, observing, i, observation[i], on_gpu)


@inlined_kernel
def step_learners(arena, state, tables, learners, scratch, rules, new_scene, observation):
    """Fly one step and pay for it, or find a new scene; and look around.

    Args:
        arena: The arena.
        state: The state of the world; written.
        tables: `Tables`.
        learners: `Learners` with the actions, all finite; written.
        scratch: `Scratch`; written.
        rules: `Rules`.
        new_scene: Nothing is flown: the scene is another than before.
        observation: (U, V) float32; that of a UAS that did not fly stays.
    """
    if not rarely(new_scene):
        seen = as_observed(state)
        write_commands(arena, seen, tables, learners, scratch, rules.acting, None)
        advance(
            arena, state, scratch.commands, rules.nonlinear, rules.assistants, rules.code,
            scratch.outcome,
        )  # fmt: skip
        pay_step(arena, state, tables, learners, scratch, rules.paying, None)
    look_around(
        arena, state, tables, learners, scratch, rules.observing, new_scene, observation, None
    )


_views = EPISODE.views
_N_NUMBERS = EPISODE.size


@kernel
def step_episode(at, nonlinear, new_scene, before, observation):
    """`step_learners` called from Python.

    What a UAS that does not fly has seen last, in `before`, stays in `observation`.

    Args:
        at: Where the arrays of `EPISODE` lie, then number and addresses of the assistants, then
            what features do: to hand over every array would take longer than the flight of a UAS.
        nonlinear: See `Rules`.
        new_scene: See `step_learners`.
        before: (U, V) float32, the observation of the step before.
        observation: (U, V) float32, another array; written.

    Returns:
        ACCEPTED, or the index of a UAS whose action is not finite; then nothing has changed.
    """
    arena, state, tables, learners, scratch, acting, paying, observing = _views(at)
    invalid = first_not_finite(learners.asked)
    if invalid != ACCEPTED:
        return invalid
    for i in range(observation.shape[0]):
        if state.uas[i].status != FLYING:
            for k in range(observation.shape[1]):
                observation[i, k] = before[i, k]
    assistants = slice_view(at, _N_NUMBERS + 1, at[_N_NUMBERS])
    first = _N_NUMBERS + 1 + at[_N_NUMBERS]
    code = slice_view(at, first, at.shape[0] - first)
    rules = Rules(acting, nonlinear, assistants, code, paying, observing)
    step_learners(arena, state, tables, learners, scratch, rules, new_scene, observation)
    return ACCEPTED
