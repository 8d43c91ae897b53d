"""Disturbances as a user writes them: outside of the package, in one file."""

import math

from uas_coverage_env.compiled.kernels import kernel
from uas_coverage_env.features import Disturbance, normal, uniform
from uas_coverage_env.features.true_vehicles import perturb
from uas_coverage_env.vehicle.layout import LIFT
from uas_coverage_env.vehicle.true_vehicle import PERTURBATIONS


@kernel
def _gust(arena, state, outcome, i, parameters, memory, random):
    keep = math.exp(-arena.rules[0].dt_s / parameters[1])
    for axis in range(3):
        new = parameters[0] * math.sqrt(1.0 - keep * keep) * normal(random)
        memory[axis] = keep * memory[axis] + new
        outcome[i].wind_mps[axis] += memory[axis]


def gusts(sigma_mps=1.5, correlation_s=5.0, common=False):
    """Coloured noise of the first order; its state starts at zero."""
    return Disturbance("gusts", _gust, (sigma_mps, correlation_s), common)


@kernel
def _push(arena, state, outcome, i, parameters, memory, random):
    for axis in range(3):
        outcome[i].force_N[axis] += parameters[axis]


def push(*force_N):
    return Disturbance("push", _push, force_N)


@kernel
def _weak(arena, state, outcome, i, parameters, memory, random):
    if state.step[0] == 0:
        memory[0] = parameters[0] * uniform(random)
    outcome[i].u[LIFT] -= memory[0] * arena.vehicles[i].weight_N


def weak_rotors(most):
    """Thrust that is lost, a share of the weight drawn per UAS and mission."""
    return Disturbance("weak_rotors", _weak, (most,))


@kernel
def _not_finite(arena, state, outcome, i, parameters, memory, random):
    if state.step[0] == 3:
        outcome[i].force_N[0] += math.nan


NOT_FINITE = Disturbance("not_finite", _not_finite)


@kernel
def _perturb(arena, state, outcome, i, parameters, memory, random):
    if state.step[0] == 0:
        perturb(arena, state, i, parameters)


def perturbed(**perturbations):
    """A vehicle that is another than is believed; by name, 0 where not named."""
    assert set(perturbations) <= set(PERTURBATIONS)
    parameters = tuple(float(perturbations.get(name, 0.0)) for name in PERTURBATIONS)
    return Disturbance("perturbed", _perturb, parameters, perturbs=True)


@kernel
def _secretly_perturb(arena, state, outcome, i, parameters, memory, random):
    memory[0] = 0.1
    perturb(arena, state, i, memory)


SECRETLY_PERTURBING = Disturbance("secretly_perturbing", _secretly_perturb)


@kernel
def _drain(arena, state, outcome, i, parameters, memory, random):
    if state.step[0] == 0:
        outcome[i].dod_lost += parameters[0]


def drained(dod):
    """A battery that loses a share of its capacity in the first step."""
    return Disturbance("drained", _drain, (dod,))
