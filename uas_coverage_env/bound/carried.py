"""The least cost of routes where the velocity in the middle of each leg has a price.

See docs/bound.md, "From the middle of a leg to the next".
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.bound.legs import Legs, end_costs, straight_directions, with_middles
from uas_coverage_env.bound.passing import Half, Passages, Passing, at_least, exactly, some
from uas_coverage_env.bound.program import Columns, Cut, Program
from uas_coverage_env.bound.turning import Turning

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

_ROUNDS = 14  # in which prices are sought
_SURE = 6  # rounds in which triples that only seemed to matter are looked at
_MORE = 2  # numbers of steps beyond the least that are told apart
_MOST_STEPS = 5  # that are counted without a gap
_VISIT, _MIDDLE = 4, 2  # steps next to either end of a gap, at most
_LIKELY = 5.0  # J: a triple that misses the least reduced cost by more may be left out
_WIDE = 2.0  # steps: a flight that costs so much more than its triple is not looked at closely
_RANGE = 0.1  # of a price in the first round, over that at which full speed is worth a step
_GROW, _SHRINK = 1.2, 0.6


class Carried:
    """Prices, and what triples cost by them.

    Args:
        legs: Of the mission, with the steps to their middles.
        passing: Of the vehicle.
        turning: Of the vehicle.
        plain: (W, N, N) costs of all triples without these prices.
        reach_m: (n+1,) how far so many steps lead at most.
    """

    def __init__(
        self, legs: Legs, passing: Passing, turning: Turning, plain: FloatArray, reach_m: FloatArray
    ) -> None:
        self._legs, self._passing, self._plain, self._reach_m = legs, passing, plain, reach_m
        self._n, self._n_nodes = legs.before.shape
        self._along = straight_directions(legs)
        way_m = legs.centre_m[None] - legs.centre_m[: self._n, None]
        self._half_m = 0.5 * np.linalg.norm(way_m, axis=2)
        self._ends = end_costs(legs, turning, self._along)
        self._priced = with_middles(legs)
        self._price: FloatArray = np.zeros((self._n, self._n_nodes, 2))
        """Of a m/s in the middle of a leg, from waypoint to waypoint."""
        self._sought = False
        self._known: set[tuple[int, int, int]] = set()
        # triples in the order of flight, by numbers of steps, with what they cost at which prices
        self._triple: IntArray = np.zeros((0, 3), dtype=np.int64)
        self._halves: list[tuple[Half, Half]] = []
        self._cost: FloatArray = np.zeros(0)
        self._at: FloatArray = np.zeros((0, 2, 2))
        self._flown: dict[int, FloatArray] = {}
        # flights: triple in the order of flight, cost without prices, velocities
        self._flights: IntArray = np.zeros((0, 3), dtype=np.int64)
        self._paid: FloatArray = np.zeros(0)
        self._velocity: FloatArray = np.zeros((0, 2, 2))

    def least_routes(self, idle: float, cuts: Sequence[Cut]) -> float:
        """A lower bound on the cost of routes that visit every waypoint once.

        Args:
            idle: Cost of a UAS that stays at home.
            cuts: What else is known of the routes.
        """
        if not self._sought:
            self._seek(Program(self._plain, idle, ()))
            self._sought = True
        program, best = Program(self._plain, idle, cuts), -math.inf
        for _ in range(_SURE):
            best = max(best, self._solved(program, sure=True))
            if not self._explore(program.likely(_LIKELY)):
                break
        return best

    def _seek(self, program: Program) -> None:
        """Find prices."""
        best, around = -math.inf, self._price
        width = _RANGE * self._passing.costs.step / self._passing.motion.largest[0]
        for _ in range(_ROUNDS):
            value = self._solved(program, sure=False)
            if value > best:
                best, around, width = value, self._price, width * _GROW
            else:
                width *= _SHRINK
            self._explore(program.likely(_LIKELY))
            self._price = self._better_price(program, around, width)
        self._price = around

    def _solved(self, program: Program, sure: bool) -> float:
        program.cost = self._costs(sure)
        return program.solved()

    def _costs(self, sure: bool) -> FloatArray:
        """(W, N, N) what all triples cost at least at the prices.

        Args:
            sure: Also those that have not been looked at, which is left out of the search.
        """
        cost = self._cost_of_flights()
        worth = np.linalg.norm(self._price, axis=2) * self._passing.motion.largest[0]
        into = np.zeros_like(worth)
        into[:, : self._n] = worth[:, : self._n].T
        least = self._plain - into[:, :, None] - worth[:, None]
        found = np.full_like(least, np.inf)
        np.minimum.at(found, tuple(self._triple.T), cost)
        directed = np.where(
            np.isfinite(found), np.maximum(found, least), least if sure else self._plain
        )
        directed = np.where(self._flown_so(), directed, np.inf)
        return np.minimum(directed, directed.transpose(0, 2, 1))

    def _flown_so(self) -> NDArray[np.bool_]:
        """(N, N) whether a node may come before another: no start is flown to, no end left."""
        uas = (self._n_nodes - self._n) // 2
        node = np.arange(self._n_nodes)
        before, after = node < self._n + uas, (node < self._n) | (node >= self._n + uas)
        return before[:, None] & after

    def _explore(self, triples: IntArray) -> bool:
        """Look at further triples; whether there are any."""
        flown_so, new, before = self._flown_so(), [], len(self._halves)
        for j, *ends in triples.tolist():
            for i, k in (ends, ends[::-1]):
                if (j, i, k) not in self._known and flown_so[i, k]:
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
        self._at = np.concatenate([self._at, np.zeros((more, 2, 2))])
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

    def _prices_of(self, triple: IntArray) -> FloatArray:
        """(M, 2, 2) at both middles."""
        j, i, k = triple.T
        before = np.where((i < self._n)[:, None], self._price[np.minimum(i, self._n - 1), j], 0.0)
        return np.stack([before, self._price[j, k]], axis=1)

    def _cost_of_flights(self) -> FloatArray:
        """Lower bounds of all cases; those that may be the least of their triple are new."""
        price = self._prices_of(self._triple)
        change = np.linalg.norm(price - self._at, axis=2).sum(axis=1)
        cost = self._cost - change * self._passing.motion.largest[0]
        known = np.full(self._plain.shape, np.inf)
        sides = np.einsum("mea,mea->me", self._prices_of(self._flights), self._velocity)
        np.minimum.at(known, tuple(self._flights.T), self._paid + sides[:, 0] - sides[:, 1])
        enough = self._plain + _WIDE * self._passing.costs.step
        enough = np.minimum(known, enough)[tuple(self._triple.T)]
        groups: dict[tuple[tuple[Half, Half], bool], list[int]] = {}
        for case in np.flatnonzero((cost < enough) & ((change > 0.0) | np.isinf(cost))).tolist():
            groups.setdefault((self._halves[case], case in self._flown), []).append(case)
        for (halves, again), cases in groups.items():
            cost[cases] = self._passed(halves, np.array(cases), price[cases], enough[cases], again)
        return cost

    def _passed(
        self,
        halves: tuple[Half, Half],
        cases: IntArray,
        price: FloatArray,
        enough: FloatArray,
        again: bool,
    ) -> FloatArray:
        """Costs of cases with the same numbers of steps; flights that come close are kept."""
        j, i, k = self._triple[cases].T
        along = np.stack([-self._along[j, i], self._along[j, k]], axis=1)
        half_m = np.stack([self._half_m[j, i], self._half_m[j, k]], axis=1)
        per_m = self._passing.costs.per_m
        ends = self._ends[j, i] + self._ends[j, k]
        passages = Passages(
            self._legs.radius_m[j], along, half_m, per_m * along, price, enough - ends
        )
        begin = np.array([self._flown[case] for case in cases.tolist()]) if again else None
        passed = self._passing.least(halves, passages, begin)
        self._flown.update(zip(cases.tolist(), passed.z, strict=True))
        ahead_m = np.einsum("mea,mea->me", along, passed.place_m)
        paid = passed.paid + ends + per_m * (ahead_m[:, 0] - ahead_m[:, 1])
        good = np.isfinite(paid) & (passed.cost + ends < enough)
        self._flights = np.concatenate([self._flights, self._triple[cases][good]])
        self._paid = np.append(self._paid, paid[good])
        self._velocity = np.concatenate([self._velocity, passed.velocity_mps[good]])
        self._cost[cases], self._at[cases] = passed.cost + ends, price
        return passed.cost + ends

    def _better_price(self, program: Program, around: FloatArray, width: float) -> FloatArray:
        """The best prices for the flights that are known, not far from others."""
        if not len(self._paid):
            return around
        j, i, k = self._flights.T
        rows, columns, carried, legs = [], [], [], []
        for side, sign, a, b in ((0, -1.0, i, j), (1, 1.0, j, k)):
            flight = np.flatnonzero(self._priced[j, i if side == 0 else k])
            legs.append(self._n_nodes * a[flight] + b[flight])
            columns.append(flight)
            carried.append(sign * self._velocity[flight, side])
        used, place = np.unique(np.concatenate(legs), return_inverse=True)
        rows = (2 * place[:, None] + np.arange(2)).ravel()
        at = np.divmod(used, self._n_nodes)
        middle = around[at].ravel()
        triples = np.stack([j, np.minimum(i, k), np.maximum(i, k)], axis=1)
        found = program.prices(
            Columns(
                self._plain,
                triples,
                self._paid,
                (rows, np.repeat(np.concatenate(columns), 2), np.concatenate(carried).ravel()),
                middle - width,
                middle + width,
            )
        )
        price = around.copy()
        if found is not None:
            price[at] = found.reshape(-1, 2)
        return price
