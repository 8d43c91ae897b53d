"""The statistics against plain NumPy, against scipy, and where there is little to count."""

import math
import warnings

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import stats

from uas_coverage_env.leaderboard.statistics import (
    RESAMPLES,
    estimate,
    iqm,
    mean,
    paired_difference,
    probability_of_improvement,
)

VALUES = st.floats(-1e6, 1e6).map(lambda value: round(value, 3))
STRATUM = st.lists(VALUES, max_size=6).map(lambda values: np.array(values, float))
STRATA = st.lists(STRATUM, max_size=5)
OVER = st.sampled_from(["seeds", "scenarios"])


def plain_iqm(values) -> float:
    ordered = sorted(values)
    cut = len(ordered) // 4
    inside = ordered[cut : len(ordered) - cut]
    return sum(inside) / len(inside)


@given(st.lists(VALUES, min_size=1, max_size=40), st.integers(0, 5))
@settings(max_examples=200, deadline=None, derandomize=True)
def test_the_interquartile_mean_is_the_plain_one_and_ignores_what_is_missing(values, missing):
    with_gaps = np.array([*values, *([math.nan] * missing)])
    np.random.default_rng(len(values)).shuffle(with_gaps)
    expected = plain_iqm(values)
    assert float(iqm(with_gaps)) == pytest.approx(expected, rel=1e-9, abs=1e-6)
    assert stats.trim_mean(values, 0.25) == pytest.approx(expected, rel=1e-9, abs=1e-6)


def test_the_interquartile_mean_works_along_any_axis():
    values = np.random.default_rng(3).normal(size=(4, 9, 5))
    assert iqm(values, axis=1) == pytest.approx(stats.trim_mean(values, 0.25, axis=1))


@given(STRATA, OVER)
@settings(max_examples=150, deadline=None, derandomize=True)
def test_an_estimate_is_finite_or_nothing_and_lies_in_the_range_of_its_values(strata, over):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        found = estimate(strata, over)
    together = np.concatenate([*strata, []])
    assert found.n == len(together)
    if not len(together):
        assert (found.value, found.low, found.high) == (None, None, None)
        return
    assert found.value == pytest.approx(plain_iqm(together), rel=1e-9, abs=1e-6)
    sizes = [len(stratum) for stratum in strata if len(stratum)]
    can_tell = max(sizes) > 1 if over == "seeds" else len(sizes) > 1
    assert (found.low is not None, found.high is not None) == (can_tell, can_tell)
    if can_tell:
        slack = 1e-6 + 1e-9 * np.abs(together).max()
        assert together.min() - slack <= found.low <= found.high <= together.max() + slack


def test_seeds_are_drawn_within_their_scenario_as_scipy_draws_them():
    lots = np.random.default_rng(11)
    strata = [lots.normal(10.0 * s, 1.0 + s, size=12) for s in range(6)]

    def statistic(*drawn, axis):
        return stats.trim_mean(np.concatenate(drawn, axis=axis), 0.25, axis=axis)

    expected = stats.bootstrap(
        strata, statistic, method="percentile", n_resamples=20_000, rng=5
    ).confidence_interval
    found = estimate(strata, "seeds")
    width = expected.high - expected.low
    assert found.low == pytest.approx(expected.low, abs=0.1 * width)
    assert found.high == pytest.approx(expected.high, abs=0.1 * width)
    # drawn across scenarios, it would be many times as wide
    assert found.high - found.low < 0.2 * (
        estimate(strata, "scenarios").high - estimate(strata, "scenarios").low
    )


def test_scenarios_are_drawn_whole_as_scipy_draws_them():
    values = np.random.default_rng(12).normal(50.0, 8.0, size=25)
    expected = stats.bootstrap(
        (values,), np.mean, method="percentile", n_resamples=20_000, rng=5
    ).confidence_interval
    found = estimate([np.array([value]) for value in values], "scenarios", mean)
    width = expected.high - expected.low
    assert found.low == pytest.approx(expected.low, abs=0.1 * width)
    assert found.high == pytest.approx(expected.high, abs=0.1 * width)


def test_equal_flights_have_an_interval_of_no_width_and_single_ones_have_none():
    same = estimate([np.full(5, 7.25), np.full(3, 7.25)], "seeds")
    assert (same.value, same.low, same.high, same.n) == (7.25, 7.25, 7.25, 8)
    for over in ("seeds", "scenarios"):
        one = estimate([np.array([3.0])], over)
        assert (one.value, one.low, one.high, one.n) == (3.0, None, None, 1)
    # one seed each: seeds can tell nothing, scenarios can
    singles = [np.array([1.0]), np.array([2.0]), np.array([9.0])]
    assert estimate(singles, "seeds").low is None
    assert estimate(singles, "scenarios").low is not None


def test_the_same_flights_give_the_same_interval():
    strata = [np.array([1.0, 2.0, 5.0]), np.array([4.0, 4.5])]
    assert estimate(strata, "seeds") == estimate(strata, "seeds")


@given(STRATA, STRATA, OVER)
@settings(max_examples=100, deadline=None, derandomize=True)
def test_probability_of_improvement_is_the_mean_share_of_won_pairs(mine, theirs, over):
    mine, theirs = mine[: len(theirs)], theirs[: len(mine)]
    shares = []
    for m, t in zip(mine, theirs, strict=True):
        if len(m) and len(t):
            # the rank-sum statistic of Mann and Whitney, by another road
            shares.append(stats.mannwhitneyu(t, m, method="asymptotic").statistic / len(m) / len(t))
    found = probability_of_improvement(mine, theirs, over)
    backwards = probability_of_improvement(theirs, mine, over)
    if not shares:
        assert found.value is None
        return
    assert found.value == pytest.approx(np.mean(shares))
    assert found.value + backwards.value == pytest.approx(1.0)
    if found.low is not None:
        assert 0.0 <= found.low <= found.high <= 1.0


def test_a_flight_that_failed_loses_against_all_that_did_not_and_ties_with_its_like():
    finite, infinite = np.array([5.0]), np.array([math.inf])
    assert probability_of_improvement([finite], [infinite], "seeds").value == 1.0
    assert probability_of_improvement([infinite], [finite], "seeds").value == 0.0
    assert probability_of_improvement([infinite], [infinite], "seeds").value == 0.5


def test_paired_differences_are_drawn_over_scenarios_or_seeds_of_a_single_one():
    several = paired_difference([np.array([1.0, 3.0]), np.array([]), np.array([6.0])])
    assert (several.value, several.n) == (4.0, 3)
    assert (several.low, several.high) == (2.0, 6.0)
    alone = paired_difference([np.array([1.0, 3.0])])
    assert (alone.value, alone.low, alone.high, alone.n) == (2.0, 1.0, 3.0, 2)
    assert paired_difference([np.array([1.0])]).low is None
    assert paired_difference([np.array([])]).value is None


def test_many_flights_are_compared_in_parts_with_the_same_result():
    lots = np.random.default_rng(2)
    mine, theirs = lots.normal(size=300), lots.normal(size=300)
    found = probability_of_improvement([mine], [theirs], "seeds")
    assert 300 * 300 * RESAMPLES > 4_000_000, "else there is one part"
    expected = (mine[:, None] < theirs[None, :]).mean()
    assert found.value == pytest.approx(expected)
    assert found.low < expected < found.high
