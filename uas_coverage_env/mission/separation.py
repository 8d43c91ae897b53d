"""Waits that keep UAS apart: a later start of some of them, else a longer stop at a corner.

Files of legs carry no time, but they can wait. A UAS after the other gets the shortest wait with
which any of those placed before it may be late by what is asked; of several orders the one counts
that has all of them home first.
"""

import itertools
import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.mission.lateness import encounters, kept_m
from uas_coverage_env.mission.leg_model import DT_S, Followed
from uas_coverage_env.scenario import Scenario

LONGEST_WAIT_S = 3_600
"""Nothing is made to wait longer than that."""

_MOST_ORDERED = 4
_MOST_CORNERS = 24
_TOLERANCE_S = 1e-6

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class Waits:
    """Where a UAS waits for others.

    Attributes:
        start_s: On the ground, before it takes off [s].
        leg: Index of the leg at whose end it waits in the air; None: it does not.
        hold_s: How long it waits there, a stop that it makes anyhow not counted [s].
    """

    start_s: int = 0
    leg: int | None = None
    hold_s: int = 0


Fly = Callable[[Waits], Followed]
"""How a file is flown with waits in it."""


@dataclass(frozen=True, eq=False)
class _Placed:
    """A UAS whose waits are settled: when it reaches each of its places, and when it leaves it."""

    uas: int
    waits: Waits
    followed: Followed
    arrive_s: FloatArray
    leave_s: FloatArray

    @property
    def home_s(self) -> float:
        return float(self.arrive_s[-1])


def separate(
    scenario: Scenario, fleet: Sequence[tuple[int, Fly]], slack_s: float
) -> list[Waits] | None:
    """Waits with which every UAS may be late by as much as is asked.

    Args:
        scenario: The mission.
        fleet: Index of each UAS, and how its file is flown with waits.
        slack_s: How late any of them has to be able to be [s].

    Returns:
        One entry for each of the fleet; None where no waits are found.
    """
    search = _Search(scenario, fleet, slack_s)
    found = [placed for order in _orders(search.base) if (placed := search.place(order, False))]
    if not found:
        found = [p for o in _few_orders(search.base) if (p := search.place(o, True))]
    if not found:
        return None
    best = min(found, key=lambda all_: (max(p.home_s for p in all_), _waited_s(all_)))
    by_uas = {placed.uas: placed.waits for placed in best}
    return [by_uas[uas] for uas, _ in fleet]


def _waited_s(fleet: Sequence[_Placed]) -> int:
    return sum(placed.waits.start_s + placed.waits.hold_s for placed in fleet)


def _orders(base: Sequence[Followed]) -> Iterator[tuple[int, ...]]:
    if len(base) <= _MOST_ORDERED:
        return itertools.permutations(range(len(base)))
    return _few_orders(base)


def _few_orders(base: Sequence[Followed]) -> Iterator[tuple[int, ...]]:
    """As they come, backwards, and by the length of their flights."""
    given = range(len(base))
    by_length = sorted(given, key=lambda k: base[k].duration_s)
    orders = (tuple(given), tuple(given)[::-1], tuple(by_length), tuple(by_length)[::-1])
    return iter(dict.fromkeys(orders))


