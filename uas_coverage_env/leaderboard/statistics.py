"""Interquartile means, bootstrap intervals and probabilities of improvement.

After R. Agarwal et al., "Deep reinforcement learning at the edge of the statistical precipice"
(NeurIPS 2021): a few flights per scenario are summed up by the interquartile mean over all of
them, with a 95 % percentile interval of a bootstrap, and planners are compared by the probability
that one does better.

What is measured comes as one array per scenario, its flights along the axis. Two intervals answer
two questions:
    `seeds`: the bootstrap is stratified, flights are drawn anew within their scenario. What would
        other seeds change, on these scenarios?
    `scenarios`: whole scenarios are drawn anew, each with its flights. What would other scenarios
        of this kind change? It is the one that exists where each scenario was flown once.
Every draw is made with the same fixed generator: the same flights give the same interval.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
Over = Literal["seeds", "scenarios"]

RESAMPLES = 2000
CONFIDENCE = 0.95
_TRIMMED = 0.25  # of the values at either end
_MOST_COMPARED = 4_000_000  # pairs of flights at a time: bounds the memory


@dataclass(frozen=True)
class Estimate:
    """A figure and its interval.

    Attributes:
        value: None where nothing was measured.
        low: Lower end of the interval; None where the flights cannot tell how sure it is.
        high: Upper end.
        n: Of how many flights, or pairs.
    """

    value: float | None
    low: float | None
    high: float | None
    n: int


def iqm(values: FloatArray, axis: int = -1) -> FloatArray:
    """Interquartile mean: a quarter (rounded down) at either end is left out.

    Args:
        values: NaN stands for no value; there is at least one value along the axis.
        axis: Along which.
    """
    ordered = np.sort(np.moveaxis(values, axis, -1), axis=-1)  # NaN last
    n = np.count_nonzero(~np.isnan(ordered), axis=-1)[..., None]
    cut = np.floor(_TRIMMED * n)
    place = np.arange(ordered.shape[-1])
    inside = (place >= cut) & (place < n - cut)
    return np.where(inside, ordered, 0.0).sum(axis=-1) / (n - 2 * cut)[..., 0]


def mean(values: FloatArray, axis: int = -1) -> FloatArray:
    """Mean of the values that are there."""
    return np.nanmean(values, axis=axis)


def estimate(
    strata: Sequence[FloatArray], over: Over, statistic: Callable[..., FloatArray] = iqm
) -> Estimate:
    """A statistic over all flights, with its interval.

    Args:
        strata: The values of each scenario; one may be empty.
        over: What is drawn anew, see above.
        statistic: `iqm` or `mean`.
    """
    table = _table(strata)
    if not table.size:
        return Estimate(None, None, None, 0)
    n = int(np.count_nonzero(~np.isnan(table)))
    value = float(statistic(table.ravel()))
    if over == "seeds":
        rows = _seeds_drawn(table)
    else:
        rows = _scenarios_drawn(table)
    if rows is None:
        return Estimate(value, None, None, n)
    return Estimate(value, *_interval(statistic(rows.reshape(len(rows), -1))), n)


def probability_of_improvement(
    mine: Sequence[FloatArray], theirs: Sequence[FloatArray], over: Over
) -> Estimate:
    """How probable it is that a flight of mine has a lower value; equal ones count half.

    The mean over scenarios of the share of pairs of flights in which mine is lower.

    Args:
        mine: The values of each scenario; infinite where a flight is worse than any that succeeds.
        theirs: The same scenarios in the same order.
        over: What is drawn anew.
    """
    both = [(m, t) for m, t in zip(mine, theirs, strict=True) if len(m) and len(t)]
    if not both:
        return Estimate(None, None, None, 0)
    n = sum(min(len(m), len(t)) for m, t in both)
    shares = np.array([_share_lower(m[None], t[None])[0] for m, t in both])
    value = float(shares.mean())
    if over == "scenarios":
        rows = _scenarios_drawn(shares[:, None])
        if rows is None:
            return Estimate(value, None, None, n)
        return Estimate(value, *_interval(rows.reshape(len(rows), -1).mean(axis=-1)), n)
    if all(len(m) < 2 and len(t) < 2 for m, t in both):
        return Estimate(value, None, None, n)
    rng = np.random.default_rng(0)
    drawn = [_share_lower(_drawn(rng, m), _drawn(rng, t)) for m, t in both]
    return Estimate(value, *_interval(np.mean(drawn, axis=0)), n)


def paired_difference(differences: Sequence[FloatArray]) -> Estimate:
    """Mean over scenarios of the mean difference of paired flights.

    The interval is over scenarios; over seeds where there is one scenario alone.

    Args:
        differences: Of each scenario, one per pair; one may be empty.
    """
    there = [values for values in differences if len(values)]
    if not there:
        return Estimate(None, None, None, 0)
    n = sum(map(len, there))
    if len(there) == 1:
        return estimate(there, "seeds", mean)
    means = [np.array([values.mean()]) for values in there]
    found = estimate(means, "scenarios", mean)
    return Estimate(found.value, found.low, found.high, n)


def _table(strata: Sequence[FloatArray]) -> FloatArray:
    """(scenarios, most flights) with NaN where a scenario has fewer; empty scenarios left out."""
    there = [values for values in strata if len(values)]
    table = np.full((len(there), max(map(len, there), default=0)), np.nan)
    for row, values in zip(table, there, strict=True):
        row[: len(values)] = values
    return table


def _seeds_drawn(table: FloatArray) -> FloatArray | None:
    """(resamples, scenarios, flights) with flights drawn within each scenario; None: none can."""
    counts = np.count_nonzero(~np.isnan(table), axis=1)
    if counts.max() < 2:
        return None
    rng = np.random.default_rng(0)
    result = np.full((RESAMPLES, *table.shape), np.nan)
    for s, count in enumerate(counts):
        result[:, s, :count] = _drawn(rng, table[s, :count])
    return result


def _scenarios_drawn(table: FloatArray) -> FloatArray | None:
    """(resamples, scenarios, flights) with scenarios drawn; None: there is one alone."""
    if len(table) < 2:
        return None
    rng = np.random.default_rng(0)
    return table[rng.integers(0, len(table), (RESAMPLES, len(table)))]


def _drawn(rng: np.random.Generator, values: FloatArray) -> FloatArray:
    return values[rng.integers(0, len(values), (RESAMPLES, len(values)))]


def _share_lower(mine: FloatArray, theirs: FloatArray) -> FloatArray:
    """(R,) share of the pairs of (R, n) and (R, m) in which mine is lower; equal counts half."""
    rows = max(1, _MOST_COMPARED // (mine.shape[1] * theirs.shape[1]))
    parts = [
        (
            (mine[r : r + rows, :, None] < theirs[r : r + rows, None, :]).mean(axis=(1, 2))
            + 0.5 * (mine[r : r + rows, :, None] == theirs[r : r + rows, None, :]).mean(axis=(1, 2))
        )
        for r in range(0, len(mine), rows)
    ]
    return np.concatenate(parts)


def _interval(statistics: FloatArray) -> tuple[float, float]:
    tail = 50.0 * (1.0 - CONFIDENCE)
    low, high = np.percentile(statistics, (tail, 100.0 - tail))
    return float(low), float(high)
