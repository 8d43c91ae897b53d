"""How UAS fly a step: in still air by the linear model, or otherwise.

Otherwise is what few missions do: wind, forces and faults, another vehicle than is believed, the
6-DOF plant. It is called at an address, so that a mission in still air neither compiles nor passes
over it.
"""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from uas_coverage_env.autopilot.belief import believed_wrench, expect, learn
from uas_coverage_env.autopilot.control import command_wrench
from uas_coverage_env.compiled.kernels import inlined_kernel, kernel, rare_kernel, rarely
from uas_coverage_env.entities.commands import WRENCH
from uas_coverage_env.entities.state import FLYING, as_estimated
from uas_coverage_env.features.feature import MissionFeature, Point
from uas_coverage_env.simulation.points import (
    ACT,
    AT_BEGIN,
    FIRST,
    FLIGHT,
    FLY,
    IN_STEP,
    FeatureCode,
    call_features,
    fly_at,
)
from uas_coverage_env.vehicle import lpv_step, plant_step
from uas_coverage_env.vehicle.air import enter_air, leave_air, push
from uas_coverage_env.vehicle.discharge import discharge_further, open_circuit_V
from uas_coverage_env.vehicle.inner_loop import face_course, reseed_reference
from uas_coverage_env.vehicle.layout import DOD, LIFT, TAU_Z, U_TH
from uas_coverage_env.vehicle.lpv import clip_wrench


@inlined_kernel
def _write_inputs(arena, state, i, outcome):
    """What the inner loop, or a wrench, asks of the motors of a UAS."""
    event = outcome[i]
    vehicle = arena.vehicles[i]
    command_wrench(
        vehicle, state.x[i], state.uas[i].reference_mps[:], event.applied_command, event.u[:]
    )
    if rarely(vehicle.follows_course):
        face_course(vehicle, state.x[i], event.u[:])


@inlined_kernel
def _write_believed_inputs(arena, state, estimated, nonlinear, i, outcome):
    """Likewise as the disturbances believed in demand it, and what is expected to come of it.

    The disturbances are found out from the true motion, whatever error the sensors have.
    """
    vehicle, belief, u = arena.vehicles[i], state.uas[i].belief[:], outcome[i].u[:]
    command = outcome[i].applied_command
    if state.step[0] == 0 and command.kind != WRENCH:
        # a first look at the wind: to set off before would take more tilt than there is
        command = arena.rules[0].brake
    believed_wrench(vehicle, belief, estimated.x[i], estimated.uas[i].reference_mps[:], command, u)
    if vehicle.follows_course:
        face_course(vehicle, estimated.x[i], u)
    expect(vehicle, belief, nonlinear, state.x[i], u)


@inlined_kernel
def _write_all_inputs(arena, state, nonlinear, outcome):
    """What the motors of all UAS are asked for: a disturbance of one may depend on the others'."""
    estimated = as_estimated(state)
    for i in range(state.uas.shape[0]):
        clear(outcome[i])
        if state.uas[i].status == FLYING:
            _write_believed_inputs(arena, state, estimated, nonlinear, i, outcome)


@inlined_kernel
def _flown_vehicle(arena, state, i):
    """The vehicle that flies: the true one, where that may be another than is believed."""
    if state.true_vehicles.shape[0] > 0:
        return state.true_vehicles[i]
    return arena.vehicles[i]


@inlined_kernel
def _be_pushed(vehicle, flown, belief, event, step, dod_before, x):
    """What wind, forces and faults add to a step that was flown in the air, and what is learnt."""
    leave_air(vehicle, x, event.wind_mps)
    push(flown, x, event.force_N)
    x[DOD] += event.dod_lost
    learn(vehicle, belief, step, dod_before, x)


@inlined_kernel
def clear(event):
    """Begin with still air and no force."""
    for axis in range(3):
        event.wind_mps[axis] = 0.0
        event.force_N[axis] = 0.0
    event.dod_lost = 0.0


@inlined_kernel
def _check_all(arena, state, outcome):
    """Refuse what is not finite, and keep the inputs within the limits."""
    for i in range(state.uas.shape[0]):
        if state.uas[i].status == FLYING:
            _check_and_clip(arena, i, outcome[i])


@inlined_kernel
def _check_and_clip(arena, i, event):
    total = event.dod_lost
    for axis in range(3):
        total += abs(event.wind_mps[axis]) + abs(event.force_N[axis])
    for k in range(LIFT, TAU_Z + 1):
        total += abs(event.u[k])
    if not math.isfinite(total):
        raise ValueError("what disturbances do to a UAS is not finite; correct their kernels")
    clip_wrench(arena.vehicles[i], event.u)
    if arena.vehicles[i].holds_height:
        event.wind_mps[2] = event.force_N[2] = 0.0


