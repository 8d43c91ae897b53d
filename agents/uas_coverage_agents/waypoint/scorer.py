"""The pointer network, compiled: one observation in, a score for every choice out."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from uas_coverage_agents.policy.pointer import Pointer
from uas_coverage_agents.policy.tensors import Tensors
from uas_coverage_agents.waypoint.layout import N_CANDIDATE, N_TEAM, WAY, K
from uas_coverage_env.compiled.kernels import allocating_kernel


class ScorerWeights(NamedTuple):
    """The tensors of a `Pointer`; matrices are transposed: inputs along the first axis."""

    candidate_0: NDArray[np.float64]
    candidate_0_bias: NDArray[np.float64]
    candidate_1: NDArray[np.float64]
    candidate_1_bias: NDArray[np.float64]
    team: NDArray[np.float64]
    team_bias: NDArray[np.float64]
    score_candidate: NDArray[np.float64]
    score_team: NDArray[np.float64]
    score_team_bias: NDArray[np.float64]
    score_out: NDArray[np.float64]
    home_0: NDArray[np.float64]
    home_0_bias: NDArray[np.float64]
    home_1: NDArray[np.float64]
    home_1_bias: NDArray[np.float64]
    prior: NDArray[np.float64]


def scorer_weights(network: Pointer, tensors: Tensors) -> ScorerWeights:
    """The weights in the order in which they are used."""
    arrays = [np.array(tensors[name].T, dtype=np.float64, order="C") for name in network.shapes()]
    return ScorerWeights._make([*arrays, np.array([network.prior])])


@allocating_kernel
def _layer(x, weight, bias, out):
    """Write relu(x · weight + bias)."""
    out[:] = bias
    for a in range(x.shape[0]):
        if x[a] != 0.0:  # after a relu, half of them are
            out += x[a] * weight[a]
    for b in range(out.shape[0]):
        out[b] = max(out[b], 0.0)


@allocating_kernel
def write_scores(weights, observation, scores):
    """Write the score of every choice, see `Pointer`; those that are not there get -inf.

    Args:
        weights: `ScorerWeights`.
        observation: (OBSERVATION_SIZE,).
        scores: (K+1,) written.
    """
    h = weights.team_bias.shape[0]
    e = np.empty((K, h))
    first = np.empty(h)
    x = np.empty(N_TEAM + h)
    x[:N_TEAM] = observation[:N_TEAM]
    x[N_TEAM:] = 0.0
    n = 0
    for k in range(K):
        at = N_TEAM + k * N_CANDIDATE
        if observation[at] == 0.0:
            break
        n += 1
        candidate = observation[at : at + N_CANDIDATE]
        _layer(candidate, weights.candidate_0, weights.candidate_0_bias, first)
        _layer(first, weights.candidate_1, weights.candidate_1_bias, e[k])
        x[N_TEAM:] += e[k]
    x[N_TEAM:] /= max(n, 1)
    t = np.empty(h)
    _layer(x, weights.team, weights.team_bias, t)
    offered = weights.score_team_bias.copy()
    for a in range(h):
        offered += t[a] * weights.score_team[a]
    scores[:] = -np.inf
    hidden = np.empty(h)
    nearest = np.float64(observation[N_TEAM + WAY])
    for k in range(n):
        _layer(e[k], weights.score_candidate, offered, hidden)
        farther = np.float64(observation[N_TEAM + k * N_CANDIDATE + WAY]) - nearest
        total = -weights.prior[0] * farther
        for a in range(h):
            total += hidden[a] * weights.score_out[a, 0]
        scores[k] = total
    _layer(t, weights.home_0, weights.home_0_bias, hidden)
    total = weights.home_1_bias[0]
    for a in range(h):
        total += hidden[a] * weights.home_1[a, 0]
    scores[K] = total


@allocating_kernel
def best_choice(weights, observation, legal, scores):
    """The legal choice with the highest score; `scores` (K+1,) is written."""
    write_scores(weights, observation, scores)
    best = -1
    for k in range(K + 1):
        if legal[k] and (best < 0 or scores[k] > scores[best]):
            best = k
    return best
