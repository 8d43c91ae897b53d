"""The OCP of a problem as a program: restricted around flights, started from plans, read back."""

from __future__ import annotations

from itertools import chain

import numpy as np
from numpy.typing import NDArray

from uas_coverage_baselines.milp_mpc.blocks.separation import (
    Separation,
    binary_columns,
    from_each_other,
    from_moving_obstacles,
    from_obstacles,
)
from uas_coverage_baselines.milp_mpc.construction import NEVER
from uas_coverage_baselines.milp_mpc.highs import Solution
from uas_coverage_baselines.milp_mpc.milp import ABSENT, Columns
from uas_coverage_baselines.milp_mpc.ocp import formulate
from uas_coverage_baselines.milp_mpc.problem import Plan, PlanningProblem

FloatArray = NDArray[np.float64]

EARLIER_STEPS = 3
"""A restricted program may cover a waypoint by so many steps earlier than the flight it is near."""
LATER_STEPS = 1
"""Likewise later."""
FACE_SLACK_M = 1.0
"""Faces that a flight misses by no more than this stay free."""


class Program:
    """The OCP of one problem, formulated and built."""

    def __init__(self, problem: PlanningProblem) -> None:
        self.problem = problem
        self.milp, self.variables = formulate(problem)
        self.built = self.milp.build()
        self._separations = list(
            chain(from_obstacles(problem), from_moving_obstacles(problem), from_each_other(problem))
        )

    def near(
        self, positions_m: FloatArray, visits: NDArray[np.int64]
    ) -> tuple[FloatArray, FloatArray]:
        """Column bounds that leave free only what lies near flights.

        Each waypoint may be covered within a window around the step at which the flight does;
        each shape may be passed along the faces that the flight passes, or nearly passes.

        Args:
            positions_m: (U, N+1, 3) the flights.
            visits: (U, W) first step at which each covers a waypoint, `NEVER` if not.
        """
        lower, upper = self.built.lower.copy(), self.built.upper.copy()
        steps = np.arange(self.problem.horizon)[None, :, None]
        allowed = (visits < NEVER)[:, None, :] & (steps >= visits[:, None, :] - EARLIER_STEPS)
        allowed &= steps <= visits[:, None, :] + LATER_STEPS
        upper[_made(self.variables.covers[~allowed])] = 0.0
        for separation in self._separations:
            columns = binary_columns(self.milp, separation)
            if columns is None:
                continue
            relaxed, crossed = columns
            spare = _spare_over_intervals(separation, positions_m)
            best = spare.max(axis=2, keepdims=True)
            faces = np.where(
                best >= FACE_SLACK_M, spare == best, spare >= best - FACE_SLACK_M
            ) & (spare > -np.inf)  # fmt: skip
            free = faces | ~faces.any(axis=2, keepdims=True)
            lower[_made(crossed[~free])] = 1.0
            used = np.zeros(relaxed.shape, bool)
            used[:, :-1] |= free
            used[:, 1:] |= free
            lower[_made(relaxed[~used])] = 1.0
        return lower, upper

    def start(
        self, positions_m: FloatArray, visits: NDArray[np.int64]
    ) -> tuple[NDArray[np.int64], FloatArray]:
        """Whole-number columns and their values along flights, for the solver to start from.

        Args:
            positions_m: (U, N+1, 3) the flights.
            visits: (U, W) first step at which each covers a waypoint, `NEVER` if not.
        """
        steps = np.arange(self.problem.horizon)[None, :, None]
        covers = steps == visits[:, None, :]
        columns, values = [self.variables.covers.ravel()], [covers.astype(float).ravel()]
        for separation in self._separations:
            binaries = binary_columns(self.milp, separation)
            if binaries is None:
                continue
            crossed = binaries[1]
            spare = _spare_over_intervals(separation, positions_m)
            best = spare.argmax(axis=2)[..., None]
            chosen = np.arange(spare.shape[2]) != best
            columns.append(crossed.ravel())
            values.append(chosen.astype(float).ravel())
        all_columns, all_values = np.concatenate(columns), np.concatenate(values)
        made = all_columns != ABSENT
        return all_columns[made], all_values[made]

    def plan(self, solution: Solution) -> Plan:
        """Column values back into trajectories.

        Raises:
            ValueError: the solution has no values.
        """
        values, v, problem = solution.values, self.variables, self.problem
        if values is None:
            raise ValueError(f"no plan can be read: {solution.status}")
        covers = np.zeros((problem.n_uas, problem.horizon, problem.n_scenario_waypoints), bool)
        chosen = np.where(v.covers != ABSENT, values[v.covers], 0.0) > 0.5
        covers[:, :, problem.waypoint_index] = chosen
        return Plan(problem.names, values[v.x], values[v.u], covers, solution.objective, -np.inf)


def _made(columns: Columns) -> Columns:
    return columns[columns != ABSENT]


def _spare_over_intervals(separation: Separation, positions_m: FloatArray) -> FloatArray:
    """(G, N, F) distance to spare beyond each face at both ends of each interval."""
    position = positions_m[separation.mover]
    if separation.partner is not None:
        position = position - positions_m[separation.partner]
    spare = position @ separation.normals.T + separation.offset_m
    spare = spare - separation.clearance_m[:, None, :]
    spare[:, 0] = np.where(separation.always[:, 0], np.inf, -np.inf)
    over_interval = np.minimum(spare[:, :-1], spare[:, 1:])
    over_interval[separation.never[:, :-1] | separation.never[:, 1:]] = -np.inf
    return over_interval
