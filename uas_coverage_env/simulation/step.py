"""One step of the world: the rules of the game."""

import math

from uas_coverage_env.autopilot.assist import assist
from uas_coverage_env.autopilot.belief import believed_wrench, expect, learn
from uas_coverage_env.autopilot.control import command_wrench
from uas_coverage_env.compiled.array_views import slice_view
from uas_coverage_env.compiled.kernels import inlined_kernel, kernel, rare_kernel, rarely
from uas_coverage_env.compiled.views import Layout
from uas_coverage_env.disturbances.act import disturb
from uas_coverage_env.vehicle import (
    DOD,
    N_INPUTS,
    X,
    enter_air,
    face_course,
    leave_air,
    lpv_step,
    plant_step,
    push,
    reseed_reference,
)
from uas_coverage_env.vehicle.discharge import discharge_further
from uas_coverage_env.world.arena import ARENA
from uas_coverage_env.world.commands import ACCELERATION, GO_TO, HOME, VELOCITY, WRENCH
from uas_coverage_env.world.contacts import (
    check_fence_and_battery,
    check_limits,
    check_obstacles,
    check_separation,
    check_wrenches,
    count_breaches,
)
from uas_coverage_env.world.coverage import cover, land
from uas_coverage_env.world.events import happen, heed, rest, sense
from uas_coverage_env.world.outcome import NONE
from uas_coverage_env.world.packs import swap_packs
from uas_coverage_env.world.state import FLYING, LOST, STATE, as_felt, as_sensed

ACCEPTED = -1


@kernel
def first_invalid(arena, state, commands):
    """Index of the first flying UAS whose command cannot be flown; ACCEPTED where all can."""
    for i in range(state.status.shape[0]):
        if state.status[i] != FLYING:
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
def begin_step(state, commands, outcome):
    """An outcome in which nothing has happened yet, with the commands as they were given.

    Field by field, which is an eighth of a step faster than a record at once; a test finds a field
    that is forgotten here. What disturbances do is reset by `disturb`.
    """
    for i in range(commands.shape[0]):
        event = outcome[i]
        event.flew = state.status[i] == FLYING
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
        event.limits_exceeded = 0
        event.landed = False
        event.obstacle_clearance_m = math.inf
        event.separation_m = math.inf
        event.fence_clearance_m = math.inf
        event.filtered = False
        event.returning = False
        event.grounded = False
        given = commands[i]
        applied = event.applied_command
        applied.kind = given.kind
        for k in range(4):
            applied.values[k] = given.values[k]
        applied.returning = given.returning


@inlined_kernel
def _write_inputs(arena, state, i, outcome):
    """What the inner loop, or a wrench, asks of the motors of a UAS."""
    event = outcome[i]
    vehicle = arena.vehicles[i]
    command_wrench(vehicle, state.x[i], state.reference[i], event.applied_command, event.u[:])
    if rarely(vehicle.follows_course):
        face_course(vehicle, state.x[i], event.u[:])


@rare_kernel
def _write_believed_inputs(arena, state, felt, nonlinear, i, outcome):
    """Likewise as the disturbances believed in demand it, and what is expected to come of it.

    The disturbances are found out from the true motion, whatever error the sensors have.
    """
    vehicle, belief, u = arena.vehicles[i], state.belief[i], outcome[i].u[:]
    command = outcome[i].applied_command
    if state.step[0] == 0 and command.kind != WRENCH:
        # a first look at the wind: to set off before would take more tilt than there is
        command = arena.rules[0].brake
    believed_wrench(vehicle, belief, felt.x[i], felt.reference[i], command, u)
    if vehicle.follows_course:
        face_course(vehicle, felt.x[i], u)
    expect(vehicle, belief, nonlinear, state.x[i], u)


@inlined_kernel
def write_all_inputs(arena, state, nonlinear, outcome):
    """What the motors of all UAS are asked for: a disturbance of one may depend on the others'."""
    felt = as_felt(arena, state)
    for i in range(state.status.shape[0]):
        if state.status[i] == FLYING:
            _write_believed_inputs(arena, state, felt, nonlinear, i, outcome)


@inlined_kernel
def _flown_vehicle(arena, state, i):
    """The vehicle that flies: the true one, where that may be another than is believed."""
    if rarely(state.true_vehicles.shape[0] > 0):
        return state.true_vehicles[i]
    return arena.vehicles[i]


@rare_kernel
def _move_nonlinear(vehicle, x, u):
    """Fly one step of the 6-DOF plant."""
    return plant_step(vehicle, x, u, x)


@rare_kernel
def _be_pushed(vehicle, flown, belief, event, step, dod_before, x):
    """What wind, forces and faults add to a step that was flown in the air, and what is learnt."""
    leave_air(vehicle, x, event.wind_mps)
    push(flown, x, event.force_N)
    x[DOD] += event.dod_lost
    learn(vehicle, belief, step, dod_before, x)


