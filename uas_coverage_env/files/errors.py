"""The errors that the command line reports in one line."""

from typing import Any


class InputError(ValueError):
    """A mistake in what a person gave us: one line that names file, field, value and fix."""


def check_within(option: str, value: float, least: float, most: float) -> None:
    """Refuse a number out of bounds.

    Raises:
        InputError: It is, or it is none.
    """
    if not least <= value <= most:
        raise InputError(f"{option} {value:g}: should be between {least:g} and {most:g}")


class PlannerError(ValueError):
    """A planner raised an exception, or gave commands that cannot be flown.

    One line: the planner, the step, and the exception with its place in the planner's code, or the
    UAS and the value.

    Attributes:
        flight: What was flown before, a `Flight`; None where nothing was.
    """

    flight: Any = None
