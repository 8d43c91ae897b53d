"""What flights that no solver made cost, and whether they may be flown: by the blocks themselves.

A plan of a program has its objective from the solver. Plans that need no solver (`fallback.plans`),
and trajectories constructed to begin with (`search.heuristic`), get theirs from the same blocks, in
one of three ways:

- a block with `cost_along` knows its part of the objective in closed form;
- the rows of some blocks hold for every flight of the vehicle's model, or are measured against
  the geometry (`verify`): `_MEASURED`. Coverage is counted for the team, see
  `search.trajectories.teams`;
- of any other block the rows are written, the flight is put in, and what columns of its own are
  left are chosen at best: their cost is the block's price of the flight. A row that no choice
  satisfies says that the flight must not be flown.

So a block that is added to the OCP needs nothing but its rows.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, TypeGuard

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from uas_coverage_baselines.milp_mpc.model.blocks import (
    Capabilities,
    Collision,
    CornerCutting,
    Coverage,
    Dynamics,
    InsideGeofence,
    MinHeight,
    MovingObstacles,
    Obstacles,
)
from uas_coverage_baselines.milp_mpc.model.milp import BuiltMilp, MissingColumnsError
from uas_coverage_baselines.milp_mpc.model.ocp import OCP, Block, Priced, formulate
from uas_coverage_baselines.milp_mpc.model.problem import NEVER, Plan, PlanningProblem, Trajectories
from uas_coverage_baselines.milp_mpc.model.reductions.bounds import rows_as_bounds
from uas_coverage_baselines.milp_mpc.model.verify import first_trouble
from uas_coverage_baselines.milp_mpc.solvers import SolverLimits
from uas_coverage_baselines.milp_mpc.solvers.highs import solve
from uas_coverage_baselines.milp_mpc.solvers.interface import SolverError

FloatArray = NDArray[np.float64]
_MEASURED = frozenset(
    (
        *(Dynamics, Capabilities, Collision, InsideGeofence, Obstacles, MovingObstacles),
        *(CornerCutting, Coverage, MinHeight),
    )
)
_TOLERANCE = 1e-4  # of a row, as of a distance when plans are verified
_ROUNDING = 1e-6  # by which a row is widened where columns of its own are chosen
_EXACTLY = SolverLimits(nodes=1000, relative_gap=1e-6, absolute_gap=1e-6)
_IMPOSSIBLE = 1e3  # how far rows count as broken whose own columns cannot be chosen


@dataclass(frozen=True)
class Price:
    """What blocks say of one flight.

    Attributes:
        cost: their part of the objective.
        excess: by how much rows are broken, summed.
        worst: name of the row that is broken most; empty where none is by more than rounding.
    """

    cost: float
    excess: float = 0.0
    worst: str = ""


class Appraisal:
    """What flights of one problem cost, and what is wrong with them.

    Args:
        problem: the decision.
        blocks: of the OCP.
    """

    def __init__(self, problem: PlanningProblem, blocks: Sequence[Block] = OCP) -> None:
        self._problem = problem
        self._closed = tuple(block for block in blocks if _prices_itself(block))
        self._by_rows = _by_rows(blocks)

    def costs(self, uas: int, flights: Trajectories) -> FloatArray:
        """(S,) what flights of one UAS cost in closed form, coverage left aside."""
        cost = np.zeros(len(flights.positions_m))
        for block in self._closed:
            cost = cost + block.cost_along(self._problem, uas, flights)
        return cost

    def price(self, x: FloatArray, u: FloatArray | None, covers: NDArray[np.bool_]) -> Price:
        """What the other blocks say of one flight of all UAS, by their rows.

        Args:
            x: (U, N+1, 14) states, NaN where they are not known: rows with such are left out.
            u: (U, N, 5) inputs; None where they are not known.
            covers: (U, N, W) where a waypoint of the problem is covered.
        """
        return self._rows.price(x, u, covers) if self._by_rows else Price(0.0)

    def price_of(self, plan: Plan) -> Price:
        """The same of a plan."""
        return self.price(plan.x, plan.u, plan.covers[:, :, self._problem.waypoint_index])

    def prices_of_paths(
        self, uas: int, flights: Sequence[tuple[FloatArray, NDArray[np.int64]]]
    ) -> list[Price]:
        """The same of one UAS's paths (N+1, 3) with their visits (W,), of which no more is known.

        Returns:
            A `Price` for each.
        """
        if not self._by_rows:
            return [Price(0.0)] * len(flights)
        steps = np.arange(self._problem.horizon)[None, :, None]
        alone = Appraisal(self._problem.only(uas), self._by_rows)
        result = []
        for path, visit in flights:
            x = np.full((1, len(path), self._problem.x0.shape[1]), np.nan)
            x[0, :, :3] = path
            result.append(alone.price(x, None, steps == visit[None, None]))
        return result

    def objective(self, plan: Plan) -> float:
        """The objective of a plan of one UAS alone, what its visits gain included."""
        visit = visits(self._problem, plan)
        flights = Trajectories(plan.x[:, :, :3], visit, plan.x, plan.u)
        cost = float(self.costs(0, flights)[0]) + self.price_of(plan).cost
        return cost - float(gains(self._problem, visit[0]).sum())

    def trouble(self, plan: Plan) -> str | None:
        """Why a plan must not be flown, None where nothing is wrong: geometry, then rows."""
        return first_trouble(self._problem, plan) or self.broken(plan)

    def broken(self, plan: Plan) -> str | None:
        """The row that the plan breaks most, None where all hold."""
        if not self._by_rows:
            return None
        own = [plan.of(name) for name in self._problem.names]
        price = self.price_of(replace(plan, x=plan.x[own], u=plan.u[own], covers=plan.covers[own]))
        return f"{price.worst} is broken" if price.worst else None

    @cached_property
    def _rows(self) -> BlockRows:
        return BlockRows(self._problem, self._by_rows)


def trouble(problem: PlanningProblem, plan: Plan, blocks: Sequence[Block]) -> str | None:
    """Why a plan of any length must not be flown, None where nothing is wrong.

    Args:
        problem: the decision, its moving obstacles known for as long as the plan lasts.
        plan: of all its UAS.
        blocks: of the OCP.
    """
    geometry = first_trouble(problem, plan)
    if geometry is not None or not _by_rows(blocks):
        return geometry
    steps = plan.u.shape[1]
    moving = tuple(replace(one, position_m=one.position_m[: steps + 1]) for one in problem.moving)
    return Appraisal(replace(problem, horizon=steps, moving=moving), blocks).broken(plan)


def _prices_itself(block: Block) -> TypeGuard[Priced]:
    """Whether its `cost_along` is of its rows: a subclass that changes these alone has none."""
    family = type(block).__mro__
    rows, cost = (
        next((k for k, one in enumerate(family) if name in vars(one)), len(family))
        for name in ("add_to", "cost_along")
    )
    return cost <= rows and isinstance(block, Priced)


def _by_rows(blocks: Sequence[Block]) -> tuple[Block, ...]:
    """The blocks that nothing else prices or measures."""
    return tuple(
        block for block in blocks if type(block) not in _MEASURED and not _prices_itself(block)
    )


def visits(problem: PlanningProblem, plan: Plan) -> NDArray[np.int64]:
    """(U, W) step at which the plan covers each of the problem's waypoints, `NEVER` if not."""
    covers = plan.covers[:, :, problem.waypoint_index]
    return np.where(covers.any(axis=1), covers.argmax(axis=1), NEVER)


