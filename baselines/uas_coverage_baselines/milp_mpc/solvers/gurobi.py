"""Gurobi through gurobipy: the one file that knows this solver.

`optimize` frees the interpreter. Models in parallel threads are safe as long as no two of them
share an environment: each solve borrows one from those that are idle.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager
from queue import Empty, SimpleQueue
from typing import Any

import gurobipy
import numpy as np
from gurobipy import GRB
from scipy import sparse

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

_LICENCE_ERRORS = (GRB.Error.NO_LICENSE, GRB.Error.SIZE_LIMIT_EXCEEDED)

_idle: SimpleQueue[gurobipy.Env] = SimpleQueue()  # starting one asks for a licence, which may take


def solve(
    milp: BuiltMilp,
    limits: SolverLimits,
    *,
    start: Start | None = None,
    lower: FloatArray | None = None,
    upper: FloatArray | None = None,
) -> Solution:
    """Minimize the program with Gurobi, see `Solve`."""
    began = time.perf_counter()
    lower = milp.lower if lower is None else lower
    upper = milp.upper if upper is None else upper
    try:
        with _environment() as environment, gurobipy.Model(env=environment) as model:
            columns = _model(model, milp, lower, upper)
            if start is not None:
                point = np.full(len(milp.cost), GRB.UNDEFINED)
                point[start[0]] = start[1]
                columns.setAttr("Start", point)
            for parameter, value in _parameters(limits, time.perf_counter() - began).items():
                model.setParam(parameter, value)
            model.optimize()
            if model.Status == GRB.INF_OR_UNBD:  # presolve may not tell the two apart
                model.setParam("DualReductions", 0)
                model.optimize()
            if model.Status == GRB.INTERRUPTED:
                raise KeyboardInterrupt
            claim = _claim(model, columns)
    except gurobipy.GurobiError as error:
        if error.errno not in _LICENCE_ERRORS:
            raise SolverError(f"Gurobi: {error}") from error
        raise InputError(
            f"solver 'gurobi': {error} (this program has {len(milp.cost)} columns and "
            f"{len(milp.row_lower)} rows); take another solver or another licence"
        ) from error
    return confirmed(claim, milp, lower, upper, time.perf_counter() - began)


@contextmanager
def _environment() -> Iterator[gurobipy.Env]:
    """An environment for one solve, given back afterwards."""
    try:
        environment = _idle.get_nowait()
    except Empty:
        environment = gurobipy.Env(empty=True)
        environment.setParam("OutputFlag", 0)
        environment.start()
    try:
        yield environment
    finally:
        _idle.put(environment)


def _parameters(limits: SolverLimits, elapsed_s: float) -> dict[str, int | float]:
    parameters: dict[str, int | float] = {
        "Seed": 0,
        "Threads": limits.threads,
        "MIPGap": limits.relative_gap,
        "MIPGapAbs": limits.absolute_gap,
        "FeasibilityTol": SOLVER_TOLERANCE,
        "IntFeasTol": 1e-9,  # what rounding takes away counts M times in a big-M row
    }
    if not limits.heuristics:
        parameters |= {"RINS": 0, "SubMIPNodes": 0}
    if limits.time_s is not None:
        parameters["TimeLimit"] = max(limits.time_s - elapsed_s, 0.0)
    if limits.nodes is not None:
        parameters["NodeLimit"] = limits.nodes
    return parameters


def _model(
    model: gurobipy.Model, milp: BuiltMilp, lower: FloatArray, upper: FloatArray
) -> gurobipy.MVar:
    """Fill a model; its columns come back in the program's order."""
    free_integers = milp.integer & (lower < upper)
    columns = model.addMVar(
        len(milp.cost),
        lb=lower,
        ub=upper,
        obj=milp.cost,
        vtype=np.where(free_integers, GRB.INTEGER, GRB.CONTINUOUS),
    )
    model.ObjCon = milp.constant
    shape = (len(milp.row_lower), len(milp.cost))
    entries = (milp.coefficient, milp.column, milp.row_start)
    rows: Any = sparse.csr_matrix(entries, shape=shape)
    equal = milp.row_lower == milp.row_upper
    for chosen, sense, side in (
        (equal, GRB.EQUAL, milp.row_upper),
        (~equal & np.isfinite(milp.row_lower), GRB.GREATER_EQUAL, milp.row_lower),
        (~equal & np.isfinite(milp.row_upper), GRB.LESS_EQUAL, milp.row_upper),
    ):
        if chosen.any():
            model.addMConstr(rows[chosen], columns, sense, side[chosen])
    return columns


def _claim(model: gurobipy.Model, columns: gurobipy.MVar) -> Claim:
    optimal, infeasible = model.Status == GRB.OPTIMAL, model.Status == GRB.INFEASIBLE
    values = np.asarray(columns.X) if model.SolCount > 0 else None
    bound = -np.inf
    if infeasible:
        bound = np.inf
    elif model.IsMIP:
        bound = model.ObjBound
    elif optimal:
        bound = model.ObjVal
    return Claim(values, bound, optimal, infeasible, int(model.IterCount))