@rare_kernel
def _rest(arena, state, i, outcome):
    """A UAS on the ground with its motors off: nothing moves, nothing is drawn."""
    x = state.x[i]
    outcome[i].voltage_V = open_circuit_V(arena.vehicles[i], x[DOD]) - x[U_TH]


@inlined_kernel
def _note(arena, state, i, event, voltage_V, current_A):
    event.voltage_V = voltage_V
    event.current_A = current_A
    event.energy_Wh = voltage_V * current_A * (arena.rules[0].dt_s / 3600.0)
    if rarely(event.applied_command.kind == WRENCH):
        reseed_reference(arena.vehicles[i], state.x[i], state.uas[i].reference_mps[:])


@inlined_kernel
def fly(arena, state, nonlinear, code, outcome):
    """Fly the commands for one step.

    Args:
        arena: The arena.
        state: The state; written.
        nonlinear: Whether the 6-DOF plant is flown.
        code: `FeatureCode`; None: no mission has any feature, and all fly the linear model.
        outcome: (U,) of OUTCOME_DTYPE; written.
    """
    if code is None:
        fly_still(arena, state, outcome)
    elif rarely(nonlinear or arena.rules[0].disturbed or state.true_vehicles.shape[0] > 0):
        fly_at(code[FLY], arena, state, nonlinear, code, outcome)
    else:
        fly_still(arena, state, outcome)


@inlined_kernel
def fly_still_of(arena, state, i, outcome):
    """`fly_still` for one UAS."""
    if state.uas[i].status != FLYING:
        return
    event = outcome[i]
    if rarely(event.grounded):
        _rest(arena, state, i, outcome)
        return
    _write_inputs(arena, as_estimated(state), i, outcome)
    x = state.x[i]
    voltage_V, current_A = lpv_step(arena.vehicles[i], x, event.u[:], x)
    _note(arena, state, i, event, voltage_V, current_A)


@inlined_kernel
def fly_still(arena, state, outcome):
    """`fly` in still air by the linear model; arguments as there."""
    for i in range(state.uas.shape[0]):
        fly_still_of(arena, state, i, outcome)


@inlined_kernel
def _move_all(arena, state, nonlinear, outcome):
    """Fly the inputs, and where there are any the winds and the forces, in `outcome`."""
    disturbed = arena.rules[0].disturbed
    estimated = as_estimated(state)
    for i in range(state.uas.shape[0]):
        if state.uas[i].status != FLYING:
            continue
        event = outcome[i]
        if event.grounded:
            _rest(arena, state, i, outcome)
            continue
        if not disturbed:
            _write_inputs(arena, estimated, i, outcome)
        x = state.x[i]
        u = event.u[:]
        vehicle, flown = arena.vehicles[i], _flown_vehicle(arena, state, i)
        dod_before = x[DOD]
        if vehicle.holds_height:
            # the lift that carries the true weight
            u[LIFT] = 0.0 - flown.lift_surplus_N / flown.thrust_factor
        if disturbed:
            enter_air(x, event.wind_mps)
        if nonlinear:
            voltage_V, current_A = plant_step(flown, x, u, x)
        else:
            voltage_V, current_A = lpv_step(flown, x, u, x)
        if flown.n_further > 0:
            discharge_further(flown, flown.further_V, current_A, flown.dt_s)
        if disturbed:
            belief = state.uas[i].belief[:]
            _be_pushed(vehicle, flown, belief, event, state.step[0], dod_before, x)
        _note(arena, state, i, event, voltage_V, current_A)


def fly_otherwise_with(call_features: Any) -> Any:
    """`fly` where it is not in still air by the linear model; arguments as there.

    Args:
        call_features: See `points.call_features`.
    """

    @kernel
    def fly_otherwise(arena, state, nonlinear, code, outcome):
        if arena.rules[0].disturbed:
            _write_all_inputs(arena, state, nonlinear, outcome)
            call_features(ACT, arena, state, code, outcome)
            _check_all(arena, state, outcome)
        _move_all(arena, state, nonlinear, outcome)

    return fly_otherwise


_fly_otherwise = fly_otherwise_with(call_features)


def feature_code(features: Sequence[MissionFeature], *, otherwise: bool = False) -> FeatureCode:
    """Compile the kernels of features, or load them from the cache.

    Args:
        features: In the order of `Arena.features`.
        otherwise: Whether the 6-DOF plant or true vehicles are flown, whatever features do.

    Raises:
        ValueError: One cannot be compiled.
    """
    code = [FIRST]
    calls: list[int] = []
    for point in Point:
        signature = AT_BEGIN if point == Point.BEGIN else IN_STEP
        for f, feature in enumerate(features):
            if point in feature.kernels:
                calls += [f, signature.address_of(feature.kernels[point])]
        code.append(FIRST + len(calls))
    otherwise = otherwise or any(feature.disturbs for feature in features)
    fly = FLIGHT.address_of(_fly_otherwise) if otherwise else 0
    return np.array([*code, fly, *calls], dtype=np.int64)
