"""HiGHS with a stopwatch: when the first solution came, when the gap closed.

The planner's own bridge asks only for the outcome; here every improvement of solution and bound is
noted as HiGHS tells it. Seconds are processor time of this process, in which one thread solves and
nothing else runs: what else the machine does matters less than to a clock on the wall.
"""

import time
from dataclasses import dataclass

import highspy
import numpy as np
from uas_coverage_baselines.milp_mpc.model.milp import BuiltMilp

ONE_PERCENT = 0.01
SECONDS, OBJECTIVE, BOUND = range(3)


@dataclass(frozen=True)
class Watched:
    """How one program was solved.

    Attributes:
        took_s: how long it took.
        optimal: whether the gap was closed.
        objective: of the best solution; inf without one.
        bound: proven lower bound.
        history: (T, 3) `SECONDS`, best `OBJECTIVE`, `BOUND`, as HiGHS told them.
        violation: of the solution, by our own arithmetic.
    """

    took_s: float
    optimal: bool
    objective: float
    bound: float
    history: np.ndarray
    violation: float

    def first_s(self) -> float | None:
        """When the first solution was there; None: not within the cap."""
        found = np.flatnonzero(np.isfinite(self.history[:, OBJECTIVE]))
        return float(self.history[found[0], SECONDS]) if len(found) else None

    def within_one_percent_s(self, offset: float) -> float | None:
        """When the gap relative to objective + offset was at most 1 %; None: not within the cap."""
        found = np.flatnonzero(self.gaps(offset) <= ONE_PERCENT)
        return float(self.history[found[0], SECONDS]) if len(found) else None

    def gaps(self, offset: float) -> np.ndarray:
        """(T,) gap over time, relative to objective + offset; inf without solution or bound."""
        _, best, bound = self.history.T
        size = np.maximum(np.abs(best + offset), 1e-6)
        with np.errstate(invalid="ignore"):
            gap = np.maximum(best - bound, 0.0) / size
        return np.where(np.isfinite(best) & np.isfinite(bound), gap, np.inf)


def watch(milp: BuiltMilp, cap_s: float, relative_gap: float = 1e-4) -> Watched:
    """Solve a program to optimality or for `cap_s` seconds, on one thread.

    Args:
        milp: the program.
        cap_s: when to give up.
        relative_gap: what counts as optimal, relative to what the planner can influence.
    """
    solver = highspy.Highs()
    for option, value in {
        "output_flag": False,
        "random_seed": 0,
        "threads": 1,
        "time_limit": 10.0 * cap_s,  # on the wall, should nothing else end it
        "mip_rel_gap": relative_gap,
        "mip_abs_gap": 1e-4,
        "primal_feasibility_tolerance": 1e-7,
        "mip_feasibility_tolerance": 1e-7,
    }.items():
        solver.setOptionValue(option, value)
    solver.passModel(_model(milp))
    history: list[tuple[float, float, float]] = []
    began_s = time.process_time()

    def note(event) -> None:
        out, now_s = event.data_out, time.process_time() - began_s
        history.append((now_s, out.mip_primal_bound, out.mip_dual_bound))
        event.interrupt(now_s > cap_s)

    solver.cbMipImprovingSolution.subscribe(note)
    solver.cbMipInterrupt.subscribe(note)
    solver.run()
    info, took_s = solver.getInfo(), time.process_time() - began_s
    optimal = solver.getModelStatus() == highspy.HighsModelStatus.kOptimal
    solved = info.primal_solution_status == highspy.SolutionStatus.kSolutionStatusFeasible
    objective, violation = np.inf, np.inf
    if solved:
        values = np.array(solver.getSolution().col_value)
        values[milp.integer] = np.round(values[milp.integer])
        objective, violation = milp.objective(values), milp.violation(values)
    if milp.integer.any():
        bound = float(info.mip_dual_bound)
    else:  # HiGHS reports a bound of 0 for a program without whole numbers
        bound = objective if optimal else -np.inf
    history.append((took_s, objective, bound))
    rows = np.array(history)
    rows[np.abs(rows) >= 1e30] = np.nan
    rows[:, OBJECTIVE] = np.where(np.isnan(rows[:, OBJECTIVE]), np.inf, rows[:, OBJECTIVE])
    rows[:, BOUND] = np.where(np.isnan(rows[:, BOUND]), -np.inf, rows[:, BOUND])
    return Watched(took_s, optimal, objective, bound, rows, violation)


def _model(milp: BuiltMilp) -> highspy.HighsLp:
    model = highspy.HighsLp()
    model.num_row_, model.num_col_ = len(milp.row_lower), len(milp.cost)
    model.col_cost_, model.offset_ = milp.cost, milp.constant
    model.col_lower_, model.col_upper_ = milp.lower, milp.upper
    model.row_lower_, model.row_upper_ = milp.row_lower, milp.row_upper
    model.a_matrix_.format_ = highspy.MatrixFormat.kRowwise
    model.a_matrix_.start_ = milp.row_start
    model.a_matrix_.index_ = milp.column
    model.a_matrix_.value_ = milp.coefficient
    kinds = np.array([highspy.HighsVarType.kContinuous, highspy.HighsVarType.kInteger])
    model.integrality_ = kinds[milp.integer.astype(int)].tolist()
    return model
