"""The OCP of a problem as a program: restricted around flights, started from plans, read back."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import chain

import numpy as np
from numpy.typing import NDArray

from uas_coverage_baselines.milp_mpc.model.blocks.separation import (
    Separation,
    from_each_other,
    from_moving_obstacles,
    from_obstacles,
)
from uas_coverage_baselines.milp_mpc.model.milp import ABSENT, Columns
from uas_coverage_baselines.milp_mpc.model.ocp import OCP, Block
from uas_coverage_baselines.milp_mpc.model.problem import NEVER, Plan, PlanningProblem
from uas_coverage_baselines.milp_mpc.model.reductions.elimination import flown_states
from uas_coverage_baselines.milp_mpc.model.reductions.formulations import (
    Formulation,
    write_smallest,
)
from uas_coverage_baselines.milp_mpc.solvers.interface import Solution

FloatArray = NDArray[np.float64]
_QUICKEST = "state"  # to write and to solve, where little is free
TIGHTEST = "clique"
"""Name of the form to take where times of visits are free."""


@dataclass(frozen=True)
class Neighbourhood:
    """How near to a flight a restricted program stays.

    Attributes:
        earlier_steps: it may cover a waypoint by so many steps earlier than the flight.
        later_steps: likewise later.
        face_slack_m: faces that the flight misses by no more than this stay free.
        other_faces: whether they do also where the flight passes a face with room to spare.
        other_waypoints: whether waypoints may be covered that the flight does not.
    """

    earlier_steps: int
    later_steps: int
    face_slack_m: float
    other_faces: bool = False
    other_waypoints: bool = False


NARROW = Neighbourhood(earlier_steps=3, later_steps=1, face_slack_m=1.0)
"""Some hundredths of a second, as long as the flight is a good one."""
ALONG = Neighbourhood(
    earlier_steps=100, later_steps=100, face_slack_m=3.0, other_faces=True, other_waypoints=True
)
"""Only the sides at which shapes are passed stay near the flight's: quick where an order is given,
which leaves little to choose but when to visit, and where a flight is a good one."""
WIDE = Neighbourhood(earlier_steps=100, later_steps=100, face_slack_m=30.0, other_faces=True)
"""Finds the way around what the flight runs into."""


class RestrictedMilp:
    """The OCP of one problem, formulated and built.

    Args:
        problem: the decision.
        blocks: of the OCP.
        formulation: how it is written, see `reductions`; all give the same optimum. Where None,
            what is quickest.
        first: name of the form that is taken where the blocks allow it, see `write_smallest`.
    """

    def __init__(
        self,
        problem: PlanningProblem,
        blocks: Sequence[Block] = OCP,
        *,
        formulation: Formulation | None = None,
        first: str | None = None,
    ) -> None:
        self.problem = problem
        if formulation is None:
            first = first or (TIGHTEST if problem.tours else _QUICKEST)
            formulation, self.milp, self.variables = write_smallest(problem, blocks, first)
        else:
            self.milp, self.variables = formulation.write(problem, blocks)
        self.built = formulation.finish(self.milp.build())
        self._separations = [
            separation
            for separation in chain(
                from_obstacles(problem), from_moving_obstacles(problem), from_each_other(problem)
            )
            if f"{separation.name}.crossed" in self.milp
        ]

    def row_names(self) -> list[str]:
        """Name of each row of `built`: its family and its index in the family."""
        names = self.milp.row_names()
        return [names[row] for row in self.built.row.tolist()]

    def bounds_near(
        self,
        positions_m: FloatArray,
        visits: NDArray[np.int64],
        neighbourhood: Neighbourhood = NARROW,
    ) -> tuple[FloatArray, FloatArray]:
        """Column bounds that leave free only what lies near flights.

        Each waypoint may be covered within a window around the step at which the flight does;
        each shape may be passed along the faces that the flight passes, or nearly passes.

        Args:
            positions_m: (U, N+1, 3) the flights.
            visits: (U, W) first step at which each covers a waypoint, `NEVER` if not.
            neighbourhood: what counts as near.
        """
        lower, upper = self.built.lower.copy(), self.built.upper.copy()
        steps = np.arange(self.problem.horizon)[None, :, None]
        visited = visits < NEVER
        allowed = visited[:, None, :] & (steps >= visits[:, None, :] - neighbourhood.earlier_steps)
        allowed &= steps <= visits[:, None, :] + neighbourhood.later_steps
        allowed |= neighbourhood.other_waypoints & ~visited[:, None, :]
        upper[_made(self.variables.covers[~allowed])] = 0.0
        for separation in self._separations:
            crossed = self.milp.columns(f"{separation.name}.crossed")
            spare = _open_spare_m(separation, positions_m)
            best = spare.max(axis=2, keepdims=True)
            faces = spare >= best - neighbourhood.face_slack_m
            if not neighbourhood.other_faces:
                faces = np.where(best >= neighbourhood.face_slack_m, spare == best, faces)
            faces &= spare > -np.inf
            free = faces | ~faces.any(axis=2, keepdims=True)
            lower[_made(crossed[~free])] = 1.0
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
            crossed = self.milp.columns(f"{separation.name}.crossed")
            spare = _open_spare_m(separation, positions_m)
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
        u = np.where(v.u != ABSENT, values[v.u], 0.0)
        x = flown_states(problem, u)  # those without columns too, and free of rounding
        return Plan(problem.names, x, u, covers, solution.objective, -np.inf)


def _made(columns: Columns) -> Columns:
    return columns[columns != ABSENT]


def _open_spare_m(separation: Separation, positions_m: FloatArray) -> FloatArray:
    """`Separation.spare_m`, -inf where the program has no such face to choose."""
    spare = separation.spare_m(positions_m)
    spare[separation.never[:, :-1] | separation.never[:, 1:]] = -np.inf
    return spare
