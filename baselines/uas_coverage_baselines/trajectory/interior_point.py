"""Interior point for one UAS's flight: linear dynamics in stages, convex rows, compiled.

    minimise    1/2 sum of u'Wu + sum over soft rows of weight * violation
    subject to  x(n+1) = A x(n) + B u(n),  x(0) given;
                |velocity|, |tilt|, |rate| and climb within their limits at every stage, u in a box;
                soft rows at single stages: balls |x[s] - v| <= b and planes v . x[s] <= b

A primal-dual method with Mehrotra's predictor and corrector (Mehrotra, "On the implementation of a
primal-dual interior point method", SIAM J. Optim. 2 (1992); for convex quadratic rows: Nocedal and
Wright, "Numerical Optimization", ch. 19). Norms and balls are written as (|y|² - b²) / 2b <= 0.
Violations of soft rows are columns of their own, so that every program has a solution.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from uas_coverage_baselines.trajectory.flight_model import N_U, N_X, NORMS, V_DOWN, FlightModel
from uas_coverage_baselines.trajectory.riccati import Factors, factor, newton_step
from uas_coverage_baselines.trajectory.rows import (
    CLIMB,
    N_HARD,
    SoftRows,
    Values,
    evaluate_rows,
    violations,
)
from uas_coverage_env.compiled.kernels import allocating_kernel

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

_BOUNDS = 2 * N_U
_REGULAR = 1e-8
_STEP = 0.995  # of the way to the boundary
_RESIDUAL = 1e-5


class Solution(NamedTuple):
    """What `solve` found.

    Attributes:
        x: (N+1, 10) states.
        u: (N, 3) inputs.
        costate: (N, 10) what a change of the states 1..N costs.
        violation: (m,) of the soft rows.
        iterations: How many were needed.
        converged: Whether residuals and complementarity are small.
    """

    x: FloatArray
    u: FloatArray
    costate: FloatArray
    violation: FloatArray
    iterations: int
    converged: bool


class _Iterate(NamedTuple):
    """Slacks and multipliers, or their changes, or what is corrected of their products."""

    hard: FloatArray
    hard_price: FloatArray
    bound: FloatArray
    bound_price: FloatArray
    soft: FloatArray
    soft_price: FloatArray
    excess: FloatArray
    """(m,) violation of the soft rows."""
    excess_price: FloatArray


@allocating_kernel
def _iterate(n_stages, n_soft):
    return _Iterate(
        np.zeros((n_stages + 1, N_HARD)), np.zeros((n_stages + 1, N_HARD)),
        np.zeros((n_stages, _BOUNDS)), np.zeros((n_stages, _BOUNDS)),
        np.zeros(n_soft), np.zeros(n_soft), np.zeros(n_soft), np.zeros(n_soft),
    )  # fmt: skip


@allocating_kernel
def _begin(model, rows, values, at):
    """First slacks and multipliers, all positive."""
    for n in range(1, len(at.hard)):
        for k in range(N_HARD):
            scale = model.norms[k] if k < CLIMB else model.vertical[k - CLIMB]
            at.hard[n, k] = max(-values.hard[n, k], 0.1 * scale)
            at.hard_price[n, k] = 0.05 / at.hard[n, k]
    for n in range(len(at.bound)):
        for k in range(_BOUNDS):
            scale = model.input_high[k // 2] - model.input_low[k // 2]
            at.bound[n, k] = max(-values.bound[n, k], 0.05 * scale)
            at.bound_price[n, k] = 0.05 / at.bound[n, k]
    for k in range(len(at.soft)):
        at.excess[k] = max(values.soft[k], 0.0) + 1.0
        at.soft[k] = max(at.excess[k] - values.soft[k], 0.5)
        at.soft_price[k] = 0.5 * rows.weight[k]
        at.excess_price[k] = 0.5 * rows.weight[k]


@allocating_kernel
def _add_slacks(at, values):
    """Turn values into residuals; the largest, and the sum of the complementarity products."""
    worst, products = 0.0, 0.0
    for n in range(1, len(at.hard)):
        for k in range(N_HARD):
            values.hard[n, k] += at.hard[n, k]
            worst = max(worst, abs(values.hard[n, k]))
            products += at.hard[n, k] * at.hard_price[n, k]
    for n in range(len(at.bound)):
        for k in range(_BOUNDS):
            values.bound[n, k] += at.bound[n, k]
            worst = max(worst, abs(values.bound[n, k]))
            products += at.bound[n, k] * at.bound_price[n, k]
        for i in range(N_X):
            worst = max(worst, abs(values.dynamics[n, i]))
    for k in range(len(at.soft)):
        values.soft[k] += at.soft[k] - at.excess[k]
        worst = max(worst, abs(values.soft[k]))
        products += at.soft[k] * at.soft_price[k] + at.excess[k] * at.excess_price[k]
    return worst, products


@allocating_kernel
def _hessian(model, loose, rows, x, at, values, Q, R):
    for n in range(1, len(x)):
        Q[n] = 0.0
        for i in range(N_X):
            Q[n, i, i] = _REGULAR
        for k in range(CLIMB):
            i, j, limit = NORMS[k, 0], NORMS[k, 1], loose[n] * model.norms[k]
            price = at.hard_price[n, k]
            stiff = price / at.hard[n, k] / (limit * limit)
            Q[n, i, i] += stiff * x[n, i] * x[n, i] + price / limit
            Q[n, j, j] += stiff * x[n, j] * x[n, j] + price / limit
            Q[n, i, j] += stiff * x[n, i] * x[n, j]
            Q[n, j, i] = Q[n, i, j]
        for k in range(CLIMB, N_HARD):
            Q[n, V_DOWN, V_DOWN] += at.hard_price[n, k] / at.hard[n, k]
    for n in range(len(R)):
        for a in range(N_U):
            R[n, a] = model.input_weight[a]
            for k in range(2 * a, 2 * a + 2):
                R[n, a] += at.bound_price[n, k] / at.bound[n, k]
    for k in range(len(rows.stage)):
        n = rows.stage[k]
        one, two = at.soft_price[k] / at.soft[k], at.excess_price[k] / at.excess[k]
        stiff = one * two / (one + two)
        for e in range(3):
            i = rows.states[k, e]
            for f in range(3):
                Q[n, i, rows.states[k, f]] += stiff * values.slope[k, e] * values.slope[k, f]
            if rows.ball[k]:
                Q[n, i, i] += at.soft_price[k] / rows.bound[k]


@allocating_kernel
def _gradient(model, loose, rows, x, u, at, values, aside, target, q, r):
    """Right-hand sides; `aside` holds what the corrector adds to the products."""
    q[:] = 0.0
    for n in range(1, len(x)):
        for k in range(N_HARD):
            price, slack = at.hard_price[n, k], at.hard[n, k]
            product = price * slack - target + aside.hard[n, k]
            value = price + (price * values.hard[n, k] - product) / slack
            if k < CLIMB:
                for side in range(2):
                    i = NORMS[k, side]
                    q[n, i] += value * x[n, i] / (loose[n] * model.norms[k])
            else:
                q[n, V_DOWN] += -value if k == CLIMB else value
    for n in range(len(u)):
        for a in range(N_U):
            value = model.input_weight[a] * u[n, a]
            for side in range(2):
                k = 2 * a + side
                price, slack = at.bound_price[n, k], at.bound[n, k]
                product = price * slack - target + aside.bound[n, k]
                part = price + (price * values.bound[n, k] - product) / slack
                value += part if side == 0 else -part
            r[n, a] = value
    for k in range(len(rows.stage)):
        one, two = at.soft_price[k] / at.soft[k], at.excess_price[k] / at.excess[k]
        spare = rows.weight[k] - at.soft_price[k] - at.excess_price[k]
        first = at.soft_price[k] * at.soft[k] - target + aside.soft[k]
        second = at.excess_price[k] * at.excess[k] - target + aside.excess[k]
        first, second = first / at.soft[k], second / at.excess[k]
        value = at.soft_price[k] - first
        value += one * (two * values.soft[k] + spare + first + second) / (one + two)
        for e in range(3):
            q[rows.stage[k], rows.states[k, e]] += value * values.slope[k, e]


@allocating_kernel
def _longest(value, change, longest):
    """How much of a change keeps a positive value positive."""
    return min(longest, -value / change) if change < 0.0 else longest


@allocating_kernel
def _changes(model, loose, rows, x, dx, du, at, values, aside, target, change):
    """Write the changes of slacks and multipliers; the longest primal and dual steps."""
    primal, dual = 1.0, 1.0
    for n in range(1, len(dx)):
        for k in range(N_HARD):
            if k < CLIMB:
                i, j = NORMS[k, 0], NORMS[k, 1]
                along = (x[n, i] * dx[n, i] + x[n, j] * dx[n, j]) / (loose[n] * model.norms[k])
            else:
                along = -dx[n, V_DOWN] if k == CLIMB else dx[n, V_DOWN]
            price, slack = at.hard_price[n, k], at.hard[n, k]
            product = price * slack - target + aside.hard[n, k]
            change.hard[n, k] = -values.hard[n, k] - along
            change.hard_price[n, k] = (-product - price * change.hard[n, k]) / slack
            primal = _longest(slack, change.hard[n, k], primal)
            dual = _longest(price, change.hard_price[n, k], dual)
    for n in range(len(du)):
        for k in range(_BOUNDS):
            along = du[n, k // 2] if k % 2 == 0 else -du[n, k // 2]
            price, slack = at.bound_price[n, k], at.bound[n, k]
            product = price * slack - target + aside.bound[n, k]
            change.bound[n, k] = -values.bound[n, k] - along
            change.bound_price[n, k] = (-product - price * change.bound[n, k]) / slack
            primal = _longest(slack, change.bound[n, k], primal)
            dual = _longest(price, change.bound_price[n, k], dual)
    for k in range(len(rows.stage)):
        one, two = at.soft_price[k] / at.soft[k], at.excess_price[k] / at.excess[k]
        spare = rows.weight[k] - at.soft_price[k] - at.excess_price[k]
        first = at.soft_price[k] * at.soft[k] - target + aside.soft[k]
        second = at.excess_price[k] * at.excess[k] - target + aside.excess[k]
        along = 0.0
        for e in range(3):
            along += values.slope[k, e] * dx[rows.stage[k], rows.states[k, e]]
        wanted = one * (values.soft[k] + along) - spare
        wanted -= first / at.soft[k] + second / at.excess[k]
        change.excess[k] = wanted / (one + two)
        change.excess_price[k] = (-second - at.excess_price[k] * change.excess[k]) / at.excess[k]
        change.soft_price[k] = spare - change.excess_price[k]
        change.soft[k] = -values.soft[k] - along + change.excess[k]
        primal = _longest(at.soft[k], change.soft[k], primal)
        primal = _longest(at.excess[k], change.excess[k], primal)
        dual = _longest(at.soft_price[k], change.soft_price[k], dual)
        dual = _longest(at.excess_price[k], change.excess_price[k], dual)
    return primal, dual


@allocating_kernel
def _predicted(at, change, primal, dual, aside):
    """Sum of the products after the predictor's step; notes what the corrector takes back."""
    total = 0.0
    for value, price, dv, dp, note in (
        (at.hard, at.hard_price, change.hard, change.hard_price, aside.hard),
        (at.bound, at.bound_price, change.bound, change.bound_price, aside.bound),
    ):
        for n in range(len(value)):
            for k in range(value.shape[1]):
                total += (value[n, k] + primal * dv[n, k]) * (price[n, k] + dual * dp[n, k])
                note[n, k] = dv[n, k] * dp[n, k]
    for value, price, dv, dp, note in (
        (at.soft, at.soft_price, change.soft, change.soft_price, aside.soft),
        (at.excess, at.excess_price, change.excess, change.excess_price, aside.excess),
    ):
        for k in range(len(value)):
            total += (value[k] + primal * dv[k]) * (price[k] + dual * dp[k])
            note[k] = dv[k] * dp[k]
    return total


