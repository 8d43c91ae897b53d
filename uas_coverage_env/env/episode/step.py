"""One step of a mission for learners, compiled: commands, the world, rewards, observations."""

from functools import cache
from typing import Any, NamedTuple

from uas_coverage_env.compiled.kernels import in_turn, inlined_kernel, kernel, rarely
from uas_coverage_env.compiled.views import slice_view
from uas_coverage_env.entities.state import FLYING, SWAPPING, as_observed
from uas_coverage_env.env.episode.act import first_not_finite, write_command_with
from uas_coverage_env.env.episode.memory import EPISODE, Acting, Observing, Paying
from uas_coverage_env.env.episode.observe import LOOK_AROUND, look_around, looks_with
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
from uas_coverage_env.simulation.step import STAGES, EachUas, WorldStages
from uas_coverage_env.world.contacts import check_obstacles_of

ACCEPTED = -1


class Rules(NamedTuple):
    """What holds for all steps of a mission."""

    acting: Acting
    nonlinear: int
    """Whether the 6-DOF plant is flown, as a number."""
    assistants: Any
    """Which help to fly, see `autopilot.assist`; on a GPU `Room` for guidance, or None."""
    code: Any
    """What features do, see `simulation.points.FeatureCode`; None on a GPU."""
    paying: Paying
    observing: Observing


def _pay_with(compute_rewards: Any) -> Any:
    """The stage that rewards and reports a step, and says who looks around.

    Args:
        compute_rewards: See `pay.compute_rewards_with`.
    """

    @inlined_kernel
    def pay(arena, state, tables, learners, scratch, rules):
        paying = rules.paying
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
            status, flew = state.uas[i].status, outcome[i].flew
            if rarely(not flew and status == FLYING):
                # where it was to go before it swapped packs is forgotten
                learners.targets[i] = NO_TARGET
            scratch.looks[i] = flew or status in (FLYING, SWAPPING)

    return pay


STAGE = "arena, state, tables, learners, scratch, rules"
"""The arguments of a stage of the flight."""


class Stages(NamedTuple):
    """The stages of a step of a mission, in their order.

    A single mission flies through all of them; a batch lets many fly through one before the next
    begins, and a GPU all UAS at once through those that are `EachUas`, with the same results.
    """

    flight: tuple[Any, ...]
    """Fly and pay: kernels of the arguments `STAGE`, or `EachUas`. All actions are finite; at the
    end `scratch.looks` says who looks around."""
    looks: tuple[Any, ...]
    """Observe, see `observe.looks_with`."""

    @property
    def whole(self) -> "Stages":
        """The same for all UAS of a mission: of the arguments `STAGE` and `LOOK_AROUND`."""
        flight = (
            of_all(each.kernel) if isinstance(each, EachUas) else each for each in self.flight
        )
        return Stages(tuple(flight), tuple(map(look_around, self.looks)))


@cache
def of_all(kernel: Any) -> Any:
    """A stage of one UAS for all of them in turn."""

    @inlined_kernel
    def stage(arena, state, tables, learners, scratch, rules):
        for i in range(state.uas.shape[0]):
            kernel(arena, state, tables, learners, scratch, rules, i)

    return stage


@inlined_kernel
def meet(arena, state, tables, learners, scratch, rules, i):
    """The stage in which a UAS meets obstacles, or does not."""
    check_obstacles_of(arena, state, i, scratch.outcome)


@cache
def stages_of(
    write_command: Any, world: WorldStages, compute_rewards: Any, looks: tuple[Any, ...]
) -> Stages:
    """The stages of a step, made of these functions.

    Args:
        write_command: See `act.write_command_with`.
        world: See `simulation.step.stages_with`.
        compute_rewards: See `pay.compute_rewards_with`.
        looks: See `observe.looks_with`.
    """
    prepare, move_world, judge_world = world

    @inlined_kernel
    def act(arena, state, tables, learners, scratch, rules):
        observed = as_observed(state)
        for i in range(scratch.commands.shape[0]):
            write_command(arena, observed, tables, learners, scratch, rules.acting, i)
        prepare(
            arena, state, scratch.commands, rules.nonlinear != 0, rules.assistants, rules.code,
            scratch.outcome,
        )  # fmt: skip

    @inlined_kernel
    def move(arena, state, tables, learners, scratch, rules):
        move_world(arena, state, rules.nonlinear != 0, rules.code, scratch.outcome)

    @inlined_kernel
    def judge(arena, state, tables, learners, scratch, rules):
        judge_world(arena, state, rules.nonlinear != 0, rules.code, scratch.outcome)

    first: tuple[Any, ...] = act, move
    if isinstance(prepare, EachUas) and isinstance(move_world, EachUas):
        first = _of_uas(write_command, prepare.kernel, move_world.kernel)
    return Stages((*first, EachUas(meet), judge, _pay_with(compute_rewards)), looks)


def _of_uas(write_command: Any, prepare: Any, move_world: Any) -> tuple[EachUas, EachUas]:
    """The first two stages where each UAS flies whatever the others do."""

    @inlined_kernel
    def act(arena, state, tables, learners, scratch, rules, i):
        write_command(arena, as_observed(state), tables, learners, scratch, rules.acting, i)
        prepare(
            arena, state, scratch.commands, rules.nonlinear != 0, rules.assistants, rules.code,
            scratch.outcome, i,
        )  # fmt: skip

    @inlined_kernel
    def move(arena, state, tables, learners, scratch, rules, i):
        move_world(arena, state, rules.nonlinear != 0, rules.code, scratch.outcome, i)

    return EachUas(act), EachUas(move)


@cache
def stages_with(version: Version) -> Stages:
    """`stages_of` what is in a version; other blocks, terms and kinds are called."""
    return stages_of(
        write_command_with(version.actions),
        STAGES,
        compute_rewards_with(version.reward),
        looks_with(version.observation),
    )


_views = EPISODE.views
_N_NUMBERS = EPISODE.size


@cache
def step_episode_with(version: Version) -> Any:
    """A step of one mission called from Python; or in a scene that is new, the look around alone.

    Returns:
        `step_episode(at, nonlinear, new_scene, before, observation)`: ACCEPTED, or the index of a
        UAS whose action is not finite; then nothing has changed. What a UAS that does not fly has
        seen last, in `before` (U, V), stays in `observation`, another array. `at` says where the
        arrays of `EPISODE` lie, then number and addresses of the assistants, then what features
        do: to hand over every array would take longer than the flight of a UAS.
    """
    stages = stages_with(version).whole
    fly, look = in_turn(stages.flight, STAGE), in_turn(stages.looks, LOOK_AROUND)

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
        if rarely(new_scene):
            # what those have seen last that do not fly stays
            write_around(state.uncovered, tables.neighbours, learners.around)
            for i in range(observation.shape[0]):
                scratch.looks[i] = state.uas[i].status == FLYING
        else:
            fly(arena, state, tables, learners, scratch, rules)
        seen = as_observed(state)
        look(arena, seen, tables, learners, observing, scratch.looks, observation)
        return ACCEPTED

    return step_episode
