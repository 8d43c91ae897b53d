"""Runs of equal values: what a UAS was doing when, and how long a mark lasts."""

from collections.abc import Iterable, Iterator
from itertools import groupby
from typing import TypeVar

from uas_coverage_env.flight import Flight

Value = TypeVar("Value")


def runs(values: Iterable[Value]) -> Iterator[tuple[Value, int, int]]:
    """Each run of equal values: the value, its first index, and the first index after it."""
    first = 0
    for value, run in groupby(values):
        after = first + sum(1 for _ in run)
        yield value, first, after
        first = after


def mode_runs(flight: Flight, i: int) -> Iterator[tuple[int, int, int]]:
    """What a UAS was doing: index of `MODES`, first sample, sample at which the next one begins.

    The last sample of a flight is a moment: nothing lasts beyond it.
    """
    for mode, first, after in runs(flight.mode[:, i].tolist()):
        yield mode, first, min(after, flight.steps)
