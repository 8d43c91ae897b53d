"""Figures as they are printed."""

from decimal import Decimal


def three_digits(value: float) -> str:
    """A figure rounded to three significant digits, without an exponent: 1040, 12.3, 0.0457."""
    return format(Decimal(f"{value:.2e}"), "f")