def gains(problem: PlanningProblem, visit: NDArray[np.int64]) -> FloatArray:
    """What covering at those steps (..., W) takes off part III of the objective."""
    return problem.waypoint_weight * np.maximum(problem.horizon - visit, 0)


class BlockRows:
    """The rows of blocks without the OCP's others, to be looked at along given flights.

    Raises:
        ValueError: a block uses columns of another one, so that its rows alone are no program.
    """

    def __init__(self, problem: PlanningProblem, blocks: Sequence[Block]) -> None:
        try:
            self._milp, v = formulate(problem, blocks)
        except MissingColumnsError as error:
            names = ", ".join(type(block).__name__ for block in blocks)
            raise ValueError(
                f"{error}; a block ({names}) with such columns needs a method `cost_along`"
            ) from error
        self._v, built = v, self._milp.build()
        own = np.ones(len(built.cost), bool)
        for columns in (v.x, v.u, v.covers, v.uncovered):
            own[columns[columns >= 0]] = False
        shape = (len(built.row_lower), len(own))
        entries = (built.coefficient, built.column, built.row_start)
        matrix: Any = sparse.csr_matrix(entries, shape=shape)
        self._built, self._own = built, own
        self._given, self._free = matrix[:, ~own], matrix[:, own]
        self._alone = np.diff(self._free.indptr) == 0  # rows without columns of their own

    def price(self, x: FloatArray, u: FloatArray | None, covers: NDArray[np.bool_]) -> Price:
        """See `Appraisal.price`."""
        built, given = self._built, self._values(x, u, covers)[~self._own]
        level = self._given @ given
        known = np.isfinite(level)
        low = np.where(known, built.row_lower - np.where(known, level, 0.0), -np.inf)
        high = np.where(known, built.row_upper - np.where(known, level, 0.0), np.inf)
        broken = np.where(self._alone, np.maximum(np.maximum(low, -high), 0.0), 0.0)
        cost = built.constant + float(np.nansum(built.cost[~self._own] * given))
        chosen = self._chosen(low, high)
        if chosen is None:
            broken[np.flatnonzero(~self._alone)[:1]] = _IMPOSSIBLE
        worst = int(broken.argmax()) if len(broken) else 0
        name = ""
        if len(broken) and broken[worst] > _TOLERANCE:
            name = self._milp.row_names()[worst]
        return Price(cost + (chosen or 0.0), float(broken.sum()), name)

    def _values(self, x: FloatArray, u: FloatArray | None, covers: NDArray[np.bool_]) -> FloatArray:
        """(C,) the shared columns along a flight, NaN where nothing is known."""
        v, values = self._v, np.full(len(self._own), np.nan)
        values[v.x] = x
        if u is not None:
            values[v.u] = u
        made = v.covers >= 0
        values[v.covers[made]] = covers[made]
        visited = np.cumsum(covers.any(axis=0), axis=0) > 0
        values[v.uncovered[0]] = 1.0
        values[v.uncovered[1:]] = ~visited
        return values

    def _chosen(self, low: FloatArray, high: FloatArray) -> float | None:
        """The least cost of the blocks' own columns, given the flight; None where there is none."""
        if not self._own.any():
            return 0.0
        built, rows = self._built, ~self._alone
        matrix = self._free[rows]
        own = rows_as_bounds(
            BuiltMilp(
                cost=built.cost[self._own],
                constant=0.0,
                lower=built.lower[self._own],
                upper=built.upper[self._own],
                integer=built.integer[self._own],
                row_start=np.asarray(matrix.indptr, np.int32),
                column=np.asarray(matrix.indices, np.int32),
                coefficient=np.asarray(matrix.data, np.float64),
                row_lower=low[rows] - _ROUNDING,
                row_upper=high[rows] + _ROUNDING,
                row=built.row[rows],
            )
        )
        if not len(own.row_lower) and not own.integer.any():
            best = np.where(own.cost > 0.0, own.lower, np.where(own.cost < 0.0, own.upper, 0.0))
            return float(own.cost @ best)
        try:
            solution = solve(own, _EXACTLY)
        except SolverError:
            return None
        return None if solution.values is None else solution.objective
