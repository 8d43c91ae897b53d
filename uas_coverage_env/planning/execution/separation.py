"""Waits that keep UAS apart: some set out later than others, else stop longer at a corner.

Files of legs carry no time, but they can wait. A UAS after the other gets the shortest wait with
which any of those placed before it may be late by what is asked; of several orders the one counts
that has all of them home first. A UAS may fly several files, each after it has landed from the one
before and has been on the ground for a while.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.planning.execution.lateness import encounters, kept_m
from uas_coverage_env.planning.execution.leg_model import DT_S, Followed
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
        start_s: Before it sets out: on the ground or, in files, above where it takes off; where it
            has flown before, on the ground beyond the time that it is there anyhow [s].
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
    """A file whose waits are settled: when its UAS reaches each of its places, and leaves it."""

    k: int
    uas: int
    waits: Waits
    followed: Followed
    arrive_s: FloatArray
    leave_s: FloatArray

    @property
    def home_s(self) -> float:
        return float(self.arrive_s[-1])


class _Slot(NamedTuple):
    """When a file may begin at the earliest.

    Attributes:
        since_s: The UAS has been on the ground since then [s].
        ready_s: From then on it may be started [s].
        again: Whether the UAS flies another file afterwards.
    """

    since_s: float
    ready_s: float
    again: bool


def ready_s(landed_s: float, pause_s: float) -> float:
    """When a UAS can be started again: a whole second, for whoever starts it by the clock [s].

    Args:
        landed_s: When it has landed [s].
        pause_s: How long it is on the ground at least [s].
    """
    return float(math.ceil(landed_s + pause_s - _TOLERANCE_S))


def separate(
    scenario: Scenario,
    fleet: Sequence[tuple[int, Fly]],
    slack_s: float,
    pauses_s: Sequence[float] = (),
    *,
    in_hover: bool = False,
) -> list[Waits] | None:
    """Waits with which every UAS may be late by as much as is asked.

    Args:
        scenario: The mission.
        fleet: Index of each UAS, and how its file is flown with waits. A UAS that is named again
            flies again.
        slack_s: How late any of them has to be able to be [s].
        pauses_s: How long each is on the ground before, where it has flown before; without it,
            every UAS flies once [s].
        in_hover: Whether a UAS that sets out later waits where its take-off ends; else it does on
            the ground. What flies after it has landed waits on the ground in either case.

    Returns:
        One entry for each of the fleet; None where no waits are found.
    """
    search = _Search(scenario, fleet, slack_s, pauses_s, in_hover=in_hover)
    found = [placed for order in _orders(search) if (placed := search.place(order, False))]
    if not found:
        found = [p for o in _few_orders(search) if (p := search.place(o, True))]
    if not found:
        return None
    best = min(found, key=lambda all_: (max(p.home_s for p in all_), _waited_s(all_)))
    return [placed.waits for placed in sorted(best, key=lambda placed: placed.k)]


def _waited_s(fleet: Sequence[_Placed]) -> int:
    return sum(placed.waits.start_s + placed.waits.hold_s for placed in fleet)


def _orders(search: _Search) -> Iterator[tuple[int, ...]]:
    """Orders of the UAS."""
    if len(search.files) <= _MOST_ORDERED:
        return itertools.permutations(search.files)
    return _few_orders(search)


def _few_orders(search: _Search) -> Iterator[tuple[int, ...]]:
    """As they come, backwards, and by the length of their flights."""
    given = tuple(search.files)
    lengths_s = {u: sum(search.base[k].duration_s for k in ks) for u, ks in search.files.items()}
    by_length = tuple(sorted(given, key=lambda u: lengths_s[u]))
    orders = (given, given[::-1], by_length, by_length[::-1])
    return iter(dict.fromkeys(orders))


class _Search:
    def __init__(
        self,
        scenario: Scenario,
        fleet: Sequence[tuple[int, Fly]],
        slack_s: float,
        pauses_s: Sequence[float],
        *,
        in_hover: bool,
    ) -> None:
        self._scenario, self._fleet, self._slack_s = scenario, fleet, slack_s
        self._pauses_s, self._in_hover = pauses_s, in_hover
        self.base = [fly(Waits()) for _, fly in fleet]
        self.files: dict[int, list[int]] = {}
        for k, (uas, _) in enumerate(fleet):
            self.files.setdefault(uas, []).append(k)
        self._found: dict[tuple[int, int], NDArray[np.intp]] = {}

    def place(self, order: Sequence[int], in_the_air: bool) -> list[_Placed] | None:
        """The fleet in an order, each with the shortest wait; None where one finds none.

        A file is placed when it is the next that may begin; the order settles which of several.
        """
        placed: list[_Placed] = []
        left = {uas: list(self.files[uas]) for uas in order}
        slots = {uas: _Slot(-math.inf, 0.0, len(left[uas]) > 1) for uas in order}
        while left:
            uas = min(left, key=lambda u: slots[u].ready_s)
            k = left[uas].pop(0)
            one = self._at_the_start(k, slots[uas], placed)
            if one is None and in_the_air:
                one = self._in_the_air(k, slots[uas], placed)
            if one is None:
                return None
            placed.append(one)
            if left[uas]:
                ready = ready_s(one.home_s, self._pauses_s[left[uas][0]])
                slots[uas] = _Slot(one.home_s, ready, len(left[uas]) > 1)
            else:
                del left[uas]
        return placed

    def _at_the_start(self, k: int, slot: _Slot, placed: Sequence[_Placed]) -> _Placed | None:
        followed = self.base[k]
        hovers = self._in_hover and math.isinf(slot.since_s)
        sample = round(float(followed.corner_s[0]) / DT_S) if hovers else 0
        start_s = self._shortest(k, followed, sample, slot, placed)
        if start_s is None:
            return None
        return _placed(k, self._fleet[k][0], Waits(start_s), followed, sample, start_s, slot)

    def _in_the_air(self, k: int, slot: _Slot, placed: Sequence[_Placed]) -> _Placed | None:
        uas, fly = self._fleet[k]
        n_legs = len(self.base[k].corner_s) - 1
        legs = range(0, n_legs - 1, math.ceil(max(n_legs - 1, 1) / _MOST_CORNERS))
        found = []
        for leg in legs:
            stopping = fly(Waits(leg=leg))
            sample = round(float(stopping.corner_s[leg + 1]) / DT_S)
            hold_s = self._shortest(k, stopping, sample, slot, placed)
            if hold_s is not None:
                waits = Waits(0, leg, hold_s)
                found.append(_placed(k, uas, waits, stopping, sample, hold_s, slot))
        return min(found, key=lambda one: one.home_s) if found else None

    def _shortest(
        self, k: int, followed: Followed, sample: int, slot: _Slot, placed: Sequence[_Placed]
    ) -> int | None:
        """The shortest wait at a sample that keeps a UAS apart from those placed before it."""
        low, high = [np.empty(0)], [np.empty(0)]
        for other in placed:
            if other.uas == self._fleet[k][0]:
                continue
            if other.leave_s[-1] + self._slack_s + _TOLERANCE_S <= slot.since_s:
                continue  # it had landed before, and flies on in a file of its own
            found = self._encounters(other, k, followed)
            slack_s = self._slack_s + _TOLERANCE_S
            excluded = _excluded(found, other, followed, sample, slot, slack_s)
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


def _placed(
    k: int, uas: int, waits: Waits, followed: Followed, sample: int, wait_s: int, slot: _Slot
) -> _Placed:
    arrive_s, leave_s = slot.ready_s + followed.times_s, slot.ready_s + followed.times_s
    arrive_s[sample + 1 :] += wait_s
    leave_s[sample:] += wait_s
    arrive_s[0] = slot.since_s  # on the ground before and after
    if not slot.again:
        leave_s[-1] = math.inf
    return _Placed(k, uas, waits, followed, arrive_s, leave_s)


def _excluded(
    found: NDArray[np.intp],
    other: _Placed,
    followed: Followed,
    sample: int,
    slot: _Slot,
    slack_s: float,
) -> tuple[FloatArray, FloatArray]:
    """Open intervals of waits at a sample that bring a UAS too close to another one.

    Each is at a place from when it arrives to when it leaves; these times have to be apart.
    """
    n, m = found[:, 0], found[:, 1]
    arrive_s, leave_s = other.arrive_s[n], other.leave_s[n]
    mine_s = slot.ready_s + followed.times_s[m]
    from_s = np.where(m == 0, slot.since_s, mine_s)
    stays = (m == len(followed.times_s) - 1) & (not slot.again)
    until_s = np.where(stays, math.inf, mine_s)
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
