"""One step as a learner sees it, compiled: actions in; world, rewards and observations out."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.borrow import lend, part
from uas_coverage_env.env.actions import RANGES_DTYPE, first_not_finite, write_commands
from uas_coverage_env.env.layout import K_WAYPOINTS, OBSERVATION_SIZE
from uas_coverage_env.env.nearest import NEIGHBOURS_DTYPE, count_company
from uas_coverage_env.env.observation import SCALES_DTYPE, look
from uas_coverage_env.env.rewards import REWARD_TERMS, pay
from uas_coverage_env.kernels import inlined_kernel, kernel
from uas_coverage_env.vehicle import N_STATES
from uas_coverage_env.vehicle.compiled import VEHICLE_DTYPE
from uas_coverage_env.world import (
    COMMAND_DTYPE,
    FLYING,
    OUTCOME_DTYPE,
    Arena,
    AssistantCode,
    WorldState,
    advance,
)
from uas_coverage_env.world.arena import (
    MOVING_DTYPE,
    N_WAYPOINT_COLUMNS,
    OBSTACLE_DTYPE,
    RULES_DTYPE,
    UAS_DTYPE,
    WAYPOINT_DTYPE,
)
from uas_coverage_env.world.boxes import N_COLUMNS, padded

ENERGY, CONTACT, CONTACT_WITH, STATUS, FILTERED, RETURNING, COVERED, REWARD = range(
    len(REWARD_TERMS), len(REWARD_TERMS) + 8
)
"""Columns of a report behind the reward terms: energy drawn since t = 0 [Wh], outcome of the step,
number of waypoints that the swarm has covered so far, and the sum of the reward terms, added up in
their order (Python's own `sum` rounds in another way since 3.12)."""

REPORT_SIZE = REWARD + 1

ACCEPTED = -1

FLOAT, SINGLE = np.dtype(np.float64), np.dtype(np.float32)
INT, BOOL = np.dtype(np.int64), np.dtype(np.bool_)


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
    arena, state, kind, ranges, scales, neighbours, weights, nonlinear, assistants, asked,
    targets, candidates, company, commands, outcome, report, max_cycles, observation,
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
        assistants: See `world.advance`.
        asked: (U, size) the actions, all finite.
        targets: (U,) where each is flying to (waypoint action); written.
        candidates: (U, K_WAYPOINTS) as in the last observation; written.
        company: (W, 2) see `count_company`; written.
        commands: (U,) of COMMAND_DTYPE; written.
        outcome: (U,) of OUTCOME_DTYPE; written.
        report: (U, REPORT_SIZE) reward terms, then the columns named above; written.
        max_cycles: Steps after which the episode is cut.
        observation: (U, OBSERVATION_SIZE) float32; that of a UAS that did not fly stays.
    """
    write_commands(state, kind, ranges, asked, candidates, targets, commands)
    advance(arena, state, commands, nonlinear, assistants, outcome)
    settle(
        arena, state, scales, neighbours, weights, targets, candidates, company, commands, outcome,
        report, max_cycles, observation,
    )  # fmt: skip


N_ARRAYS = 32
"""Arrays whose addresses `step_episode` is given."""

N_SIZES = 9
"""Numbers of UAS, obstacles, planes, moving obstacles, samples of their way, waypoints, corners of
routes, numbers of an action, and assistants."""


@kernel
def step_episode(at, sizes, kind, nonlinear, max_cycles, before, observation):
    """`step_learners` called from Python.

    What a UAS that does not fly has seen last, in `before`, stays in `observation`.

    Args:
        at: Addresses of the arrays and assistants, see `addresses_of`: to hand over every array
            would take longer than the flight of a UAS.
        sizes: (N_SIZES,) what their shapes are made of.
        kind: See `step_learners`.
        nonlinear: See `step_learners`.
        max_cycles: Steps after which the episode is cut.
        before: (U, OBSERVATION_SIZE) float32, the observation of the step before.
        observation: (U, OBSERVATION_SIZE) float32, another array; written.

    Returns:
        ACCEPTED, or the index of a UAS whose action is not finite; then nothing has changed.
    """
    u = sizes[0]
    o = sizes[1]
    f = sizes[2]
    m = sizes[3]
    t = sizes[4]
    w = sizes[5]
    n = sizes[6]
    arena = Arena(
        lend(at[0], VEHICLE_DTYPE, (u,)), lend(at[1], UAS_DTYPE, (u,)),
        lend(at[2], OBSTACLE_DTYPE, (o,)), lend(at[3], FLOAT, (N_COLUMNS, padded(o))),
        lend(at[4], FLOAT, (f, 3)), lend(at[5], FLOAT, (f,)),
        lend(at[6], MOVING_DTYPE, (m,)), lend(at[7], FLOAT, (t, m, 3)),
        lend(at[8], FLOAT, (t, m, 3)), lend(at[9], WAYPOINT_DTYPE, (w,)),
        lend(at[10], FLOAT, (N_WAYPOINT_COLUMNS, w)), lend(at[11], RULES_DTYPE, (1,)),
        lend(at[12], FLOAT, (n, 2)), lend(at[13], FLOAT, (w + u, n)),
    )  # fmt: skip
    state = WorldState(
        lend(at[14], FLOAT, (u, N_STATES)), lend(at[15], FLOAT, (u, 2)), lend(at[16], INT, (u,)),
        lend(at[17], BOOL, (u,)), lend(at[18], BOOL, (u,)), lend(at[19], BOOL, (w,)),
        lend(at[20], INT, (1,)),
    )  # fmt: skip
    asked = lend(at[25], FLOAT, (u, sizes[7]))
    invalid = first_not_finite(asked)
    if invalid != ACCEPTED:
        return invalid
    for i in range(u):
        if state.status[i] != FLYING:
            for k in range(OBSERVATION_SIZE):
                observation[i, k] = before[i, k]
    step_learners(
        arena, state, kind, lend(at[21], RANGES_DTYPE, (u,)), lend(at[22], SCALES_DTYPE, (u,)),
        lend(at[23], NEIGHBOURS_DTYPE, (w,)), lend(at[24], FLOAT, (len(REWARD_TERMS),)),
        nonlinear, part(at, N_ARRAYS, sizes[8]), asked,
        lend(at[26], INT, (u,)), lend(at[27], INT, (u, K_WAYPOINTS)), lend(at[28], SINGLE, (w, 2)),
        lend(at[29], COMMAND_DTYPE, (u,)), lend(at[30], OUTCOME_DTYPE, (u,)),
        lend(at[31], FLOAT, (u, REPORT_SIZE)), max_cycles, observation,
    )  # fmt: skip
    return ACCEPTED


def addresses_of(
    arena: Arena,
    state: WorldState,
    learners: Sequence[NDArray[Any]],
    assistants: AssistantCode,
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Where the arrays of an episode lie; they have to stay there.

    Args:
        arena: The arena.
        state: The state of the world.
        learners: The arrays of `step_learners` in the order of its arguments: ranges, scales,
            neighbours, weights, asked, targets, candidates, company, commands, outcome, report.
        assistants: Who helps to fly.

    Returns:
        Addresses and sizes, see `step_episode`.
    """
    arrays = (*arena, *state, *learners)
    assert len(arrays) == N_ARRAYS
    assert all(array.flags.c_contiguous for array in arrays)
    asked = learners[4]
    sizes = (
        len(arena.uas), len(arena.obstacles), len(arena.normals), *arena.moving_path_m.shape[1::-1],
        len(arena.waypoints), len(arena.nodes_m), asked.shape[1], len(assistants),
    )  # fmt: skip
    return np.array([*(array.ctypes.data for array in arrays), *assistants]), np.array(sizes)
