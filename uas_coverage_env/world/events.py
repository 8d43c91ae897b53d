"""What happens during a mission: when, to which UAS, and what it does to the state.

The times are drawn when a mission begins and are part of its state. An event at sample k acts
between the step to it and what is judged there; what lasts, lasts for the steps from k on. Events
that change the scene are left to whoever holds the arena, see `simulation.World`.
"""

import math

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.compiled.kernels import inlined_kernel, kernel, rare_kernel
from uas_coverage_env.compiled.memory import record_dtype
from uas_coverage_env.compiled.random import counted, normal, uniform
from uas_coverage_env.scenario import Scenario
from uas_coverage_env.scenario.events import EFFECTS, OfUas
from uas_coverage_env.vehicle import DOD, N_STATES, U_TH, VX, VY, X, Y, open_circuit_V
from uas_coverage_env.world.commands import CLIMB, GO_TO, HOME, WRENCH
from uas_coverage_env.world.outcome import FAULT, NONE

NO_EFFECT, LOSE, DEAFEN, BLIND, GROUND, DISCHARGE, DROP = range(len(EFFECTS))

GO_ON, HOVER, RETURN = range(3)
"""What a UAS flies that hears no command: the first value of DEAFEN."""

NEVER = 2**62
"""The sample of an event that does not happen, and the steps of what does not end."""

BY_LOT, EVERY = -1, -2
"""In place of the index of a UAS."""

HEARD_KIND, HEARD_VALUES, HEARD_RETURNING = 0, 1, 5
"""Columns of `WorldState.heard`, a command as numbers: kind, four values from HEARD_VALUES on, and
whether it returns."""

N_HEARD = HEARD_RETURNING + 1

POSITION_BIAS, VELOCITY_BIAS, CHARGE_BIAS, DRIFT_DIRECTION = 0, 3, 6, 7
"""Columns of `WorldState.bias`, errors that a mission draws: position [m] and velocity [m/s], three
numbers each, depth of discharge [-], and the direction in which dead reckoning drifts [rad]."""

N_BIASES = DRIFT_DIRECTION + 1

N_DELAYED = 8
"""Samples that are kept of what is sensed late."""

_EVENT_KEY, _SENSING_KEY = np.uint64(0x6576656E74730001), np.uint64(0x73656E73696E6701)

EVENT_DTYPE = record_dtype(
    [
        # one of the effects above
        ("effect", "i8"),
        # index, BY_LOT or EVERY
        ("uas", "i8"),
        # its sample; or how often it happens in a step, and then the sample is drawn
        ("at_step", "i8"),
        ("per_step", "f8"),
        # how many steps it lasts
        ("for_steps", "i8"),
        ("values", "f8", (4,)),
    ]
)

SENSING_DTYPE = record_dtype(
    [
        # standard deviations; of what a mission draws once (bias), or at each sample
        ("position_noise_m", "f8"),
        ("position_bias_m", "f8"),
        ("velocity_noise_mps", "f8"),
        ("velocity_bias_mps", "f8"),
        ("charge_bias", "f8"),
        ("delay_steps", "i8"),
    ]
)


def event_records(scenario: Scenario) -> NDArray[np.void]:
    """(E,) of EVENT_DTYPE, the events of a scenario in their order."""
    records = np.zeros(len(scenario.events), dtype=EVENT_DTYPE)
    index = {uas.name: i for i, uas in enumerate(scenario.uas)}
    for record, event in zip(records, scenario.events, strict=True):
        effect = event.effect()
        name = event.uas if isinstance(event, OfUas) else None
        record["effect"] = EFFECTS.index(effect.name)
        record["uas"] = EVERY if effect.on_all else BY_LOT if name is None else index[name]
        if event.at_s is not None:
            record["at_step"] = steps_until(event.at_s, scenario.dt_s)
        else:
            record["per_step"] = (event.rate_per_h or 0.0) * scenario.dt_s / 3600.0
        lasts = math.isfinite(effect.for_s)
        record["for_steps"] = steps_until(effect.for_s, scenario.dt_s) if lasts else NEVER
        record["values"][: len(effect.values)] = effect.values
    return records


def steps_until(seconds: float, dt_s: float) -> int:
    """Steps until a time has come, one at least; times are decimal, their quotients are not."""
    return max(1, math.ceil(round(seconds / dt_s, 9)))


