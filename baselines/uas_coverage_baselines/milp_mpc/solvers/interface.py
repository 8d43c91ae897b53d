"""What every solver takes and gives back, and the arithmetic that its word has to stand.

A solver is one file of this folder with one function of type `Solve`. It makes a `Claim`;
`confirmed` turns the claim into a `Solution`: values count only after `BuiltMilp.violation` has
confirmed them, since solvers work with tolerances of their own and have had wrong answers.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from uas_coverage_baselines.milp_mpc.model.milp import BuiltMilp

FloatArray = NDArray[np.float64]
Start = tuple[NDArray[np.int64], FloatArray]
"""A point to start from, as (columns, values); columns left out are the solver's to complete."""


class SolverError(Exception):
    """The solver failed where it should have solved: this solve gives nothing."""


TOLERANCE = 2e-6
"""Largest violation of a row that counts as none: sums of rounded terms."""
SOLVER_TOLERANCE = 1e-7
"""What solvers are asked to keep: an order below `TOLERANCE`, since whole numbers get rounded."""


class SolveStatus(StrEnum):
    """What came of a solve, as a sentence that says what the caller has in hand."""

    OPTIMAL = "optimal within the gap"
    FEASIBLE = "a verified solution, not proven optimal"
    INFEASIBLE = "no solution exists"
    NO_SOLUTION = "no verified solution within the limits"


@dataclass(frozen=True)
class SolverLimits:
    """When a solve ends.

    Attributes:
        time_s: wall clock; None for none.
        nodes: branch-and-bound nodes after the root; None for none. On one thread a node limit
            alone makes the solve repeatable bit by bit.
        relative_gap: stop once the gap is proven to be at most this.
        absolute_gap: likewise, in units of the objective.
        heuristics: whether the solver may search with sub-programs; on small programs they take
            longer than the search itself.
        threads: of the solver itself.
    """

    time_s: float | None = None
    nodes: int | None = None
    relative_gap: float = 1e-3
    absolute_gap: float = 1e-2
    heuristics: bool = True
    threads: int = 1


@dataclass(frozen=True)
class Solution:
    """A solve's outcome.

    Attributes:
        status: see `SolveStatus`.
        values: (C,) verified column values, whole numbers rounded; None without a solution.
        objective: objective of `values`, by our arithmetic; inf without a solution.
        bound: proven lower bound of the objective; -inf where none.
        violation: largest violation of what the solver returned, rounded; inf where nothing.
        wall_time_s: duration.
        iterations: simplex iterations, those in sub-programs left out.
        duals: (R,) what a unit of each row's right-hand side would add to the objective, of a
            program without free whole numbers that is solved to its optimum; else None, as from
            solvers other than HiGHS.
    """

    status: SolveStatus
    values: FloatArray | None
    objective: float
    bound: float
    violation: float
    wall_time_s: float
    iterations: int = 0
    duals: FloatArray | None = None


class Solve(Protocol):
    """Minimizes a program."""

    def __call__(
        self,
        milp: BuiltMilp,
        limits: SolverLimits,
        *,
        start: Start | None = None,
        lower: FloatArray | None = None,
        upper: FloatArray | None = None,
    ) -> Solution:
        """Minimize the program.

        Args:
            milp: the program.
            limits: when to stop.
            start: a starting point; the solver completes a partial one.
            lower: (C,) column bounds that replace the program's, e.g. to fix binaries.
            upper: likewise.

        Returns:
            The solution; its values satisfy the program (with the replaced bounds) within
            `TOLERANCE`.

        Raises:
            InputError: the solver's licence does not allow this program, or it has one thread
                only; one line.
            SolverError: the solver raised something of its own.
        """
        ...


@dataclass(frozen=True)
class Claim:
    """What a solver says, not yet believed.

    Attributes:
        values: (C,) column values; None without.
        bound: lower bound of the objective; -inf where none.
        optimal: whether the solver calls `values` optimal within the gap.
        infeasible: whether it calls the program infeasible.
        iterations: simplex iterations that it counts.
        duals: (R,) of the rows; None without.
    """

    values: FloatArray | None
    bound: float
    optimal: bool
    infeasible: bool
    iterations: int = 0
    duals: FloatArray | None = None


def confirmed(
    claim: Claim, milp: BuiltMilp, lower: FloatArray, upper: FloatArray, wall_time_s: float
) -> Solution:
    """The solution that is left of a claim once its values have been checked.

    Args:
        claim: what the solver says.
        milp: the program.
        lower: (C,) column bounds the solver was given.
        upper: likewise.
        wall_time_s: how long the solve took.
    """
    values, violation = None, np.inf
    if claim.values is not None:
        rounded = np.where(milp.integer, np.round(claim.values), claim.values)
        values = np.clip(rounded, lower, upper)
        violation = milp.violation(values)
    if values is None or violation > TOLERANCE:
        outcome = SolveStatus.INFEASIBLE if claim.infeasible else SolveStatus.NO_SOLUTION
        return Solution(
            outcome, None, np.inf, claim.bound, violation, wall_time_s, claim.iterations
        )
    outcome = SolveStatus.OPTIMAL if claim.optimal else SolveStatus.FEASIBLE
    objective = float(milp.objective(values))
    bound = min(float(claim.bound), objective)
    return Solution(
        *(outcome, values, objective, bound, violation, wall_time_s),
        iterations=claim.iterations,
        duals=claim.duals,
    )
