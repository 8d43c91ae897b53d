"""One step as a learner sees it, compiled: actions in; world, rewards and observations out."""

from collections.abc import Callable, Sequence
from typing import Any

from numba import typeof

from uas_coverage_env.env.actions import first_not_finite, write_commands
from uas_coverage_env.env.nearest import count_company
from uas_coverage_env.env.observation import look
from uas_coverage_env.env.rewards import REWARD_TERMS, pay
from uas_coverage_env.kernels import inlined_kernel, kernel
from uas_coverage_env.world import FLYING, Arena, WorldState, advance

ENERGY, CONTACT, CONTACT_WITH, STATUS, FILTERED, RETURNING, COVERED, REWARD = range(
    len(REWARD_TERMS), len(REWARD_TERMS) + 8
)
"""Columns of a report behind the reward terms: energy drawn since t = 0 [Wh], outcome of the step,
number of waypoints that the swarm has covered so far, and the sum of the reward terms, added up in
their order (Python's own `sum` rounds in another way since 3.12)."""

REPORT_SIZE = REWARD + 1

ACCEPTED = -1


@inlined_kernel
def settle(
    arena, state, scales, neighbours, weights, targets, candidates, company, commands, outcome,
    report, max_cycles, observation,
):  # fmt: skip
    """Pay for a step that was flown and look around; arguments as for `step_learners`."""
    over = state.step[0] >= max_cycles
    pay(arena, state, commands, outcome, weights, over, report)
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
        count_company(state.uncovered, neighbours, company)
    for i in range(report.shape[0]):
        if outcome[i].flew:
            look(
                arena, state, scales[i], company, i, targets, max_cycles, candidates[i],
                observation[i],
            )  # fmt: skip


@inlined_kernel
def step_learners(
    arena, state, kind, ranges, scales, neighbours, weights, nonlinear, return_mode, safety_filter,
    asked, targets, candidates, company, commands, outcome, report, max_cycles, observation,
):  # fmt: skip
    """Fly one step, pay for it and look around.

    Args:
        arena: The arena.
        state: The state of the world; written.
        kind: Kind of command that the actions become.
        ranges: (U,) of RANGES_DTYPE.
        scales: (U,) of SCALES_DTYPE.
        neighbours: (W,) of NEIGHBOURS_DTYPE.
        weights: (R,) of the reward terms.
        nonlinear: See `world.advance`.
        return_mode: See `world.advance`.
        safety_filter: See `world.advance`.
        asked: (U, size) the actions.
        targets: (U,) where each is flying to (waypoint action); written.
        candidates: (U, K_WAYPOINTS) as in the last observation; written.
        company: (W, 2) see `count_company`; written.
        commands: (U,) of COMMAND_DTYPE; written.
        outcome: (U,) of OUTCOME_DTYPE; written.
        report: (U, REPORT_SIZE) reward terms, then the columns named above; written.
        max_cycles: Steps after which the episode is cut.
        observation: (U, OBSERVATION_SIZE) float32; that of a UAS that did not fly stays.

    Returns:
        ACCEPTED, or the index of a UAS whose action is not finite; then nothing has changed.
    """
    invalid = first_not_finite(asked)
    if invalid != ACCEPTED:
        return invalid
    write_commands(state, kind, ranges, asked, candidates, targets, commands)
    advance(arena, state, commands, nonlinear, return_mode, safety_filter, outcome)
    settle(
        arena, state, scales, neighbours, weights, targets, candidates, company, commands, outcome,
        report, max_cycles, observation,
    )  # fmt: skip
    return ACCEPTED


@kernel
def step_episode(
    vehicles, uas, obstacles, normals, offsets_m, moving, moving_path_m, moving_velocity_mps,
    waypoints, rules, nodes_m, node_distance_m,
    x, reference, status, departed, returning, uncovered, step,
    kind, ranges, scales, neighbours, weights, nonlinear, return_mode, safety_filter,
    asked, targets, candidates, company, commands, outcome, report, max_cycles, before, observation,
):  # fmt: skip
    """`step_learners` called from Python: arrays one by one cost less than two named tuples.

    What a UAS that does not fly has seen last, in `before`, stays in `observation`.
    """
    arena = Arena(
        vehicles, uas, obstacles, normals, offsets_m, moving, moving_path_m, moving_velocity_mps,
        waypoints, rules, nodes_m, node_distance_m,
    )  # fmt: skip
    state = WorldState(x, reference, status, departed, returning, uncovered, step)
    for i in range(status.shape[0]):
        if status[i] != FLYING:
            for k in range(before.shape[1]):
                observation[i, k] = before[i, k]
    return step_learners(
        arena, state, kind, ranges, scales, neighbours, weights, nonlinear, return_mode,
        safety_filter, asked, targets, candidates, company, commands, outcome, report, max_cycles,
        observation,
    )  # fmt: skip


def compiled_step(arguments: Sequence[Any]) -> Callable[..., int]:
    """`step_episode` as machine code for arguments of these types.

    Called directly, it spares numba's look at the type of each of its 37 arguments, a tenth of a
    step. The caller has to keep to the types.
    """
    if not hasattr(step_episode, "compile"):
        return step_episode  # NUMBA_DISABLE_JIT=1: a function like any other
    return step_episode.compile(tuple(typeof(argument) for argument in arguments))
