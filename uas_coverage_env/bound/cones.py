"""A barrier method for small programs with norms: the least of linear costs and of norms.

    min  cost z + sum_j weight_j |P_j z|   with   |P_i z| <= largest_i,  |M_e z + beyond_e| <= half

z are pairs, one for each axis, and P acts on both axes alike. The value returned is that of a
feasible solution of the dual program: the first limits are those of the variables themselves, and
take up whatever the others leave unbalanced.
"""

import math

import numpy as np

from uas_coverage_env.compiled.kernels import allocating_kernel

_LAST = 0.02  # weight of the barrier, in costs
_SHARPER = 0.3
_DONE = 0.6  # share of a Newton step after which the barrier is lowered
_NEAR = 0.7  # share of the way to the nearest limit that is tried
_TRIED = 6
_GAP = 1.0  # that is left, in costs
_ITERATIONS = 120


@allocating_kernel
def least_costs(rows, weights, largest, cost, middles, beyond, half, enough, barrier, z, value):
    """Bounds of N programs.

    Args:
        rows: (K + J, P) of one axis; the first P are the variables themselves.
        weights: (J,) of the last rows.
        largest: (N, K) of the first rows.
        cost: (N, 2 P) of the variables, pair by pair.
        middles: (N, E, 2 P) M.
        beyond: (N, E)
        half: Largest of the middles.
        enough: (N,) a value above which the search ends.
        barrier: (N,) to begin with.
        z: (N, 2 P) to begin with, within all limits; then the solutions.
        value: (N,) receives the bounds.
    """
    for n in range(len(z)):
        value[n] = _least(
            rows,
            weights,
            largest[n],
            cost[n],
            middles[n],
            beyond[n],
            half,
            enough[n],
            barrier[n],
            z[n],
        )


@allocating_kernel
def _least(rows, weights, largest, cost, middles, beyond, half, enough, barrier, z):
    n_rows, pairs = rows.shape
    n_limits, n_middles, size = len(largest), len(beyond), 2 * pairs
    at, change = np.zeros((n_rows, 2)), np.zeros((n_rows, 2))
    force = np.zeros((n_rows, 2))
    middle, middle_change = np.zeros(n_middles), np.zeros(n_middles)
    gradient, step = np.zeros(size), np.zeros(size)
    hessian = np.zeros((size, size))
    best = -np.inf
    for _ in range(_ITERATIONS):
        _apply(rows, middles, z, at, middle)
        gradient[:] = cost
        hessian[:] = 0.0
        objective = 0.0
        for x in range(size):
            objective += cost[x] * z[x]
        for r in range(n_rows):
            one, two = at[r]
            square = one * one + two * two
            if r < n_limits:
                alike = 2.0 * barrier / (largest[r] ** 2 - square)
                twice = alike * alike / barrier
            else:
                weight = weights[r - n_limits]
                small = barrier / weight
                norm = math.sqrt(small * small + square)
                alike = weight / (small + norm)
                twice = -alike / ((small + norm) * norm)
                objective += weight * math.sqrt(square)
            force[r, 0], force[r, 1] = alike * one, alike * two
            a, b, c = alike + twice * one * one, twice * one * two, alike + twice * two * two
            for p in range(pairs):
                left = rows[r, p]
                if left != 0.0:
                    gradient[2 * p] += left * force[r, 0]
                    gradient[2 * p + 1] += left * force[r, 1]
                    for q in range(p + 1):
                        both = left * rows[r, q]
                        if both != 0.0:
                            hessian[2 * p, 2 * q] += a * both
                            hessian[2 * p, 2 * q + 1] += b * both
                            hessian[2 * p + 1, 2 * q] += b * both
                            hessian[2 * p + 1, 2 * q + 1] += c * both
        bound = 0.0
        for e in range(n_middles):
            middle[e] += beyond[e]
            alike = 2.0 * barrier / (half * half - middle[e] ** 2)
            pull = alike * middle[e]
            curved = alike + pull * pull / barrier
            bound += pull * beyond[e] - half * abs(pull)
            for x in range(size):
                left = middles[e, x]
                if left != 0.0:
                    gradient[x] += pull * left
                    for y in range(x + 1):
                        hessian[x, y] += curved * left * middles[e, y]
        for r in range(n_limits):
            one, two = force[r]
            if r < pairs:
                one -= gradient[2 * r]
                two -= gradient[2 * r + 1]
            bound -= largest[r] * math.sqrt(one * one + two * two)
        best = max(best, bound)
        if objective - bound <= _GAP or best >= enough:
            break
        for x in range(size):
            step[x] = -gradient[x]
        _solve(hessian, step)
        _apply(rows, middles, step, change, middle_change)
        slope, share = 0.0, 1.0 / _NEAR
        for x in range(size):
            slope += cost[x] * step[x]
        for r in range(n_limits):
            a = change[r, 0] ** 2 + change[r, 1] ** 2
            b = at[r, 0] * change[r, 0] + at[r, 1] * change[r, 1]
            c = largest[r] ** 2 - at[r, 0] ** 2 - at[r, 1] ** 2
            share = min(share, c / (b + math.sqrt(b * b + a * c) + 1e-12))
        for e in range(n_middles):
            towards = middle[e] if middle_change[e] > 0.0 else -middle[e]
            share = min(share, (half - towards) / (abs(middle_change[e]) + 1e-12))
        share *= _NEAR
        before = _merit(weights, largest, half, barrier, at, middle, change, middle_change, 0.0)
        for _ in range(_TRIED):
            after = _merit(
                weights, largest, half, barrier, at, middle, change, middle_change, share
            )
            if share * slope + after < before:
                break
            share *= 0.5
        for x in range(size):
            z[x] += share * step[x]
        if share > _DONE:
            barrier = max(_SHARPER * barrier, _LAST)
    return best


