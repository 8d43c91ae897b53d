"""One step of the world: the rules of the game."""

import math
from functools import cache
from typing import Any, NamedTuple

from uas_coverage_env.autopilot.assist import assist
from uas_coverage_env.compiled.kernels import inlined_kernel, kernel, rarely
from uas_coverage_env.compiled.views import Layout, slice_view
from uas_coverage_env.entities.commands import ACCELERATION, GO_TO, HOME, VELOCITY, WRENCH
from uas_coverage_env.entities.outcome import NONE
from uas_coverage_env.entities.state import FLYING, LOST, STATE, as_measured
from uas_coverage_env.simulation.flight import fly, fly_still_of
from uas_coverage_env.simulation.points import (
    COMMAND,
    JUDGED,
    MOVED,
    SENSED,
    begin_features,
    call_features,
)
from uas_coverage_env.vehicle.layout import N_INPUTS, X
from uas_coverage_env.world.arena import ARENA
from uas_coverage_env.world.contacts import (
    check_fence_and_battery,
    check_limits,
    check_obstacles,
    check_separation,
    check_wrenches,
    count_breaches,
)
from uas_coverage_env.world.coverage import cover, land
from uas_coverage_env.world.events import begin_events

ACCEPTED, LACKS_GUIDANCE = -1, -2


@kernel
def first_invalid(arena, state, commands):
    """Index of the first flying UAS whose command cannot be flown; ACCEPTED where all can."""
    for i in range(state.uas.shape[0]):
        if state.uas[i].status != FLYING:
            continue
        command = commands[i]
        kind = command.kind
        values = command.values
        if kind != VELOCITY and kind != ACCELERATION and kind != WRENCH and kind != GO_TO:
            return i
        for k in range(4):
            if not math.isfinite(values[k]):
                return i
        if kind == GO_TO:
            target = values[0]
            if target != math.floor(target) or not HOME <= target < arena.waypoints.shape[0]:
                return i
    return ACCEPTED


@inlined_kernel
def begin_step_of(state, commands, outcome, i):
    """An outcome of a UAS in which nothing has happened yet, with its command as it was given.

    Field by field, which is an eighth of a step faster than a record at once; a test finds a field
    that is forgotten here. What acts on how UAS fly is reset by `flight.clear`.
    """
    event = outcome[i]
    event.flew = state.uas[i].status == FLYING
    for k in range(3):
        event.before_m[k] = state.x[i, X + k]
    for k in range(N_INPUTS):
        event.u[k] = 0.0
    event.voltage_V = 0.0
    event.current_A = 0.0
    event.energy_Wh = 0.0
    event.newly_covered = 0
    event.newly_covered_weight = 0.0
    event.contact = NONE
    event.contact_with = -1
    event.breaches = 0
    event.too_low = False
    event.below_reserve = False
    event.limits_exceeded = 0
    event.landed = False
    event.obstacle_clearance_m = math.inf
    event.separation_m = math.inf
    event.fence_clearance_m = math.inf
    event.filtered = False
    event.grounded = False
    given = commands[i]
    event.returning = given.returning
    applied = event.applied_command
    applied.kind = given.kind
    for k in range(4):
        applied.values[k] = given.values[k]
    applied.returning = given.returning


@inlined_kernel
def begin_step(state, commands, outcome):
    """`begin_step_of` all UAS."""
    for i in range(commands.shape[0]):
        begin_step_of(state, commands, outcome, i)


@inlined_kernel
def _mark_lost(state, outcome):
    for i in range(state.uas.shape[0]):
        if state.uas[i].status == FLYING and outcome[i].contact != NONE:
            state.uas[i].status = LOST


@inlined_kernel
def judge_contacts(arena, state, nonlinear, outcome):
    """Judge a step that has been flown, after `check_obstacles`."""
    check_separation(arena, state, outcome)
    check_fence_and_battery(arena, state, outcome)
    if rarely(arena.rules[0].judges_wrenches):
        check_wrenches(arena, state, outcome)
    count_breaches(arena, state, outcome)
    cover(arena, state, state.step[0] + 1, outcome)
    land(arena, state, outcome)
    check_limits(arena, state, nonlinear, outcome)
    _mark_lost(state, outcome)
    state.step[0] += 1


class EachUas(NamedTuple):
    """A stage of a step for one UAS, whatever the others do in it.

    The processor flies all through it in turn, a GPU has a thread for each.
    """

    kernel: Any
    """Takes what the stage of all takes, and then the index of the UAS."""


class WorldStages(NamedTuple):
    """What `advance` does before and after it looks for contacts with obstacles, as there.

    The first two may be `EachUas`.
    """

    prepare: Any
    """`prepare(arena, state, commands, nonlinear, assistants, code, outcome)`: what is flown."""
    move: Any
    """`move(arena, state, nonlinear, code, outcome)`."""
    judge: Any
    """`judge(arena, state, nonlinear, code, outcome)`."""


