"""SCIP through PySCIPOpt: the one file that knows this solver.

Models in parallel threads are safe: each has its own environment, and `optimizeNogil` frees the
interpreter. PySCIPOpt takes no matrices; rows are built one by one.
"""

from __future__ import annotations

import time

import numpy as np
import pyscipopt
from pyscipopt.scip import PY_SCIP_PARAMSETTING, ExprCons

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
from uas_coverage_env.files.strict_toml import InputError


def solve(
    milp: BuiltMilp,
    limits: SolverLimits,
    *,
    start: Start | None = None,
    lower: FloatArray | None = None,
    upper: FloatArray | None = None,
) -> Solution:
    """Minimize the program with SCIP, see `Solve`."""
    began = time.perf_counter()
    if limits.threads > 1:
        raise InputError(
            f"solver 'scip' searches on one thread; give threads=1 instead of {limits.threads}, "
            "or take another solver"
        )
    lower = milp.lower if lower is None else lower
    upper = milp.upper if upper is None else upper
    try:
        claim = _claim(milp, limits, start, lower, upper, began)
    except Exception as error:  # PySCIPOpt's errors have no narrower type
        raise SolverError(f"SCIP: {error}") from error
    return confirmed(claim, milp, lower, upper, time.perf_counter() - began)


def _claim(
    milp: BuiltMilp,
    limits: SolverLimits,
    start: Start | None,
    lower: FloatArray,
    upper: FloatArray,
    began: float,
) -> Claim:
    """What SCIP says of the program."""
    model = pyscipopt.Model()
    model.hideOutput()
    columns = _model(model, milp, lower, upper)
    if start is not None:
        partial = model.createPartialSol()
        for column, value in zip(start[0].tolist(), start[1].tolist(), strict=True):
            model.setSolVal(partial, columns[column], value)
        model.addSol(partial)
    if not limits.heuristics:  # SCIP's own choice of what is cheap: no sub-programs, no dives
        model.setHeuristics(PY_SCIP_PARAMSETTING.FAST)
    model.setParams(_parameters(limits, time.perf_counter() - began))
    model.optimizeNogil()
    values = None
    if model.getNSols() > 0:
        best = model.getBestSol()
        values = np.array([model.getSolVal(best, column) for column in columns])
    status, bound = model.getStatus(), model.getDualbound()
    if abs(bound) >= model.infinity():
        bound = float(np.copysign(np.inf, bound))
    optimal, infeasible = status in ("optimal", "gaplimit"), status == "infeasible"
    return Claim(values, bound, optimal, infeasible, model.getNLPIterations())


def _parameters(limits: SolverLimits, elapsed_s: float) -> dict[str, bool | int | float]:
    parameters: dict[str, bool | int | float] = {
        "misc/catchctrlc": False,  # Ctrl-C is for whoever flies the mission
        "numerics/feastol": SOLVER_TOLERANCE,
        "limits/gap": limits.relative_gap,
        "limits/absgap": limits.absolute_gap,
        # what completes a partial start, also where other heuristics are off
        "heuristics/completesol/freq": 0,
        "heuristics/completesol/maxunknownrate": 1.0,
    }
    if limits.time_s is not None:
        parameters["limits/time"] = max(limits.time_s - elapsed_s, 0.0)
    if limits.nodes is not None:
        parameters["limits/totalnodes"] = limits.nodes + 1  # SCIP counts the root
    return parameters


def _model(model, milp: BuiltMilp, lower: FloatArray, upper: FloatArray) -> list:
    """Fill a model; its columns come back in the program's order."""
    infinity = model.infinity()
    free_integers = milp.integer & (lower < upper)
    model.addObjoffset(milp.constant)
    columns = [
        model.addVar(vtype="I" if whole else "C", lb=low, ub=high, obj=cost)
        for whole, low, high, cost in zip(
            free_integers.tolist(),
            np.maximum(lower, -infinity).tolist(),
            np.minimum(upper, infinity).tolist(),
            milp.cost.tolist(),
            strict=True,
        )
    ]
    terms = [
        coefficient * columns[column]
        for coefficient, column in zip(milp.coefficient.tolist(), milp.column.tolist(), strict=True)
    ]
    lows = np.maximum(milp.row_lower, -infinity).tolist()
    highs = np.minimum(milp.row_upper, infinity).tolist()
    ends = milp.row_start.tolist()
    for row, (low, high) in enumerate(zip(lows, highs, strict=True)):
        left = pyscipopt.quicksum(terms[ends[row] : ends[row + 1]])
        model.addCons(ExprCons(left, low, high))
    return columns
