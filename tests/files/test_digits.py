"""Figures as they are printed."""

import pytest

from uas_coverage_env.files.digits import three_digits


@pytest.mark.parametrize(
    ("value", "text"),
    [(1037.21, "1040"), (24.0, "24.0"), (9.996, "10.0"), (0.04567, "0.0457"), (0.0, "0.00")],
)
def test_figures_have_three_significant_digits_and_no_exponent(value, text):
    assert three_digits(value) == text
