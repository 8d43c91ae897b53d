"""Newton steps of the interior point by a Riccati recursion: linear in the number of stages.

    minimise    sum of 1/2 dx'Q dx + q'dx over stages 1..N and of 1/2 du'R du + r'du over 0..N-1
    subject to  dx(n+1) = A dx(n) + B du(n) + d(n),  dx(0) = 0

with A = blkdiag(4, 4, 2), upper triangular in each block, and a column of B for each block, as the
flight model has them. The recursion is the one of Rao, Wright and Rawlings, "Application of
interior-point methods to model predictive control", J. Optim. Theory Appl. 99 (1998).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from uas_coverage_baselines.trajectory.flight_model import N_U, N_X
from uas_coverage_env.compiled.kernels import allocating_kernel

FloatArray = NDArray[np.float64]


class Factors(NamedTuple):
    """What `factor` leaves for `newton_step`."""

    P: FloatArray
    """(N+1, 10, 10) cost to go."""
    K: FloatArray
    """(N, 3, 10) gains."""
    S_inverse: FloatArray
    """(N, 3, 3) of R + B'PB."""


@allocating_kernel
def factor(A, B, Q, R, factors):
    """Factorise for all stages.

    Args:
        A: (10, 10).
        B: (10, 3).
        Q: (N+1, 10, 10) of the states; that of the first is not read.
        R: (N, 3) diagonals.
        factors: `Factors`, written.
    """
    P, K, S_inverse = factors.P, factors.K, factors.S_inverse
    n_stages = R.shape[0]
    PA, PB = np.empty((N_X, N_X)), np.empty((N_X, N_U))
    S, G = np.empty((N_U, N_U)), np.empty((N_U, N_X))
    P[n_stages] = Q[n_stages]
    for n in range(n_stages - 1, -1, -1):
        after = P[n + 1]
        for i in range(N_X):
            for block in range(N_U):
                low, high = 4 * block, min(4 * block + 4, N_X)
                for j in range(low, high):
                    value = 0.0
                    for k in range(low, j + 1):
                        value += after[i, k] * A[k, j]
                    PA[i, j] = value
                value = 0.0
                for k in range(low, high):
                    value += after[i, k] * B[k, block]
                PB[i, block] = value
        for a in range(N_U):
            low, high = 4 * a, min(4 * a + 4, N_X)
            for b in range(N_U):
                value = 0.0
                for k in range(low, high):
                    value += B[k, a] * PB[k, b]
                S[a, b] = value
            S[a, a] += R[n, a]
            for j in range(N_X):
                value = 0.0
                for k in range(low, high):
                    value += B[k, a] * PA[k, j]
                G[a, j] = value
        _invert(S, S_inverse[n])
        for a in range(N_U):
            for j in range(N_X):
                value = 0.0
                for b in range(N_U):
                    value += S_inverse[n, a, b] * G[b, j]
                K[n, a, j] = value
        for block in range(N_U):
            low, high = 4 * block, min(4 * block + 4, N_X)
            for i in range(low, high):
                for j in range(N_X):
                    value = Q[n, i, j]
                    for k in range(low, i + 1):
                        value += A[k, i] * PA[k, j]
                    for a in range(N_U):
                        value -= K[n, a, i] * G[a, j]
                    P[n, i, j] = value
        for i in range(N_X):
            for j in range(i):
                middle = 0.5 * (P[n, i, j] + P[n, j, i])
                P[n, i, j] = middle
                P[n, j, i] = middle


@allocating_kernel
def _invert(S, inverse):
    """The inverse of a symmetric 3x3 matrix."""
    a, b, c, d, e, f = S[0, 0], S[0, 1], S[0, 2], S[1, 1], S[1, 2], S[2, 2]
    first, second, third = d * f - e * e, c * e - b * f, b * e - c * d
    determinant = a * first + b * second + c * third
    inverse[0, 0] = first / determinant
    inverse[0, 1] = inverse[1, 0] = second / determinant
    inverse[0, 2] = inverse[2, 0] = third / determinant
    inverse[1, 1] = (a * f - c * c) / determinant
    inverse[1, 2] = inverse[2, 1] = (b * c - a * e) / determinant
    inverse[2, 2] = (a * d - b * b) / determinant


@allocating_kernel
def newton_step(A, B, factors, q, r, d, dx, du, costate):
    """Solve for one right-hand side.

    Args:
        A: (10, 10).
        B: (10, 3).
        factors: From `factor`.
        q: (N+1, 10).
        r: (N, 3).
        d: (N, 10) residuals of the dynamics.
        dx: (N+1, 10) written.
        du: (N, 3) written.
        costate: (N, 10) written: multipliers of the dynamics, of the states 1..N.
    """
    P, K, S_inverse = factors.P, factors.K, factors.S_inverse
    n_stages = r.shape[0]
    p, w, g = np.empty((n_stages + 1, N_X)), np.empty(N_X), np.empty(N_U)
    offset = np.empty((n_stages, N_U))
    p[n_stages] = q[n_stages]
    for n in range(n_stages - 1, -1, -1):
        for i in range(N_X):
            value = p[n + 1, i]
            for j in range(N_X):
                value += P[n + 1, i, j] * d[n, j]
            w[i] = value
        for a in range(N_U):
            value = r[n, a]
            for k in range(4 * a, min(4 * a + 4, N_X)):
                value += B[k, a] * w[k]
            g[a] = value
        for a in range(N_U):
            value = 0.0
            for b in range(N_U):
                value += S_inverse[n, a, b] * g[b]
            offset[n, a] = value
        for block in range(N_U):
            low = 4 * block
            for i in range(low, min(low + 4, N_X)):
                value = q[n, i]
                for k in range(low, i + 1):
                    value += A[k, i] * w[k]
                for a in range(N_U):
                    value -= K[n, a, i] * g[a]
                p[n, i] = value
    dx[0] = 0.0
    for n in range(n_stages):
        for a in range(N_U):
            value = -offset[n, a]
            for j in range(N_X):
                value -= K[n, a, j] * dx[n, j]
            du[n, a] = value
        for block in range(N_U):
            low, high = 4 * block, min(4 * block + 4, N_X)
            for i in range(low, high):
                value = d[n, i] + B[i, block] * du[n, block]
                for j in range(i, high):
                    value += A[i, j] * dx[n, j]
                dx[n + 1, i] = value
        for i in range(N_X):
            value = p[n + 1, i]
            for j in range(N_X):
                value += P[n + 1, i, j] * dx[n + 1, j]
            costate[n, i] = value
