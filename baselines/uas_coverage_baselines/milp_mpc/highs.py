"""HiGHS: the one file that knows the solver.

Every call made: Highs(), setOptionValue, passModel, setSolution, run, getModelStatus, getInfo,
getSolution. HiGHS gives no time guarantee and has had wrong answers under options, so a solution
counts only after `BuiltMilp.violation` has confirmed it by our own arithmetic.
"""

from __future__ import annotations

import time
from dataclasses import dataclass
from enum import StrEnum

import highspy
import numpy as np
from numpy.typing import NDArray

from uas_coverage_baselines.milp_mpc.milp import BuiltMilp

TOLERANCE = 2e-6  # twice HiGHS's own feasibility tolerance: sums of rounded terms


_HEURISTICS = ("feasibility_jump", "rens", "rins", "root_reduced_cost")


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
        nodes: branch-and-bound nodes; None for none. With one thread a node limit alone makes
            the solve repeatable bit by bit.
        relative_gap: stop once the gap is proven to be at most this.
        absolute_gap: likewise, in units of the objective.
        heuristics: whether HiGHS may search with sub-programs; on small programs they take longer
            than the search itself.
    """

    time_s: float | None = None
    nodes: int | None = None
    relative_gap: float = 1e-3
    absolute_gap: float = 1e-2
    heuristics: bool = True


@dataclass(frozen=True)
class Solution:
    """A solve's outcome.

    Attributes:
        status: see `SolveStatus`.
        values: (C,) verified column values, whole numbers rounded; None without a solution.
        objective: objective of `values`, by our arithmetic; inf without a solution.
        bound: proven lower bound of the objective; -inf where none.
        violation: largest violation of `values`.
        wall_time_s: duration.
    """

    status: SolveStatus
    values: NDArray[np.float64] | None
    objective: float
    bound: float
    violation: float
    wall_time_s: float


def solve(
    milp: BuiltMilp,
    limits: SolverLimits,
    *,
    start: tuple[NDArray[np.int64], NDArray[np.float64]] | None = None,
    lower: NDArray[np.float64] | None = None,
    upper: NDArray[np.float64] | None = None,
) -> Solution:
    """Minimize the program.

    Args:
        milp: the program.
        limits: when to stop.
        start: a starting point as (columns, values); HiGHS completes a partial one.
        lower: (C,) column bounds that replace the program's, e.g. to fix binaries.
        upper: likewise.

    Returns:
        The solution; its values satisfy the program (with the replaced bounds) within `TOLERANCE`.
    """
    began = time.perf_counter()
    lower = milp.lower if lower is None else lower
    upper = milp.upper if upper is None else upper
    free_integers = milp.integer & (lower < upper)
    solver = highspy.Highs()
    for option, value in _options(limits).items():
        solver.setOptionValue(option, value)
    solver.passModel(_model(milp, lower, upper, free_integers))
    if start is not None and free_integers.any():
        solver.setSolution(len(start[0]), start[0].astype(np.int32), start[1])
    solver.run()
    status, info = solver.getModelStatus(), solver.getInfo()
    bound = -np.inf
    if free_integers.any():
        bound = info.mip_dual_bound
    elif status == highspy.HighsModelStatus.kOptimal:
        bound = info.objective_function_value
    values, violation = None, np.inf
    if info.primal_solution_status == highspy.SolutionStatus.kSolutionStatusFeasible:
        values = np.array(solver.getSolution().col_value)
        values[milp.integer] = np.round(values[milp.integer])
        values = np.clip(values, lower, upper)
        violation = milp.violation(values)
        if violation > TOLERANCE:
            values = None
    elapsed = time.perf_counter() - began
    if values is None:
        proven = status == highspy.HighsModelStatus.kInfeasible
        outcome = SolveStatus.INFEASIBLE if proven else SolveStatus.NO_SOLUTION
        return Solution(outcome, None, np.inf, bound, violation, elapsed)
    optimal = status == highspy.HighsModelStatus.kOptimal
    outcome = SolveStatus.OPTIMAL if optimal else SolveStatus.FEASIBLE
    objective = milp.objective(values)
    return Solution(outcome, values, objective, min(bound, objective), violation, elapsed)


def _options(limits: SolverLimits) -> dict[str, bool | int | float | str]:
    options: dict[str, bool | int | float | str] = {
        "output_flag": False,
        "random_seed": 0,
        "threads": 1,  # global to the process in HiGHS; programs are solved side by side instead
        "mip_rel_gap": limits.relative_gap,
        "mip_abs_gap": limits.absolute_gap,
        # one order below TOLERANCE, so that rounding the binaries stays within it
        "primal_feasibility_tolerance": 1e-7,
        "mip_feasibility_tolerance": 1e-7,
    }
    if not limits.heuristics:
        options |= {"mip_heuristic_effort": 0.0, "mip_allow_restart": False}
        options |= {f"mip_heuristic_run_{name}": False for name in _HEURISTICS}
    if limits.time_s is not None:
        options["time_limit"] = max(limits.time_s, 0.01)
    if limits.nodes is not None:
        options["mip_max_nodes"] = limits.nodes
    return options


def _model(milp: BuiltMilp, lower, upper, free_integers) -> highspy.HighsLp:
    model = highspy.HighsLp()
    model.num_row_, model.num_col_ = len(milp.row_lower), len(milp.cost)
    model.col_cost_, model.offset_ = milp.cost, milp.constant
    model.col_lower_, model.col_upper_ = lower, upper
    model.row_lower_, model.row_upper_ = milp.row_lower, milp.row_upper
    model.a_matrix_.format_ = highspy.MatrixFormat.kRowwise
    model.a_matrix_.start_ = milp.row_start
    model.a_matrix_.index_ = milp.column
    model.a_matrix_.value_ = milp.coefficient
    if free_integers.any():
        kinds = np.array([highspy.HighsVarType.kContinuous, highspy.HighsVarType.kInteger])
        model.integrality_ = kinds[free_integers.astype(int)].tolist()
    return model
