"""The least cost of routes where the state in the middle of each leg has a price.

See docs/bound.md, "From the middle of a leg to the next".
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.bound.legs import (
    LegBounds,
    directed_triples,
    end_costs,
    straight_directions,
    with_middles,
)
from uas_coverage_env.bound.passing import Half, Passages, Passing, at_least, exactly, some
from uas_coverage_env.bound.program import Columns, Cut, Program
from uas_coverage_env.bound.turning import Turning

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

_SEARCH = (2, 7), (4, 8)  # parts of a state whose prices are sought, in so many rounds
_AGAIN = ((4, 5),)  # the same once routes are cut, from the prices without cuts
_SURE = 6  # rounds in which triples that only seemed to matter are looked at
_MORE = 2  # numbers of steps beyond the least that are told apart
_MOST_STEPS = 5  # that are counted without a gap
_VISIT, _MIDDLE = 4, 2  # steps next to either end of a gap, at most
_LIKELY = 5.0  # J: a triple that misses the least reduced cost by more may be left out
_WIDE = 2.0  # steps: a flight that costs so much more than its triple is not looked at closely
_RANGE = 0.06  # steps: what a change of a price in a first round is worth at most
_GROW, _SHRINK = 1.3, 0.75
_UNPAID = 0.03  # share of a part's scale that need not balance for its price to be kept
_NEAR = 45.0  # J: flights that cost more than another of their triple are forgotten
_PARTS = 4  # of a state: position, velocity, tilt and rate


class Carried:
    """Prices, and what triples cost by them.

    Args:
        legs: Of the mission, with the steps to their middles.
        passing: Of the vehicle.
        turning: Of the vehicle.
        reach_m: (n+1,) how far so many steps lead at most.
    """

    def __init__(
        self, legs: LegBounds, passing: Passing, turning: Turning, reach_m: FloatArray
    ) -> None:
        self._legs, self._passing, self._turning = legs, passing, turning
        self._reach_m = reach_m
        self._n, self._n_nodes = legs.before.shape
        self._along = straight_directions(legs)
        way_m = legs.centre_m[None] - legs.centre_m[: self._n, None]
        self._half_m = 0.5 * np.linalg.norm(way_m, axis=2)
        self._ends = end_costs(legs, turning, self._along)
        self._priced = with_middles(legs)
        motion = passing.motion
        self._scale = np.append(0.5 * passing.costs.step_m, motion.largest)
        """Of the parts of a state."""
        self._price: FloatArray = np.zeros((self._n, self._n_nodes, _PARTS, 2))
        """Of the state in the middle of a leg, from waypoint to waypoint, beyond per_m ahead."""
        self._directed = directed_triples(legs, turning, -self._along, self._along)
        """(W, N, N) costs of all triples without these prices."""
        self._plain = np.minimum(self._directed, self._directed.transpose(0, 2, 1))
        self._price_with_cuts: FloatArray | None = None
        """The same where routes are cut, sought for the first cuts that are asked for."""
        self._search, self._sought = _SEARCH, False
        self._known: set[tuple[int, int, int]] = set()
        # triples in the order of flight, by numbers of steps, with what they cost at which prices
        self._triple: IntArray = np.zeros((0, 3), dtype=np.int64)
        self._halves: list[tuple[Half, Half]] = []
        self._cost: FloatArray = np.zeros(0)
        self._at: FloatArray = np.zeros((0, 2, _PARTS, 2))
        # flights: triple in the order of flight, cost without prices, states
        self._flights: IntArray = np.zeros((0, 3), dtype=np.int64)
        self._paid: FloatArray = np.zeros(0)
        self._state: FloatArray = np.zeros((0, 2, _PARTS, 2))

    def least_routes(self, idle: float, cuts: Sequence[Cut]) -> float:
        """A lower bound on the cost of routes that visit every waypoint once.

        Args:
            idle: Cost of a UAS that stays at home.
            cuts: What else is known of the routes.
        """
        if not self._sought:
            self._seek(Program(self._plain, idle, ()), self._search)
            self._sought = True
        program, without_cuts = Program(self._plain, idle, cuts), self._price
        if cuts:
            if self._price_with_cuts is None:
                self._seek(program, _AGAIN)
                self._price_with_cuts = self._price
            self._price = self._price_with_cuts
        best = -math.inf
        for _ in range(_SURE):
            best = max(best, self._solved(program, sure=True))
            if not self._explore(program.likely(_LIKELY)):
                break
        self._price = without_cuts
        return best

    def _seek(self, program: Program, search: Iterable[tuple[int, int]]) -> None:
        """Find prices, from those that there are."""
        best, around = self._solved(program, sure=False), self._price
        for parts, rounds in search:
            width = _RANGE * self._passing.costs.step
            for _ in range(rounds):
                self._explore(program.likely(_LIKELY))
                self._price = self._better_price(program, parts, around, width)
                value = self._solved(program, sure=False)
                if value > best:
                    best, around, width = value, self._price, width * _GROW
                else:
                    width *= _SHRINK
        self._price = around

    def _solved(self, program: Program, sure: bool) -> float:
        program.cost = self._costs(sure)
        return program.solved()

    def _costs(self, sure: bool) -> FloatArray:
        """(W, N, N) what all triples cost at least at the prices.

        Args:
            sure: Also those that have not been looked at, which is left out of the search.
        """
        cost = self._cost_of_flights(sure)
        found = np.full(self._plain.shape, np.inf)
        np.minimum.at(found, tuple(self._triple.T), cost)
        least = self._by_the_table()
        directed = np.where(
            np.isfinite(found), np.maximum(found, least), least if sure else self._directed
        )
        return np.minimum(directed, directed.transpose(0, 2, 1))

    def _by_the_table(self) -> FloatArray:
        """(W, N, N) what triples cost at least by the table, in the order of flight."""
        n, costs, motion = self._n, self._passing.costs, self._passing.motion
        across = np.stack([-self._along[..., 1], self._along[..., 0]], axis=2)
        beyond = np.stack(
            [np.einsum("ijx,ijx->ij", self._price[:, :, 0], way) for way in (self._along, across)]
        )
        sine = np.clip(beyond[1] / costs.per_m, -1.0, 1.0)
        cosine = np.sqrt(1.0 - sine**2)
        out = cosine[..., None] * self._along + sine[..., None] * across
        # what another direction leaves of the prices, and the most that it can be worth
        ahead, aside = np.abs(beyond - costs.per_m * np.stack([cosine - 1.0, sine]))
        potential_m = float(np.abs(motion.potential) @ motion.largest)
        worth = ahead * (costs.step_m + potential_m) + aside * (costs.across_m + potential_m)
        worth += np.linalg.norm(self._price[:, :, 1:], axis=3) @ motion.largest
        into, worth_into = -self._along, np.zeros_like(worth)
        into[:, :n] = out[:, :n].transpose(1, 0, 2)
        worth_into[:, :n] = worth[:, :n].T
        cost = directed_triples(self._legs, self._turning, into, out)
        return cost - worth_into[:, :, None] - worth[:, None]

    def _explore(self, triples: IntArray) -> bool:
        """Look at further triples; whether there are any."""
        new, before = [], len(self._halves)
        for j, *ends in triples.tolist():
            for i, k in (ends, ends[::-1]):
                if (j, i, k) not in self._known and np.isfinite(self._directed[j, i, k]):
                    self._known.add((j, i, k))
                    pairs = [
                        (first, second)
                        for first in self._options(j, i, after=False)
                        for second in self._options(j, k, after=True)
                    ]
                    self._halves += pairs
                    new += [(j, i, k)] * len(pairs)
        more = len(self._halves) - before
        self._triple = np.concatenate([self._triple, np.array(new, dtype=np.int64).reshape(-1, 3)])
        self._cost = np.append(self._cost, np.full(more, -np.inf))
        self._at = np.concatenate([self._at, np.zeros((more, 2, _PARTS, 2))])
        return more > 0

    def _options(self, waypoint: int, node: int, after: bool) -> list[Half]:
        """The numbers of steps of half a leg, all together."""
        counted = self._legs.after if after else self._legs.before
        if not self._priced[waypoint, node]:
            return [some(int(counted[waypoint, node]))]
        way_m = self._half_m[waypoint, node] - self._legs.radius_m[waypoint]
        way_m -= 0.0 if after else self._passing.costs.step_m
        least, found = int(np.searchsorted(self._reach_m, max(way_m, 0.0))), []
        if least + _MORE <= _MOST_STEPS:
            found = [exactly(least + k) for k in range(_MORE + 1)]
            least += _MORE + 1
        return [*found, at_least(_MIDDLE, min(least - _MIDDLE, _VISIT))]

    def _prices_of(self, triple: IntArray, price: FloatArray) -> FloatArray:
        """(M, 2, 4, 2) at both middles, beyond per_m ahead."""
        j, i, k = triple.T
        before = price[np.minimum(i, self._n - 1), j]
        before = np.where((i < self._n)[:, None, None], before, 0.0)
        return np.stack([before, price[j, k]], axis=1)

    def _cost_of_flights(self, sure: bool) -> FloatArray:
        """Lower bounds of all cases; those that may be the least of their triple are new.

        In the search, the others keep what they cost at earlier prices.
        """
        price = self._prices_of(self._triple, self._price)
        other = (price != self._at).any(axis=(1, 2, 3))
        cost = np.where(other & sure, -np.inf, self._cost)
        known = np.full(self._plain.shape, np.inf)
        np.minimum.at(known, tuple(self._flights.T), self._cost_by(self._price))
        enough = self._plain + _WIDE * self._passing.costs.step
        enough = np.minimum(known, enough)[tuple(self._triple.T)]
        groups: dict[tuple[Half, Half], list[int]] = {}
        near = cost < enough + (0.0 if sure else self._passing.costs.step)
        for case in np.flatnonzero(near & (other | np.isinf(cost))).tolist():
            groups.setdefault(self._halves[case], []).append(case)
        for halves, cases in groups.items():
            cost[cases] = self._passed(halves, np.array(cases), price[cases], enough[cases])
        return cost

    def _cost_by(self, price: FloatArray) -> FloatArray:
        """(M,) of the flights that are known."""
        sides = np.einsum("mesa,mesa->me", self._prices_of(self._flights, price), self._state)
        return self._paid + sides[:, 0] - sides[:, 1]

    def _forget(self, around: FloatArray) -> None:
        """Flights that are far from the best of their triple, by both last prices."""
        near = np.zeros(len(self._paid), dtype=bool)
        for price in (around, self._price):
            cost, least = self._cost_by(price), np.full(self._plain.shape, np.inf)
            np.minimum.at(least, tuple(self._flights.T), cost)
            near |= cost <= least[tuple(self._flights.T)] + _NEAR
        self._flights, self._paid = self._flights[near], self._paid[near]
        self._state = self._state[near]

    def _passed(
        self, halves: tuple[Half, Half], cases: IntArray, price: FloatArray, enough: FloatArray
    ) -> FloatArray:
        """Costs of cases with the same numbers of steps; flights that come close are kept."""
        j, i, k = self._triple[cases].T
        along = np.stack([-self._along[j, i], self._along[j, k]], axis=1)
        half_m = np.stack([self._half_m[j, i], self._half_m[j, k]], axis=1)
        straight = self._passing.costs.per_m * along
        ends = self._ends[j, i] + self._ends[j, k]
        whole = price.copy()
        whole[:, :, 0] += straight
        passed = self._passing.least(
            halves, Passages(self._legs.radius_m[j], along, half_m, whole, enough - ends)
        )
        ahead = np.einsum("mea,mea->me", straight, passed.state[:, :, 0])
        paid = passed.paid + ends + ahead[:, 0] - ahead[:, 1]
        good = np.isfinite(paid) & (passed.cost + ends < enough)
        self._flights = np.concatenate([self._flights, self._triple[cases][good]])
        self._paid = np.append(self._paid, paid[good])
        self._state = np.concatenate([self._state, passed.state[good]])
        self._cost[cases], self._at[cases] = passed.cost + ends, price
        return passed.cost + ends

    def _better_price(
        self, program: Program, parts: int, around: FloatArray, width: float
    ) -> FloatArray:
        """The best prices for the flights that are known, not far from others.

        Args:
            program: Of the routes.
            parts: Of the state, so many of which get other prices.
            around: Prices.
            width: What a price may change by, times the scale of its part.
        """
        if not len(self._paid):
            return around
        self._forget(around)
        j, i, k = self._flights.T
        size, scale = 2 * parts, self._scale[:parts, None]
        columns, carried, legs = [], [], []
        for side, sign, a, b in ((0, -1.0, i, j), (1, 1.0, j, k)):
            flight = np.flatnonzero(self._priced[j, i if side == 0 else k])
            legs.append(self._n_nodes * a[flight] + b[flight])
            columns.append(flight)
            carried.append(sign * self._state[flight, side, :parts] / scale)
        used, place = np.unique(np.concatenate(legs), return_inverse=True)
        rows = (size * place[:, None] + np.arange(size)).ravel()
        before, after = np.divmod(used, self._n_nodes)
        triples = np.stack([j, np.minimum(i, k), np.maximum(i, k)], axis=1)
        found = program.prices(
            Columns(
                self._plain,
                triples,
                self._paid,
                (rows, np.repeat(np.concatenate(columns), size), np.concatenate(carried).ravel()),
                (around[before, after, :parts] * scale).ravel(),
                width,
                _UNPAID,
            )
        )
        price = around.copy()
        if found is not None:
            price[before, after, :parts] = found.reshape(-1, parts, 2) / scale
        return price
