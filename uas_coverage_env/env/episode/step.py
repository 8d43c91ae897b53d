"""One step of a mission for learners, compiled: commands, the world, rewards, observations."""

from functools import cache
from typing import Any, NamedTuple

from uas_coverage_env.compiled.kernels import inlined_kernel, kernel, rarely
from uas_coverage_env.compiled.views import slice_view
from uas_coverage_env.entities.state import FLYING, SWAPPING, as_observed
from uas_coverage_env.env.episode.act import first_not_finite, write_commands_with
from uas_coverage_env.env.episode.memory import EPISODE, Acting, Observing, Paying
from uas_coverage_env.env.episode.observe import observe_one_with
from uas_coverage_env.env.episode.pay import compute_rewards_with
from uas_coverage_env.env.observation.nearest import NO_TARGET, write_around
from uas_coverage_env.env.report import (
    CONTACT,
    CONTACT_WITH,
    COVERED,
    ENERGY,
    FILTERED,
    FIRST_TERM,
    LIMITS,
    RETURNING,
    REWARD,
    STATUS,
)
from uas_coverage_env.env.versions import Version
from uas_coverage_env.simulation.step import advance

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


def pay_step_with(compute_rewards: Any) -> Any:
    """A kernel that rewards and reports a step.

    Args:
        compute_rewards: See `pay.compute_rewards_with`.

    Returns:
        `pay_step(arena, state, tables, learners, scratch, paying)`.
    """

    @inlined_kernel
    def pay_step(arena, state, tables, learners, scratch, paying):
        report, amounts = learners.report, learners.amounts
        outcome = scratch.outcome
        compute_rewards(arena, state, tables, learners, scratch, paying)
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

    return pay_step


def look_around_with(observe_one: Any) -> Any:
    """A kernel that observes a step, or a scene that is new to those that fly.

    Args:
        observe_one: See `observe.observe_one_with`.

    Returns:
        `look_around(arena, state, tables, learners, scratch, observing, new_scene, observation)`.
        In a new scene only those that fly look around; what others have seen last stays.
    """

    @inlined_kernel
    def look_around(arena, state, tables, learners, scratch, observing, new_scene, observation):
        if rarely(new_scene):
            write_around(state.uncovered, tables.neighbours, learners.around)
        seen = as_observed(state)
        for i in range(state.uas.shape[0]):
            status = state.uas[i].status
            if status == FLYING or (
                not new_scene and (scratch.outcome[i].flew or status == SWAPPING)
            ):
                observe_one(arena, seen, tables, learners, observing, i, observation[i])

    return look_around


@cache
def step_learners_with(version: Version) -> Any:
    """The step of one mission.

    Returns:
        `step_learners(arena, state, tables, learners, scratch, rules, new_scene, observation)`:
        flies one step and pays for it, unless the scene is another than before (`new_scene`); then
        observes. All actions are finite; the row in `observation` (U, V) of a UAS that did not fly
        stays.
    """
    write_commands = write_commands_with(version.actions)
    pay_step = pay_step_with(compute_rewards_with(version.reward))
    look_around = look_around_with(observe_one_with(version.observation))

    @inlined_kernel
    def step_learners(arena, state, tables, learners, scratch, rules, new_scene, observation):
        if not rarely(new_scene):
            seen = as_observed(state)
            write_commands(arena, seen, tables, learners, scratch, rules.acting)
            advance(
                arena, state, scratch.commands, rules.nonlinear, rules.assistants, rules.code,
                scratch.outcome,
            )  # fmt: skip
            pay_step(arena, state, tables, learners, scratch, rules.paying)
        look_around(
            arena, state, tables, learners, scratch, rules.observing, new_scene, observation
        )

    return step_learners


_views = EPISODE.views
_N_NUMBERS = EPISODE.size


@cache
def step_episode_with(version: Version) -> Any:
    """`step_learners` called from Python.

    Returns:
        `step_episode(at, nonlinear, new_scene, before, observation)`: ACCEPTED, or the index of a
        UAS whose action is not finite; then nothing has changed. What a UAS that does not fly has
        seen last, in `before` (U, V), stays in `observation`, another array. `at` says where the
        arrays of `EPISODE` lie, then number and addresses of the assistants, then what features
        do: to hand over every array would take longer than the flight of a UAS.
    """
    step_learners = step_learners_with(version)

    @kernel
    def step_episode(at, nonlinear, new_scene, before, observation):
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

    return step_episode
