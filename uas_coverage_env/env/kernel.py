"""One step as a learner sees it, compiled: actions in; world, rewards and observations out."""

from collections.abc import Callable, Sequence
from typing import Any

from numba import njit, typeof

from uas_coverage_env.env.actions import first_not_finite, write_commands
from uas_coverage_env.env.nearest import count_company
from uas_coverage_env.env.observation import observe
from uas_coverage_env.env.rewards import REWARD_TERMS, pay
from uas_coverage_env.world import FLYING, Arena, WorldState, advance

ENERGY, CONTACT, CONTACT_WITH, STATUS, FILTERED, RETURNING, COVERED = range(
    len(REWARD_TERMS), len(REWARD_TERMS) + 7
)
"""Columns of a report behind the reward terms: energy drawn since t = 0 [Wh], outcome of the step,
number of waypoints that the swarm has covered so far."""

REPORT_SIZE = COVERED + 1

ACCEPTED = -1


@njit(cache=True, error_model="numpy")
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
    was_flying = state.status == FLYING
    write_commands(state, kind, ranges, asked, candidates, targets, commands)
    advance(arena, state, commands, nonlinear, return_mode, safety_filter, outcome)
    over = state.step[0] >= max_cycles
    pay(arena, state, was_flying, commands, outcome, weights, over, report)
    covered = state.uncovered.shape[0] - state.uncovered.sum()
    newly_covered = 0
    for i in range(report.shape[0]):
        event = outcome[i]
        report[i, ENERGY] += event.energy_Wh
        report[i, CONTACT] = event.contact
        report[i, CONTACT_WITH] = event.contact_with
        report[i, STATUS] = state.status[i]
        report[i, FILTERED] = event.filtered
        report[i, RETURNING] = event.returning
        report[i, COVERED] = covered
        newly_covered += event.newly_covered
    if newly_covered > 0:
        count_company(state.uncovered, neighbours, company)
    observe(arena, state, scales, company, was_flying, targets, max_cycles, candidates, observation)
    return ACCEPTED


@njit(cache=True, error_model="numpy")
def step_episode(
    vehicles, uas, obstacles, normals, offsets_m, moving, moving_path_m, moving_velocity_mps,
    waypoints, rules, nodes_m, node_distance_m,
    x, reference, status, departed, returning, uncovered, step,
    kind, ranges, scales, neighbours, weights, nonlinear, return_mode, safety_filter,
    asked, targets, candidates, company, commands, outcome, report, max_cycles, observation,
):  # fmt: skip
    """`step_learners` called from Python: arrays one by one cost less than two named tuples."""
    arena = Arena(
        vehicles, uas, obstacles, normals, offsets_m, moving, moving_path_m, moving_velocity_mps,
        waypoints, rules, nodes_m, node_distance_m,
    )  # fmt: skip
    state = WorldState(x, reference, status, departed, returning, uncovered, step)
    return step_learners(
        arena, state, kind, ranges, scales, neighbours, weights, nonlinear, return_mode,
        safety_filter, asked, targets, candidates, company, commands, outcome, report, max_cycles,
        observation,
    )  # fmt: skip


def compiled_step(arguments: Sequence[Any]) -> Callable[..., int]:
    """`step_episode` as machine code for arguments of these types.

    Called directly, it spares numba's look at the type of each of its 35 arguments, a tenth of a
    step. The caller has to keep to the types.
    """
    if not hasattr(step_episode, "compile"):
        return step_episode  # NUMBA_DISABLE_JIT=1: a function like any other
    return step_episode.compile(tuple(typeof(argument) for argument in arguments))