@inlined_kernel
def _move(arena, state, nonlinear, disturbed, i, outcome):
    """Fly the inputs of a UAS for one step."""
    x = state.x[i]
    event = outcome[i]
    u = event.u[:]
    vehicle, flown = arena.vehicles[i], _flown_vehicle(arena, state, i)
    dod_before = x[DOD]
    if rarely(disturbed):
        enter_air(x, event.wind_mps)
    if rarely(nonlinear):
        voltage_V, current_A = _move_nonlinear(flown, x, u)
    else:
        voltage_V, current_A = lpv_step(flown, x, u, x)
    if rarely(flown.n_further > 0):
        discharge_further(flown, flown.further_V, current_A, flown.dt_s)
    if rarely(disturbed):
        _be_pushed(vehicle, flown, state.belief[i], event, state.step[0], dod_before, x)
    event.voltage_V = voltage_V
    event.current_A = current_A
    event.energy_Wh = voltage_V * current_A * (arena.rules[0].dt_s / 3600.0)
    if rarely(event.applied_command.kind == WRENCH):
        reseed_reference(vehicle, x, state.reference[i])


@inlined_kernel
def _move_or_rest(arena, state, nonlinear, disturbed, i, outcome):
    if rarely(outcome[i].grounded):
        rest(arena, state, i, outcome)
    else:
        _move(arena, state, nonlinear, disturbed, i, outcome)


@inlined_kernel
def move_all(arena, state, nonlinear, outcome):
    """Fly the inputs, the winds and the forces in `outcome` for one step."""
    for i in range(state.status.shape[0]):
        if state.status[i] == FLYING:
            _move_or_rest(arena, state, nonlinear, True, i, outcome)


@inlined_kernel
def _fly(arena, state, nonlinear, disturbances, outcome):
    """Fly the commands for one step."""
    disturbed = arena.rules[0].disturbed
    if rarely(disturbed):
        write_all_inputs(arena, state, nonlinear, outcome)
        disturb(arena, state, disturbances, outcome)
    felt = as_felt(arena, state)
    for i in range(state.status.shape[0]):
        if state.status[i] != FLYING:
            continue
        if not disturbed:
            _write_inputs(arena, felt, i, outcome)
        _move_or_rest(arena, state, nonlinear, disturbed, i, outcome)


@inlined_kernel
def _mark_lost(state, outcome):
    for i in range(state.status.shape[0]):
        if state.status[i] == FLYING and outcome[i].contact != NONE:
            state.status[i] = LOST


@inlined_kernel
def carry_out(arena, state, nonlinear, disturbances, outcome):
    """Fly the commands in `outcome`, of any kind but GO_TO, and judge what happened.

    The second half of `advance`. It makes no arrays at all, so it runs on a GPU too.
    There `disturbances` is None, see `disturb`.
    """
    _fly(arena, state, nonlinear, disturbances, outcome)
    judge(arena, state, nonlinear, outcome)


@inlined_kernel
def judge(arena, state, nonlinear, outcome):
    """Judge what happened in a step that has been flown."""
    eventful = arena.rules[0].eventful
    if rarely(eventful):
        happen(arena, state, outcome)
    check_obstacles(arena, state, outcome)
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
    if rarely(arena.packs.shape[0] > 0):
        swap_packs(arena, state, outcome)
    if rarely(eventful):
        sense(arena, state)


@kernel
def advance(arena, state, commands, nonlinear, assistants, disturbances, outcome):
    """Fly all UAS for one step and judge what happened by the rules of `docs/rules.md`.

    All decide from the state at sample k; then all fly; then contacts are judged on the straight
    segments between the samples, and breaches, coverage and landing at sample k+1.

    Args:
        arena: The arena.
        state: The state; written in place.
        commands: (U,) of COMMAND_DTYPE, valid for every flying UAS (see `first_invalid`).
        nonlinear: Fly the 6-DOF plant instead of the linear parameter-varying model.
        assistants: What helps to fly, see `assistants`. Commands of kind GO_TO need guidance.
        disturbances: `DisturbanceCode` of those in the arena; None, where there are none or they
            are those of the package: no call of an address is compiled then.
        outcome: (U,) of OUTCOME_DTYPE; written.
    """
    begin_step(state, commands, outcome)
    if rarely(arena.rules[0].eventful):
        heed(arena, state, outcome)
    seen = as_sensed(arena, state)
    for k in range(len(assistants)):
        assist(assistants[k], arena, seen, nonlinear, outcome)
    carry_out(arena, state, nonlinear, disturbances, outcome)


@kernel
def begin_mission(arena, state, outcome):
    """Put the world at t = 0: what lies within reach of the starts is covered at once."""
    cover(arena, state, 0, outcome)


MISSION = Layout(ARENA, STATE)
_views = MISSION.views
_N_NUMBERS = MISSION.size


@kernel
def step_world(at, commands, nonlinear, assistants, outcome):
    """`advance` called from Python.

    Args:
        at: Addresses of arena and state, see `MISSION`, then of the disturbances.
        commands: See `advance`, also the next three.
        nonlinear: Whether.
        assistants: What helps to fly.
        outcome: Written.

    Returns:
        ACCEPTED, or the index of a UAS whose command is invalid; then nothing has changed.
    """
    arena, state = _views(at)
    invalid = first_invalid(arena, state, commands)
    if invalid == ACCEPTED:
        disturbances = slice_view(at, _N_NUMBERS, at.shape[0] - _N_NUMBERS)
        advance(arena, state, commands, nonlinear, assistants, disturbances, outcome)
    return invalid
