"""HiGHS: the one file that knows this solver. Models in parallel threads are safe.

Every call made: Highs(), setOptionValue, passModel, setSolution, cbMipInterrupt, run (which frees
the interpreter), getModelStatus, getInfo, getSolution.
"""

from __future__ import annotations

import time
from concurrent.futures import ThreadPoolExecutor

import highspy
import numpy as np

from uas_coverage_baselines.milp_mpc.model.milp import BuiltMilp
from uas_coverage_baselines.milp_mpc.solvers.interface import (
    SOLVER_TOLERANCE,
    Claim,
    FloatArray,
    Solution,
    SolverError,
    SolverLimits,
    Start,
    confirmed,
)

_PATIENCE_S = 10.0  # a solve that may take longer can be ended by Ctrl-C
_HEURISTICS = ("feasibility_jump", "rens", "rins", "root_reduced_cost")


def solve(
    milp: BuiltMilp,
    limits: SolverLimits,
    *,
    start: Start | None = None,
    lower: FloatArray | None = None,
    upper: FloatArray | None = None,
) -> Solution:
    """Minimize the program with HiGHS, see `Solve`."""
    began = time.perf_counter()
    lower = milp.lower if lower is None else lower
    upper = milp.upper if upper is None else upper
    free_integers = milp.integer & (lower < upper)
    solver = highspy.Highs()
    for option, value in _options(limits).items():
        solver.setOptionValue(option, value)
    try:
        passed = solver.passModel(_model(milp, lower, upper, free_integers))
        if passed == highspy.HighsStatus.kError:
            raise SolverError("HiGHS refuses the program")
        if start is not None and free_integers.any():
            solver.setSolution(len(start[0]), start[0].astype(np.int32), start[1])
        _run(solver, limits)
    except (RuntimeError, MemoryError) as error:  # what its C++ exceptions become
        raise SolverError(f"HiGHS: {error}") from error
    status, info = solver.getModelStatus(), solver.getInfo()
    optimal = status == highspy.HighsModelStatus.kOptimal
    bound = -np.inf
    if free_integers.any():
        bound = info.mip_dual_bound
    elif optimal:
        bound = info.objective_function_value
    values = duals = None
    if optimal and not free_integers.any():
        duals = np.array(solver.getSolution().row_dual)
    if info.primal_solution_status == highspy.SolutionStatus.kSolutionStatusFeasible:
        values = np.array(solver.getSolution().col_value)
    infeasible = status == highspy.HighsModelStatus.kInfeasible
    claim = Claim(values, bound, optimal, infeasible, max(info.simplex_iteration_count, 0), duals)
    return confirmed(claim, milp, lower, upper, time.perf_counter() - began)


def _run(solver: highspy.Highs, limits: SolverLimits) -> None:
    """Search, in a thread of its own where that has several threads or may take long.

    HiGHS starts its threads once per thread that calls it, and refuses another number later. The
    calling thread cannot hear Ctrl-C as long as it is in HiGHS.
    """
    endless = limits.nodes is None and (limits.time_s is None or limits.time_s > _PATIENCE_S)
    if limits.threads == 1 and not endless:
        solver.run()
        return
    given_up = False
    solver.cbMipInterrupt.subscribe(lambda event: event.interrupt(given_up))
    with ThreadPoolExecutor(1) as apart:
        running = apart.submit(solver.run)
        try:
            running.result()
        except KeyboardInterrupt:
            given_up = True
            raise


def _options(limits: SolverLimits) -> dict[str, bool | int | float | str]:
    options: dict[str, bool | int | float | str] = {
        "output_flag": False,
        "random_seed": 0,
        "threads": limits.threads,
        "mip_rel_gap": limits.relative_gap,
        "mip_abs_gap": limits.absolute_gap,
        "primal_feasibility_tolerance": SOLVER_TOLERANCE,
        "mip_feasibility_tolerance": SOLVER_TOLERANCE,
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
