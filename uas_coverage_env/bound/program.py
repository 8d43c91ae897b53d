"""The least cost of routes through all waypoints: a linear program over triples of visits.

See docs/bound.md, "From triples to routes". The value that is returned is that of a feasible
solution of the dual program over *all* triples, computed here and not taken from the solver.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linprog
from scipy.sparse import coo_matrix, csr_array, csr_matrix
from scipy.sparse.csgraph import breadth_first_order, connected_components, maximum_flow

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

_NEAREST = 8
_ROUNDS = 40
_ADDED = 8  # triples of a waypoint in a round, at most
_CAPACITY = 100_000  # units of flow of an edge that is fully used
_SLACK = 1e-4
_MOST_CUTS = 20
_ENOUGH = 2e-4  # share of the value by which further triples must promise to lower it


class Cut(NamedTuple):
    """So many routes at least lead into a set of waypoints."""

    inside: NDArray[np.bool_]
    """(W,) the set."""
    routes: int


class Columns(NamedTuple):
    """Flights past a waypoint, and what they carry from leg to leg.

    Attributes:
        plain: (W, N, N) costs of the triples without any.
        triples: (M, 3) of each.
        cost: (M,) without the prices of what it carries.
        carried: Rows below R, columns below M, and how much of it.
        around: (R,) prices of it.
        width: How far from these a price is sought.
        unpaid: A price is kept where no more than so much of it is left over.
    """

    plain: FloatArray
    triples: IntArray
    cost: FloatArray
    carried: tuple[IntArray, IntArray, FloatArray]
    around: FloatArray
    width: float
    unpaid: float


class _Solved(NamedTuple):
    """Value, shares of the triples, prices of the equations, of the cuts, and of the carried."""

    value: float
    share: FloatArray
    duals: FloatArray
    cut_duals: FloatArray
    carried: FloatArray


def least_routes(
    cost: FloatArray, idle: float = 0.0, most: int | None = None, cuts: Sequence[Cut] = ()
) -> float:
    """A lower bound on the cost of routes that visit every waypoint once.

    Args:
        cost: (W, N, N) of a visit by its neighbours, symmetric; infinite where impossible. Nodes
            are W waypoints, U starts and U ends.
        idle: Cost of a UAS that stays at home: what one that flies saves.
        most: So many UAS fly at most; None: all may.
        cuts: What else is known of the routes.
    """
    return Program(cost, idle, cuts, most).solved()


class Program:
    """Column generation over triples, and cuts against routes that do not reach a home."""

    def __init__(
        self, cost: FloatArray, idle: float, cuts: Sequence[Cut], most: int | None = None
    ) -> None:
        self.cost, self._idle = cost, idle
        self._n, self._n_nodes = cost.shape[:2]
        self._uas = (self._n_nodes - self._n) // 2
        self._most = self._uas if most is None else min(most, self._uas)
        possible = np.where(np.isfinite(cost), cost, -np.inf)
        self._penalty = float(np.abs(possible.max(axis=(1, 2))).sum())
        """Of a missing edge of a cut, so that there always is a solution."""
        self._triples = self._first()
        self._cuts = list(cuts)
        rows = np.full((self._n, self._n_nodes), -1)
        upper = np.triu_indices(self._n, 1)
        rows[upper] = self._n + np.arange(len(upper[0]))
        rows[upper[::-1]] = rows[upper]
        ends = 2 * self._uas
        rows[:, self._n :] = self._n + len(upper[0]) + np.arange(ends)
        self._row = rows
        """(W, N) the equation of each edge; those to homes are summed up in one for each."""
        self._n_rows = self._n + len(upper[0]) + ends

    def solved(self) -> float:
        """The best bound; more rounds only improve it."""
        best, self._reduced = self._bound(np.zeros(self._n_rows), np.zeros(len(self._cuts)))
        for _ in range(_ROUNDS):
            solved = self._solve(self._triples, self.cost[tuple(self._triples.T)])
            if solved is None:
                break
            value, share, duals, cut_duals, _ = solved
            bound, reduced = self._bound(duals, cut_duals)
            if bound > best:
                best, self._reduced = bound, reduced
            cuts = self._violated(share)
            added = self._add(reduced) if value - bound > _ENOUGH * abs(value) else False
            if not cuts and not added:
                break
            self._cuts += cuts
        return best

    def likely(self, most: float) -> IntArray:
        """(M, 3) the triples that miss the least reduced cost of their waypoint by no more."""
        reduced = self._reduced
        upper = np.triu(np.ones(reduced.shape[1:], dtype=bool))
        least = reduced.min(axis=(1, 2), keepdims=True)
        return np.argwhere((reduced < least + most) & upper)

    def prices(self, further: Columns) -> FloatArray | None:
        """(R,) best prices of what the further columns carry; None: they do not suffice.

        Args:
            further: Stand in for all columns of their triples.
        """
        known = np.zeros(self.cost.shape, dtype=bool)
        known[tuple(further.triples.T)] = True
        plain = self._triples[~known[tuple(self._triples.T)]]
        solved = self._solve(
            np.concatenate([plain, further.triples]),
            np.concatenate([further.plain[tuple(plain.T)], further.cost]),
            further,
        )
        return None if solved is None else solved.carried

    def _first(self) -> IntArray:
        """Triples of the cheapest neighbours of each waypoint, and of the homes."""
        found = []
        homes = np.arange(self._n, self._n_nodes)
        for waypoint, cost in enumerate(self.cost):
            cheapest = np.argsort(cost[: self._n, : self._n].min(axis=1))[:_NEAREST]
            near = np.concatenate([cheapest[cheapest != waypoint], homes])
            a, b = (near[k] for k in np.triu_indices(len(near)))
            possible = np.isfinite(cost[a, b])
            a, b = np.minimum(a, b)[possible], np.maximum(a, b)[possible]
            found.append(np.stack([np.full(len(a), waypoint), a, b], axis=1))
        return np.unique(np.concatenate(found), axis=0)

    def _signs(self, waypoint: IntArray, neighbour: IntArray) -> IntArray:
        """Of an edge in its equation: its two ends see it with opposite signs."""
        return np.where(waypoint < neighbour, 1, -1)

    def _solve(
        self, triples: IntArray, costs: FloatArray, further: Columns | None = None
    ) -> _Solved | None:
        """A solution with some triples only; None: they do not suffice."""
        waypoint, *neighbours = triples.T
        columns = np.arange(len(waypoint))
        entries: list[tuple[IntArray, IntArray, FloatArray]]
        entries = [(waypoint, columns, np.ones(len(waypoint)))]
        for neighbour in neighbours:
            signs = self._signs(waypoint, neighbour).astype(np.float64)
            entries.append((self._row[waypoint, neighbour], columns, signs))
        used = len(columns) + np.arange(self._uas)
        homes = self._n_rows - 2 * self._uas + np.arange(2 * self._uas)
        entries.append((homes, np.tile(used, 2), -np.ones(2 * self._uas)))
        n_basic = len(columns) + self._uas + len(self._cuts)
        cost = np.append(costs, np.full(self._uas, -self._idle))
        cost = np.append(cost, np.full(len(self._cuts), self._penalty))
        n_rows = self._n_rows
        if further is not None:
            row, column, carried = further.carried
            entries.append((n_rows + row, len(triples) - len(further.cost) + column, carried))
            n_carried = len(further.around)
            slack = np.arange(4 * n_carried)
            sign = np.where(slack // n_carried % 2, -1.0, 1.0)
            entries.append((n_rows + slack % n_carried, n_basic + slack, sign))
            away = np.where(slack < 2 * n_carried, further.width, 0.0)
            cost = np.append(cost, sign * np.tile(further.around, 4) + away)
            n_rows += n_carried
        row, column, value = (np.concatenate(parts) for parts in zip(*entries, strict=True))
        equations = coo_matrix((value, (row, column)), (n_rows, len(cost))).tocsr()
        right = np.zeros(n_rows)
        right[: self._n] = 1.0
        kept = np.flatnonzero(np.diff(equations.indptr))
        bounds = np.zeros((len(cost), 2))
        bounds[:, 1] = 1.0
        bounds[n_basic - len(self._cuts) :, 1] = np.inf
        if further is not None:
            bounds[n_basic + 2 * len(further.around) :, 1] = further.unpaid
        found = linprog(  # pyrefly: ignore[no-matching-overload] # of sparse matrices
            cost,
            A_ub=self._inequalities(triples, len(cost)),
            b_ub=[self._most, *(-2.0 * cut.routes for cut in self._cuts)],
            A_eq=equations[kept],
            b_eq=right[kept],
            bounds=bounds,
            method="highs" if further is None else "highs-ipm",  # three times as fast for many
        )
        if not found.success:
            return None
        duals = np.zeros(n_rows)
        duals[kept] = found.eqlin.marginals
        cut_duals = np.maximum(-found.ineqlin.marginals[1:], 0.0)
        share = found.x[: len(columns)]
        equal, carried = duals[: self._n_rows], duals[self._n_rows :]
        return _Solved(float(found.fun), share, equal, cut_duals, carried)

    def _inequalities(self, triples: IntArray, n_columns: int) -> csr_matrix:
        """UAS that fly; then, negative, the edges that leave each set, by their ends within it."""
        waypoint, a, b = triples.T
        n = len(waypoint) + self._uas
        rows = np.zeros((1 + len(self._cuts), n_columns))
        rows[0, len(waypoint) : n] = 1.0
        rows[1:, n : n + len(self._cuts)] = -np.eye(len(self._cuts))  # at a penalty
        for row, cut in zip(rows[1:], self._cuts, strict=True):
            inside = self._nodes(cut)
            leave = (~inside[a]).astype(float) + ~inside[b]
            row[: len(waypoint)] = -np.where(inside[waypoint], leave, 0.0)
        return csr_matrix(rows)

    def _nodes(self, cut: Cut) -> NDArray[np.bool_]:
        """(N,) the set among all nodes."""
        return np.append(cut.inside, np.zeros(self._n_nodes - self._n, dtype=bool))

    def _bound(self, duals: FloatArray, cut_duals: FloatArray) -> tuple[float, FloatArray]:
        """The value of a feasible dual solution, and (W, N, N) reduced costs of all triples.

        Whatever the prices: each waypoint has shares of triples that sum up to one, hence costs
        at least the least of its reduced costs.
        """
        reduced = self.cost.copy()
        edge = np.zeros((self._n, self._n_nodes))
        waypoint, neighbour = np.indices(edge.shape)
        edge = self._signs(waypoint, neighbour) * np.where(self._row >= 0, duals[self._row], 0.0)
        for cut, dual in zip(self._cuts, cut_duals, strict=True):
            edge[np.ix_(cut.inside, ~self._nodes(cut))] += dual
        reduced -= edge[:, :, None] + edge[:, None]
        least = reduced.min(axis=(1, 2))
        homes = duals[self._n_rows - 2 * self._uas :].reshape(2, self._uas).sum(axis=0)
        used = np.sort(np.minimum(homes - self._idle, 0.0))[: self._most].sum()
        routes = np.array([cut.routes for cut in self._cuts], float)
        value = least.sum() + used + 2.0 * (cut_duals @ routes)
        return float(value), reduced - duals[: self._n, None, None]

    def _add(self, reduced: FloatArray) -> bool:
        """Take in the triples that promise most; whether there are any."""
        found = []
        upper = np.triu(np.ones(reduced.shape[1:], dtype=bool))
        for waypoint, costs in enumerate(reduced):
            costs = np.where(upper, costs, np.inf)
            likely = np.argpartition(costs, _ADDED, axis=None)[:_ADDED]
            a, b = np.unravel_index(likely, costs.shape)
            good = costs[a, b] < -1e-7
            found.append(np.stack([np.full(good.sum(), waypoint), a[good], b[good]], axis=1))
        before = len(self._triples)
        self._triples = np.unique(np.concatenate([self._triples, *found]), axis=0)
        return len(self._triples) > before

    def _violated(self, share: FloatArray) -> list[Cut]:
        """Sets of waypoints with too few edges to the rest."""
        home = self._n
        waypoint, *neighbours = self._triples.T
        used = np.zeros((home + 1, home + 1))
        for neighbour in neighbours:
            at = np.minimum(neighbour, home)
            inner = at < home
            np.add.at(used, (waypoint, at), np.where(inner, 0.5 * share, share))
        used += used.T
        flow = csr_array(np.round(_CAPACITY * used).astype(np.int32))
        found, seen = [], np.zeros(home, dtype=bool)
        groups = connected_components(flow, directed=False)[1]
        for group in np.unique(groups[:home]):
            if group != groups[home]:
                found.append(groups[:home] == group)
                seen |= found[-1]
        for source in range(home):
            if seen[source] or len(found) >= _MOST_CUTS:
                continue
            result = maximum_flow(flow, source, home)
            if result.flow_value < 2.0 * _CAPACITY * (1.0 - _SLACK):
                rest = csr_array(flow - result.flow)
                rest.data = np.maximum(rest.data, 0)
                rest.eliminate_zeros()
                inside = np.zeros(home + 1, dtype=bool)
                inside[_reached(rest, source)] = True
                found.append(inside[:home])
                seen |= inside[:home]
        known = {cut.inside.tobytes() for cut in self._cuts}
        return [Cut(inside, 1) for inside in found if inside.tobytes() not in known]


def _reached(graph: csr_array, source: int) -> NDArray[np.int32]:
    return breadth_first_order(graph, source, return_predecessors=False)