@inlined_kernel
def _assist_all(assistants, arena, measured, nonlinear, outcome):
    for k in range(len(assistants)):
        assist(assistants[k], arena, measured, nonlinear, outcome)


@cache
def stages_with(call_features: Any, fly: Any, assist_all: Any = _assist_all) -> WorldStages:
    """The stages of a step of the world, made of these functions.

    Args:
        call_features: See `points.call_features`.
        fly: See `flight.fly`.
        assist_all: Calls the assistants.
    """

    @inlined_kernel
    def prepare(arena, state, commands, nonlinear, assistants, code, outcome):
        begin_step(state, commands, outcome)
        call_features(COMMAND, arena, state, code, outcome)
        if assistants is not None:
            assist_all(assistants, arena, as_measured(state), nonlinear, outcome)

    @inlined_kernel
    def move(arena, state, nonlinear, code, outcome):
        fly(arena, state, nonlinear, code, outcome)
        call_features(MOVED, arena, state, code, outcome)

    @inlined_kernel
    def judge(arena, state, nonlinear, code, outcome):
        judge_contacts(arena, state, nonlinear, outcome)
        call_features(JUDGED, arena, state, code, outcome)
        call_features(SENSED, arena, state, code, outcome)

    return WorldStages(prepare, move, judge)


@inlined_kernel
def _move_still(arena, state, nonlinear, code, outcome, i):
    fly_still_of(arena, state, i, outcome)


@cache
def plain_stages_with(call_features: Any, assist_one: Any) -> WorldStages:
    """`stages_with`, where nothing acts on how UAS fly: in still air, by the linear model.

    Args:
        call_features: See `points.call_features`.
        assist_one: Assists a UAS.
    """

    @inlined_kernel
    def prepare(arena, state, commands, nonlinear, assistants, code, outcome, i):
        begin_step_of(state, commands, outcome, i)
        if assistants is not None:
            assist_one(assistants, arena, as_measured(state), nonlinear, outcome, i)

    judge = stages_with(call_features, fly).judge
    return WorldStages(EachUas(prepare), EachUas(_move_still), judge)


STAGES = stages_with(call_features, fly)
_prepare, _move, _judge = STAGES


@kernel
def advance(arena, state, commands, nonlinear, assistants, code, outcome):
    """Fly all UAS for one step and judge what happened by the rules of `docs/rules.md`.

    Args:
        arena: The arena.
        state: The state; written in place.
        commands: (U,) of COMMAND_DTYPE, valid for every flying UAS (see `first_invalid`).
        nonlinear: Fly the 6-DOF plant instead of the linear parameter-varying model.
        assistants: What helps to fly, see `assistants`; None: nothing does. Commands of kind
            GO_TO need guidance.
        code: `FeatureCode` of what is in the arena; None: see `fly`.
        outcome: (U,) of OUTCOME_DTYPE; written.
    """
    _prepare(arena, state, commands, nonlinear, assistants, code, outcome)
    _move(arena, state, nonlinear, code, outcome)
    check_obstacles(arena, state, outcome)
    _judge(arena, state, nonlinear, code, outcome)


@kernel
def begin_mission(arena, state, outcome):
    """Put the world at t = 0: what lies within reach of the starts is covered at once."""
    cover(arena, state, 0, outcome)


MISSION = Layout(ARENA, STATE)
_views = MISSION.views
_N_NUMBERS = MISSION.size


@kernel
def step_world(at, commands, nonlinear, goes_to, assistants, outcome):
    """`advance` called from Python.

    Args:
        at: Addresses of arena and state, see `MISSION`, then `FeatureCode`.
        commands: See `advance`, also the next three.
        nonlinear: Whether the 6-DOF plant is flown.
        goes_to: Whether guidance is among the assistants.
        assistants: What helps to fly.
        outcome: Written.

    Returns:
        ACCEPTED; the index of a UAS whose command is invalid, or LACKS_GUIDANCE: then nothing has
        changed.
    """
    arena, state = _views(at)
    invalid = first_invalid(arena, state, commands)
    if not goes_to:
        for i in range(commands.shape[0]):
            if commands[i].kind == GO_TO and invalid == ACCEPTED:
                invalid = LACKS_GUIDANCE
    if invalid == ACCEPTED:
        code = slice_view(at, _N_NUMBERS, at.shape[0] - _N_NUMBERS)
        advance(arena, state, commands, nonlinear, assistants, code, outcome)
    return invalid


@kernel
def begin_features_at(at, seed, mission):
    """Draw what a mission's events and features need; called from Python, `at` as above."""
    arena, state = _views(at)
    begin_events(arena, state, seed, mission)
    code = slice_view(at, _N_NUMBERS, at.shape[0] - _N_NUMBERS)
    begin_features(arena, state, code, seed, mission)