@allocating_kernel
def _move(at, change, primal, dual):
    for value, dv, step in (
        (at.hard, change.hard, primal),
        (at.hard_price, change.hard_price, dual),
        (at.bound, change.bound, primal),
        (at.bound_price, change.bound_price, dual),
    ):
        value += step * dv
    for value, dv, step in (
        (at.soft, change.soft, primal),
        (at.soft_price, change.soft_price, dual),
        (at.excess, change.excess, primal),
        (at.excess_price, change.excess_price, dual),
    ):
        value += step * dv


@allocating_kernel(nogil=True)
def _solve(model, loose, rows, x, u, iterations, complementarity):
    n_stages, n_soft = len(u), len(rows.stage)
    at, change, aside = (
        _iterate(n_stages, n_soft), _iterate(n_stages, n_soft), _iterate(n_stages, n_soft)
    )  # fmt: skip
    values = Values(
        np.zeros((n_stages + 1, N_HARD)), np.zeros((n_stages, _BOUNDS)), np.zeros(n_soft),
        np.zeros((n_soft, 3)), np.zeros((n_stages, N_X)),
    )  # fmt: skip
    factors = Factors(
        np.zeros((n_stages + 1, N_X, N_X)), np.zeros((n_stages, N_U, N_X)),
        np.zeros((n_stages, N_U, N_U)),
    )  # fmt: skip
    Q, R = np.zeros((n_stages + 1, N_X, N_X)), np.zeros((n_stages, N_U))
    q, r = np.zeros((n_stages + 1, N_X)), np.zeros((n_stages, N_U))
    dx, du = np.zeros((n_stages + 1, N_X)), np.zeros((n_stages, N_U))
    costate, new_costate = np.zeros((n_stages, N_X)), np.zeros((n_stages, N_X))
    n_products = n_stages * (N_HARD + _BOUNDS) + 2 * n_soft
    converged, done = False, 0
    for done in range(iterations):
        evaluate_rows(model, loose, rows, x, u, values)
        if done == 0:
            _begin(model, rows, values, at)
        worst, products = _add_slacks(at, values)
        mean = products / n_products
        if mean < complementarity and worst < _RESIDUAL:
            converged = True
            break
        if not math.isfinite(products):
            break
        _hessian(model, loose, rows, x, at, values, Q, R)
        factor(model.A, model.B, Q, R, factors)
        target = 0.0
        for a in (aside.hard, aside.bound):
            a[:] = 0.0
        for a in (aside.soft, aside.excess):
            a[:] = 0.0
        primal, dual = 1.0, 1.0
        for phase in range(2):
            _gradient(model, loose, rows, x, u, at, values, aside, target, q, r)
            newton_step(model.A, model.B, factors, q, r, values.dynamics, dx, du, new_costate)
            primal, dual = _changes(
                model, loose, rows, x, dx, du, at, values, aside, target, change
            )
            if phase == 0:
                after = _predicted(at, change, primal, dual, aside) / n_products
                centring = min(max((after / mean) ** 3, 1e-4), 1.0)
                target = max(centring * mean, 0.2 * complementarity)
        primal, dual = min(1.0, _STEP * primal), min(1.0, _STEP * dual)
        x += primal * dx
        u += primal * du
        costate += dual * (new_costate - costate)
        _move(at, change, primal, dual)
    return costate, violations(rows, x), done, converged


def solve(
    model: FlightModel,
    rows: SoftRows,
    x: FloatArray,
    u: FloatArray,
    *,
    loose: FloatArray | None = None,
    iterations: int = 240,
    complementarity: float = 3e-6,
) -> Solution:
    """Solve one program.

    Args:
        model: Of the UAS.
        rows: Visits, landing, and what to keep clear of.
        x: (N+1, 10) guess; its first row is the state at the start, and stays.
        u: (N, 3) guess.
        loose: (N+1,) factors on the limits of the states at each stage; 1 where none is given.
        iterations: At most so many; most programs take some 16, long legs beside a fence 100.
        complementarity: Mean product of slacks and multipliers at which it is done.

    Returns:
        The solution, as far as it got: see `Solution.converged`.
    """
    if loose is None:
        loose = np.ones(len(x))
    x, u = x.copy(), u.copy()
    costate, violation, done, converged = _solve(
        model, loose, rows, x, u, iterations, complementarity
    )
    return Solution(x, u, costate, violation, int(done), bool(converged))
