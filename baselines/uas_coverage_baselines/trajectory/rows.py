"""The rows of the program of one flight: their values, and by how much they are violated."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from uas_coverage_baselines.trajectory.flight_model import N_U, N_X, NORMS, V_DOWN
from uas_coverage_env.compiled.kernels import allocating_kernel

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

CLIMB, DESCENT = len(NORMS), len(NORMS) + 1
"""Hard rows of a stage after the `NORMS`."""

N_HARD = DESCENT + 1


class SoftRows(NamedTuple):
    """Rows that may be violated at a price."""

    stage: IntArray
    """(m,) in 1..N."""
    ball: NDArray[np.bool_]
    """(m,) a ball, else a plane."""
    states: IntArray
    """(m, 3) of which states."""
    vector: FloatArray
    """(m, 3) centre or normal."""
    bound: FloatArray
    """(m,) radius or offset; radii are positive."""
    weight: FloatArray
    """(m,) cost of a unit of violation."""


class Values(NamedTuple):
    """Values of all rows, with the slacks: residuals."""

    hard: FloatArray
    bound: FloatArray
    soft: FloatArray
    slope: FloatArray
    """(m, 3) gradients of the soft rows."""
    dynamics: FloatArray


@allocating_kernel
def evaluate_rows(model, loose, rows, x, u, values):
    """Write the rows at a point, without slacks."""
    for n in range(1, len(x)):
        for k in range(CLIMB):
            a, b, limit = x[n, NORMS[k, 0]], x[n, NORMS[k, 1]], loose[n] * model.norms[k]
            values.hard[n, k] = 0.5 * (a * a + b * b - limit * limit) / limit
        values.hard[n, CLIMB] = -x[n, V_DOWN] - loose[n] * model.vertical[0]
        values.hard[n, DESCENT] = x[n, V_DOWN] - loose[n] * model.vertical[1]
    for n in range(len(u)):
        for a in range(N_U):
            values.bound[n, 2 * a] = u[n, a] - model.input_high[a]
            values.bound[n, 2 * a + 1] = model.input_low[a] - u[n, a]
        for i in range(N_X):
            value = -x[n + 1, i]
            for j in range(N_X):
                value += model.A[i, j] * x[n, j]
            for j in range(N_U):
                value += model.B[i, j] * u[n, j]
            values.dynamics[n, i] = value + model.drift[i]
    for k in range(len(rows.stage)):
        n, bound = rows.stage[k], rows.bound[k]
        value = 0.0
        for e in range(3):
            at, vector = x[n, rows.states[k, e]], rows.vector[k, e]
            if rows.ball[k]:
                values.slope[k, e] = (at - vector) / bound
                value += 0.5 * (at - vector) * (at - vector) / bound
            else:
                values.slope[k, e] = vector
                value += vector * at
        values.soft[k] = value - (0.5 * bound if rows.ball[k] else bound)


@allocating_kernel
def violations(rows, x):
    """(m,) by how much soft rows are violated, balls by their distance."""
    result = np.zeros(len(rows.stage))
    for k in range(len(rows.stage)):
        value = 0.0
        for e in range(3):
            at, vector = x[rows.stage[k], rows.states[k, e]], rows.vector[k, e]
            value += (at - vector) * (at - vector) if rows.ball[k] else at * vector
        if rows.ball[k]:
            value = math.sqrt(value)
        result[k] = max(value - rows.bound[k], 0.0)
    return result