@allocating_kernel
def _apply(rows, middles, z, at, middle):
    n_rows, pairs = rows.shape
    for r in range(n_rows):
        one = two = 0.0
        for p in range(pairs):
            one += rows[r, p] * z[2 * p]
            two += rows[r, p] * z[2 * p + 1]
        at[r, 0], at[r, 1] = one, two
    for e in range(len(middle)):
        total = 0.0
        for x in range(2 * pairs):
            total += middles[e, x] * z[x]
        middle[e] = total


@allocating_kernel
def _merit(weights, largest, half, barrier, at, middle, change, middle_change, share):
    """The norms and the barrier, after a share of the step."""
    n_limits, found, logs = len(largest), 0.0, 0.0
    for r in range(len(at)):
        one = at[r, 0] + share * change[r, 0]
        two = at[r, 1] + share * change[r, 1]
        square = one * one + two * two
        if r < n_limits:
            logs += math.log(largest[r] ** 2 - square)
        else:
            weight = weights[r - n_limits]
            small = barrier / weight
            norm = small + math.sqrt(small * small + square)
            found += weight * norm
            logs += math.log(norm)
    for e in range(len(middle)):
        logs += math.log(half * half - (middle[e] + share * middle_change[e]) ** 2)
    return found - barrier * logs


@allocating_kernel
def _solve(lower, x):
    """Solves a positive definite system in place, of which the lower triangle is given."""
    n = len(x)
    for i in range(n):
        for j in range(i + 1):
            total = lower[i, j]
            for k in range(j):
                total -= lower[i, k] * lower[j, k]
            if i == j:
                lower[i, i] = math.sqrt(max(total, 1e-12))
            else:
                lower[i, j] = total / lower[j, j]
        total = x[i]
        for k in range(i):
            total -= lower[i, k] * x[k]
        x[i] = total / lower[i, i]
    for i in range(n - 1, -1, -1):
        total = x[i]
        for k in range(i + 1, n):
            total -= lower[k, i] * x[k]
        x[i] = total / lower[i, i]