def sensing_records(scenario: Scenario) -> NDArray[np.void]:
    """(S,) of SENSING_DTYPE: one for each UAS, or none where all are known as they are."""
    sensing = scenario.sensing
    records = np.zeros(len(scenario.uas) if is_eventful(scenario) else 0, dtype=SENSING_DTYPE)
    if sensing is not None:
        for name in SENSING_DTYPE.names or ():
            records[name] = getattr(sensing, name)
    return records


def is_eventful(scenario: Scenario) -> bool:
    """Whether anything is sensed otherwise than it is, or happens that could make it so."""
    return scenario.sensing is not None or bool(scenario.events)


def goes_home(scenario: Scenario) -> bool:
    """Whether an event may send a UAS home, which takes guidance."""
    effects = (event.effect() for event in scenario.events)
    return any(effect.name == "deafen" and effect.values[0] == RETURN for effect in effects)


@rare_kernel
def begin_events(arena, state, seed, mission):
    """Draw what a mission's events and sensors need, a function of seed and mission alone.

    Args:
        arena: The arena.
        state: The state at t = 0; what is drawn is written.
        seed: uint64.
        mission: Number of the mission since seeding, from 0 on.
    """
    for e in range(arena.events.shape[0]):
        event = arena.events[e]
        random = state.event_random[e]
        random[0] = counted(counted(seed, mission) ^ _EVENT_KEY, e)
        lot = uniform(random)
        steps = event.at_step
        if event.per_step > 0.0:
            waiting = -math.log(1.0 - uniform(random)) / event.per_step
            steps = 1 + int(min(waiting, 1e15))
        state.event_step[e] = steps
        uas = event.uas
        if uas == BY_LOT:
            uas = int(lot * arena.uas.shape[0])
        state.event_uas[e] = uas
    for i in range(arena.sensing.shape[0]):
        sensing = arena.sensing[i]
        random = state.sensing_random[i]
        random[0] = counted(counted(seed, mission) ^ _SENSING_KEY, i)
        for axis in range(3):
            state.bias[i, POSITION_BIAS + axis] = sensing.position_bias_m * normal(random)
            state.bias[i, VELOCITY_BIAS + axis] = sensing.velocity_bias_mps * normal(random)
        state.bias[i, CHARGE_BIAS] = sensing.charge_bias * normal(random)
        state.bias[i, DRIFT_DIRECTION] = 2.0 * math.pi * uniform(random)


@inlined_kernel
def concerns(state, e, i):
    """Whether event e happens to UAS i."""
    return state.event_uas[e] == i or state.event_uas[e] == EVERY


@inlined_kernel
def lasts(arena, state, e, step):
    """Whether event e, which has a beginning and an end, lasts in the step from a sample."""
    since = step - state.event_step[e]
    return 0 <= since < arena.events[e].for_steps


@rare_kernel
def heed(arena, state, outcome):
    """Give UAS that hear nothing what they fly by themselves; ground those that start late.

    Args:
        arena: The arena.
        state: The state; the commands that are heard are written.
        outcome: (U,) of OUTCOME_DTYPE with the commands given; applied_command, returning and
            grounded are written.
    """
    step = state.step[0]
    for i in range(state.status.shape[0]):
        command = outcome[i].applied_command
        then = -1
        for e in range(arena.events.shape[0]):
            if not concerns(state, e, i):
                continue
            effect = arena.events[e].effect
            if effect == GROUND and step < state.event_step[e]:
                outcome[i].grounded = True
            if effect == DEAFEN and lasts(arena, state, e, step):
                then = int(arena.events[e].values[0])
        heard = state.heard[i]
        if then == -1:
            heard[HEARD_KIND] = command.kind
            for k in range(4):
                heard[HEARD_VALUES + k] = command.values[k]
            heard[HEARD_RETURNING] = command.returning
        elif then == GO_ON and heard[HEARD_KIND] != WRENCH:
            command.kind = int(heard[HEARD_KIND])
            for k in range(4):
                command.values[k] = heard[HEARD_VALUES + k]
            command.returning = heard[HEARD_RETURNING] > 0.0
        else:
            # torques that are held on would turn it over: it hovers
            command.kind = GO_TO if then == RETURN else CLIMB
            for k in range(4):
                command.values[k] = 0.0
            if then == RETURN:
                command.values[0] = HOME
            command.returning = then == RETURN
        outcome[i].returning = command.returning


