"""Columns made rows, four by four."""

import numpy as np
import pytest

from uas_coverage_env.compiled.kernels import kernel
from uas_coverage_env.compiled.transposed import transposing

eight_rows_of_four = transposing(8, 4, 9)


@kernel
def transpose(columns, rows):
    eight_rows_of_four(columns, rows)


def test_columns_become_rows_and_what_lies_beyond_both_is_left_alone():
    columns = np.arange(40, dtype=np.float32)
    rows = np.full(34, -1.0, np.float32)

    transpose(columns, rows)

    assert rows[:32].reshape(8, 4).tolist() == columns[:36].reshape(4, 9)[:, :8].T.tolist()
    assert rows[32:].tolist() == [-1.0, -1.0]


@pytest.mark.parametrize(("n", "width"), [(6, 4), (4, 6)])
def test_what_is_no_multiple_of_four_is_refused(n, width):
    with pytest.raises(ValueError, match="multiples of 4"):
        transposing(n, width, 16)
