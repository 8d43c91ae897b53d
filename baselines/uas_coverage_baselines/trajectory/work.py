"""Work that can be done in parts: a generator that pauses after each program, or each search."""

from __future__ import annotations

from collections.abc import Generator
from typing import TypeVar

_Result = TypeVar("_Result")

Work = Generator[int, None, _Result]
"""Yields the effort of what was done since; effort is counted in steps of flights looked for."""


def done(work: Work[_Result]) -> _Result:
    """The result of all of it, at once."""
    while True:
        try:
            next(work)
        except StopIteration as end:
            return end.value
