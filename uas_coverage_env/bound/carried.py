"""The least cost of routes where what a flight carries from one turn to the next has a price.

See docs/bound.md, "Prices for what is carried".
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_matrix, csr_matrix

from uas_coverage_env.bound.legs import Legs, end_costs, straight_directions
from uas_coverage_env.bound.passing import Half, Passages, Passing, at_least, exactly, some
from uas_coverage_env.bound.program import Program

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
BoolArray = NDArray[np.bool_]

ROUNDS = 12
_MORE = 2  # numbers of steps beyond the least that are told apart
_LONGEST = 4  # steps next to a visit
_NEXT_TO_MIDDLE = 2
_LIKELY = 1.5  # share of the cost of a step that a triple may cost too much


class _Leg(NamedTuple):
    """A way between two nodes."""

    half_m: float
    options: tuple[Half, ...]


class Carried:
    """Prices of velocity, tilt and rate at the middle of legs, and what triples cost by them.

    Args:
        legs: Of the mission.
        passing: Of the vehicle.
        cost: (W, N, N) of all triples without these prices.
        reach_m: (n+1,) how far so many steps lead at most.
        from_home: (W, N) further cost of a leg that comes from there or leads there.
    """

    def __init__(self, legs, passing, cost, reach_m, turning) -> None:
        self._legs, self._passing = legs, passing
        self.base = cost
        n, nodes = legs.before.shape
        self._n, self._nodes = n, nodes
        self._along = straight_directions(legs)
        self._half_m = 0.5 * np.linalg.norm(legs.centre_m[None] - legs.centre_m[:n, None], axis=2)
        self._extra = end_costs(legs, turning, self._along)
        self._reach_m = reach_m
        radius = legs.radius_m
        self._cut = np.zeros((n, nodes), bool)
        d = self._half_m[:, :n]
        self._cut[:, :n] = (d > radius[:n, None]) & (d > radius[None, :n])
        self._largest = passing.motion.largest
        self.price = np.zeros((n, n, 3, 2))  # on the way from i to j
        self._z: dict[int, FloatArray] = {}
        self._known: dict[tuple[int, int, int], int] = {}
        self._triple = np.zeros((0, 3), int)  # directed
        self._case = np.zeros((0,), int)
        self._halves: list[tuple[Half, Half]] = []
        self._value = np.zeros(0)
        self._at = np.zeros((0, 2, 3, 2))

    def options(self, at: int, node: int, after: bool) -> tuple[Half, ...]:
        steps = int((self._legs.after if after else self._legs.before)[at, node])
        if not self._cut[at, node]:
            return (some(steps),)
        way = self._half_m[at, node] - self._legs.radius_m[at]
        if not after:
            way -= self._passing.costs.step_m
        least = int(np.searchsorted(self._reach_m, max(way, 0.0)))
        if after:
            least = max(least, 1)
        found = []
        if least + _MORE <= 5:
            found = [exactly(least + k) for k in range(_MORE + 1)]
            least += _MORE + 1
        middle = min(_NEXT_TO_MIDDLE, max(least - 1, 1))
        if least < 2:
            return (*found, some(0))
        return (*found, at_least(middle, min(least - middle, _LONGEST)))

    def explore(self, triples: IntArray) -> None:
        """Take in triples (undirected: waypoint, node, node)."""
        new = []
        for j, a, b in triples.tolist():
            for i, k in ((a, b), (b, a)):
                if (j, i, k) in self._known or not self._flies(i, k):
                    continue
                self._known[j, i, k] = 1
                for first in self.options(j, i, False):
                    for second in self.options(j, k, True):
                        new.append((j, i, k))
                        self._halves.append((first, second))
        if new:
            self._triple = np.concatenate([self._triple, np.array(new)])
            more = len(new)
            self._value = np.append(self._value, np.full(more, -np.inf))
            self._at = np.concatenate([self._at, np.zeros((more, 2, 3, 2))])

    def _flies(self, i: int, k: int) -> bool:
        uas = (self._nodes - self._n) // 2
        return i < self._n + uas and (k < self._n or k >= self._n + uas)

    def _prices(self, triple: IntArray) -> FloatArray:
        j, i, k = triple.T
        price = np.zeros((len(triple), 2, 3, 2))
        inner = i < self._n
        price[inner, 0] = self.price[i[inner], j[inner]]
        inner = k < self._n
        price[inner, 1] = self.price[j[inner], k[inner]]
        return price

    def _support(self, price: FloatArray) -> FloatArray:
        return np.linalg.norm(price, axis=-1) @ self._largest

    def evaluate(self, flights, certify=True) -> FloatArray:
        """(W, N, N) lower bounds of all triples at the prices."""
        price = self._prices(self._triple)
        changed = self._support(price - self._at).sum(axis=1)
        lower = self._value - changed
        keys = self._triple @ np.array([self._nodes**2, self._nodes, 1])
        upper: dict[int, float] = flights.upper(price_of=self.price)
        most = np.array([upper.get(key, np.inf) for key in keys.tolist()])
        todo = np.flatnonzero((lower < most + 0.0) & (changed > 1e-9) | ~np.isfinite(self._value))
        groups: dict[tuple[Half, Half], list[int]] = {}
        for case in todo.tolist():
            groups.setdefault(self._halves[case], []).append(case)
        for halves, cases in groups.items():
            warm = [case for case in cases if case in self._z]
            for cases in (warm, [case for case in cases if case not in self._z]):
                if not cases:
                    continue
                rows = np.array(cases)
                begin = np.array([self._z[case] for case in cases]) if cases is warm else None
                j, i, k = self._triple[rows].T
                plain = self.base[j, i, k]
                enough = np.minimum(plain + 2.0 * self._passing.costs.step, most[rows] + 20.0)
                along = np.stack([-self._along[j, i], self._along[j, k]], axis=1)
                per_m = self._passing.costs.per_m
                passed = self._passing.least(
                    halves,
                    Passages(
                        self._legs.radius_m[j],
                        along,
                        np.stack([self._half_m[j, i], self._half_m[j, k]], axis=1),
                        per_m * along,
                        price[rows],
                        enough,
                    ),
                    begin,
                )
                for row, z in zip(rows.tolist(), passed.z):
                    self._z[row] = z
                extra = self._extra[j, i] + self._extra[j, k]
                self._value[rows] = passed.cost + extra
                self._at[rows] = price[rows]
                lower[rows] = self._value[rows]
                raw = (
                    passed.paid
                    + extra
                    + per_m
                    * (
                        np.einsum("na,na->n", along[:, 0], passed.place_m[:, 0])
                        - np.einsum("na,na->n", along[:, 1], passed.place_m[:, 1])
                    )
                )
                good = np.isfinite(raw) & (passed.cost + extra < enough)
                flights.add(self._triple[rows][good], raw[good], passed.state[good])
        self.evaluated = len(todo)
        # all triples: what they cost without prices, less what these may be worth
        n, nodes = self._n, self._nodes
        worth = np.zeros((n, nodes))
        into = self._support(self.price)  # (i, j)
        cost = np.full((n, nodes, nodes), np.inf)
        before = np.zeros((n, nodes))
        before[:, :n] = into.T
        after = np.zeros((n, nodes))
        after[:, :n] = into
        sure = self.base - before[:, :, None] - after[:, None, :]
        directed = sure if certify else self.base.copy()
        j, i, k = self._triple.T
        if len(j):
            found = np.full((n, nodes, nodes), np.inf)
            np.minimum.at(found, (j, i, k), lower)
            directed = np.where(np.isfinite(found), np.maximum(found, sure), directed)
        uas = (nodes - n) // 2
        flies = np.zeros((nodes, nodes), bool)
        flies[: n + uas] = True
        flies[:, n : n + uas] = False
        directed = np.where(flies, directed, np.inf)
        return np.minimum(directed, directed.transpose(0, 2, 1))


class Flights:
    """Flights past waypoints: columns of the program."""

    def __init__(self, nodes: int, waypoints: int) -> None:
        self._nodes, self._n = nodes, waypoints
        self.triple = np.zeros((0, 3), int)
        self.raw = np.zeros(0)
        self.state = np.zeros((0, 2, 3, 2))

    def add(self, triple, raw, state) -> None:
        self.triple = np.concatenate([self.triple, triple])
        self.raw = np.append(self.raw, raw)
        self.state = np.concatenate([self.state, state])

    def values(self, price_of) -> FloatArray:
        j, i, k = self.triple.T
        value = self.raw.copy()
        inner = i < self._n
        value[inner] += (price_of[i[inner], j[inner]] * self.state[inner, 0]).sum(axis=(1, 2))
        inner = k < self._n
        value[inner] -= (price_of[j[inner], k[inner]] * self.state[inner, 1]).sum(axis=(1, 2))
        return value

    def upper(self, price_of) -> dict[int, float]:
        if not len(self.raw):
            return {}
        value = self.values(price_of)
        keys = self.triple @ np.array([self._nodes**2, self._nodes, 1])
        found: dict[int, float] = {}
        for key, one in zip(keys.tolist(), value.tolist(), strict=True):
            found[key] = min(one, found.get(key, np.inf))
        return found


def priced_routes(carried: Carried, idle: float, cuts, rounds=ROUNDS, show=None) -> float:
    flights = Flights(carried._nodes, carried._n)
    scale = carried._passing.costs.step / carried._largest  # price that is worth a step
    box = 0.1
    best, centre = -np.inf, carried.price.copy()
    program = Program(carried.base, idle, None, cuts)
    import os
    mask = np.array(eval(os.environ.get("MASK", "[1,0,0]")))[:, None]
    scale = scale[:, None] * mask
    box = float(os.environ.get("BOX", "0.3"))
    price = carried.price
    for r in range(rounds):
        carried.price = price
        certify = r >= rounds - 4
        if certify:
            carried.price = centre
            if r == rounds - 4: best = -np.inf
        cost = carried.evaluate(flights, certify)
        program.set_cost(cost)
        value = program.solved()
        _, reduced = program._bound(*program.duals)
        reduced = reduced - reduced.min(axis=(1, 2), keepdims=True)
        used = program.likely(reduced, 5.0)
        if value > best or r == 1:
            best, centre = value, carried.price.copy()
            box *= 1.2
        else:
            box *= 0.6
        before = len(carried._known)
        carried.explore(used)
        if show:
            show(r, value, best, carried.evaluated, len(carried._known) - before, box, len(flights.raw))
        if not certify:
            price = program.better_prices(flights, carried, centre, (box * scale)[:, 0])
            print('   model', getattr(program, 'model', 0) / 3600)
    return best