@rare_kernel
def rest(arena, state, i, outcome):
    """A UAS on the ground with its motors off: nothing moves, nothing is drawn."""
    x = state.x[i]
    outcome[i].voltage_V = open_circuit_V(arena.vehicles[i], x[DOD]) - x[U_TH]


@rare_kernel
def happen(arena, state, outcome):
    """What happens at the new sample, before it is judged.

    Args:
        arena: The arena.
        state: The state, flown but not judged; written.
        outcome: (U,) of OUTCOME_DTYPE; contact is written.
    """
    sample = state.step[0] + 1
    for e in range(arena.events.shape[0]):
        event = arena.events[e]
        if state.event_step[e] != sample:
            continue
        if event.effect == DROP:
            dropped = int(event.values[0])
            state.uncovered[dropped] = False
            if state.due_step.shape[0] > 0:
                state.due_step[dropped] = 0
        for i in range(state.status.shape[0]):
            if not concerns(state, e, i) or not outcome[i].flew:
                continue
            if event.effect == LOSE and outcome[i].contact == NONE:
                outcome[i].contact = FAULT
            elif event.effect == DISCHARGE:
                state.x[i, DOD] = min(state.x[i, DOD] + event.values[0], 1.0)


@rare_kernel
def sense(arena, state):
    """Write what is sensed at the new sample, where that is not what is true.

    A UAS without satellite navigation adds up its velocity instead, with a drift.

    Args:
        arena: The arena.
        state: The state; felt, sensed, delayed and told are written.
    """
    step = state.step[0]
    for i in range(arena.sensing.shape[0]):
        sensing = arena.sensing[i]
        random = state.sensing_random[i]
        felt = state.felt[i]
        sensed = state.sensed[i]
        north_m, north_mps = felt[X], felt[VX]
        east_m, east_mps = felt[Y], felt[VY]
        for k in range(N_STATES):
            felt[k] = state.x[i, k]
        drift_mps = -1.0
        for e in range(arena.events.shape[0]):
            blinds = arena.events[e].effect == BLIND and concerns(state, e, i)
            if blinds and lasts(arena, state, e, step):
                drift_mps = max(drift_mps, arena.events[e].values[0])
        for axis in range(3):
            felt[X + axis] += state.bias[i, POSITION_BIAS + axis]
            felt[VX + axis] += state.bias[i, VELOCITY_BIAS + axis]
        felt[DOD] = min(max(felt[DOD] + state.bias[i, CHARGE_BIAS], 0.0), 1.0)
        if drift_mps >= 0.0:
            dt_s = arena.rules[0].dt_s
            felt[VX] += drift_mps * math.cos(state.bias[i, DRIFT_DIRECTION])
            felt[VY] += drift_mps * math.sin(state.bias[i, DRIFT_DIRECTION])
            felt[X] = north_m + 0.5 * dt_s * (north_mps + felt[VX])
            felt[Y] = east_m + 0.5 * dt_s * (east_mps + felt[VY])
        for k in range(N_STATES):
            sensed[k] = felt[k]
        for axis in range(3):
            sensed[X + axis] += sensing.position_noise_m * normal(random)
            sensed[VX + axis] += sensing.velocity_noise_mps * normal(random)
        kept = state.delayed[i]
        late = max(step - sensing.delay_steps, 0) % N_DELAYED
        for k in range(N_STATES):
            kept[step % N_DELAYED, k] = sensed[k]
            state.told[i, k] = kept[late, k]


@rare_kernel
def deaf_until(arena, state, i, step):
    """The sample from which UAS i hears commands again; the present one where it hears them."""
    until = step
    for e in range(arena.events.shape[0]):
        if arena.events[e].effect != DEAFEN or not concerns(state, e, i):
            continue
        if lasts(arena, state, e, step):
            if arena.events[e].for_steps >= NEVER:
                return NEVER
            until = max(until, state.event_step[e] + arena.events[e].for_steps)
    return until


@kernel
def write_responds(arena, state, responds):
    """Note which UAS take commands in the coming step: (U,) bool, written."""
    step = state.step[0]
    for i in range(responds.shape[0]):
        responds[i] = True
        for e in range(arena.events.shape[0]):
            if concerns(state, e, i):
                effect = arena.events[e].effect
                if effect == GROUND and step < state.event_step[e]:
                    responds[i] = False
                if effect == DEAFEN and lasts(arena, state, e, step):
                    responds[i] = False