class _Search:
    def __init__(
        self, scenario: Scenario, fleet: Sequence[tuple[int, Fly]], slack_s: float
    ) -> None:
        self._scenario, self._fleet, self._slack_s = scenario, fleet, slack_s
        self.base = [fly(Waits()) for _, fly in fleet]
        self._found: dict[tuple[int, int], NDArray[np.intp]] = {}

    def place(self, order: Sequence[int], in_the_air: bool) -> list[_Placed] | None:
        """The fleet in an order, each with the shortest wait; None where one finds none."""
        placed: list[_Placed] = []
        for k in order:
            one = self._on_the_ground(k, placed)
            if one is None and in_the_air:
                one = self._in_the_air(k, placed)
            if one is None:
                return None
            placed.append(one)
        return placed

    def _on_the_ground(self, k: int, placed: Sequence[_Placed]) -> _Placed | None:
        followed = self.base[k]
        start_s = self._shortest(k, followed, 0, placed)
        if start_s is None:
            return None
        return _placed(self._fleet[k][0], Waits(start_s), followed, 0, start_s)

    def _in_the_air(self, k: int, placed: Sequence[_Placed]) -> _Placed | None:
        uas, fly = self._fleet[k]
        n_legs = len(self.base[k].corner_s) - 1
        legs = range(0, n_legs - 1, math.ceil(max(n_legs - 1, 1) / _MOST_CORNERS))
        found = []
        for leg in legs:
            stopping = fly(Waits(leg=leg))
            sample = round(float(stopping.corner_s[leg + 1]) / DT_S)
            hold_s = self._shortest(k, stopping, sample, placed)
            if hold_s is not None:
                found.append(_placed(uas, Waits(0, leg, hold_s), stopping, sample, hold_s))
        return min(found, key=lambda one: one.home_s) if found else None

    def _shortest(
        self, k: int, followed: Followed, sample: int, placed: Sequence[_Placed]
    ) -> int | None:
        """The shortest wait at a sample that keeps a UAS apart from those placed before it."""
        low, high = [np.empty(0)], [np.empty(0)]
        for other in placed:
            found = self._encounters(other, k, followed)
            excluded = _excluded(found, other, followed, sample, self._slack_s + _TOLERANCE_S)
            low.append(excluded[0])
            high.append(excluded[1])
        return _least_outside(np.concatenate(low), np.concatenate(high))

    def _encounters(self, other: _Placed, k: int, followed: Followed) -> NDArray[np.intp]:
        uas = self._fleet[k][0]
        key = (id(other.followed), id(followed))  # the base is kept, so that no id comes again
        keeps = any(other.followed is one for one in self.base) and followed is self.base[k]
        if keeps and key in self._found:
            return self._found[key]
        apart_m = kept_m(self._scenario, other.uas, uas)
        found = encounters(other.followed, followed, apart_m)
        if keeps:
            self._found[key] = found
        return found


def _placed(uas: int, waits: Waits, followed: Followed, sample: int, wait_s: int) -> _Placed:
    arrive_s, leave_s = followed.times_s.copy(), followed.times_s.copy()
    arrive_s[sample + 1 :] += wait_s
    leave_s[sample:] += wait_s
    arrive_s[0], leave_s[-1] = -math.inf, math.inf  # on the ground before and after
    return _Placed(uas, waits, followed, arrive_s, leave_s)


def _excluded(
    found: NDArray[np.intp], other: _Placed, followed: Followed, sample: int, slack_s: float
) -> tuple[FloatArray, FloatArray]:
    """Open intervals of waits at a sample that bring a UAS too close to another one.

    Each is at a place from when it arrives to when it leaves; these times have to be apart.
    """
    n, m = found[:, 0], found[:, 1]
    arrive_s, leave_s = other.arrive_s[n], other.leave_s[n]
    mine_s = followed.times_s[m]
    from_s = np.where(m == 0, -math.inf, mine_s)
    until_s = np.where(m == len(followed.times_s) - 1, math.inf, mine_s)
    # what comes after the wait moves with it
    low, high = arrive_s - until_s - slack_s, leave_s - from_s + slack_s
    before = (from_s - leave_s >= slack_s) | (arrive_s - until_s >= slack_s)
    earlier, here = m < sample, m == sample
    low = np.where(earlier, np.where(before, math.inf, -math.inf), low)
    high = np.where(earlier, np.where(before, -math.inf, math.inf), high)
    gone = here & (from_s - leave_s >= slack_s)
    low = np.where(gone, math.inf, low)
    high = np.where(here, np.where(gone, -math.inf, math.inf), high)
    return low, high


def _least_outside(low: FloatArray, high: FloatArray) -> int | None:
    """The least whole number from 0 on that is in none of the open intervals."""
    wait_s = 0
    while True:
        inside = (low < wait_s) & (wait_s < high)
        if not inside.any():
            return wait_s
        end_s = float(high[inside].max())
        if end_s > LONGEST_WAIT_S:
            return None
        wait_s = math.ceil(end_s)
