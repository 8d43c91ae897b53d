"""Runs of equal values."""

from itertools import pairwise

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from uas_coverage_env.replay.runs import mode_runs, runs


@given(st.lists(st.integers(0, 2)))
def test_runs_laid_one_after_the_other_are_the_values(values):
    found = list(runs(values))
    assert [value for value, first, after in found for _ in range(first, after)] == values
    assert all(a[0] != b[0] and a[2] == b[1] for a, b in pairwise(found))
    assert all(after > first for _, first, after in found)


def test_no_mode_lasts_beyond_the_last_sample(flight):
    for i in range(len(flight.names)):
        found = list(mode_runs(flight, i))
        assert (found[0][1], found[-1][2]) == (0, flight.steps)
        for mode, first, after in found:
            assert np.all(flight.mode[first : max(after, first + 1), i] == mode)
