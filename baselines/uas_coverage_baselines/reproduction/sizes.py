"""How large the paper's program is, class by class, and what a class costs to solve."""

import time
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from uas_coverage_baselines.milp_mpc.model.milp import Milp
from uas_coverage_baselines.milp_mpc.model.problem import PlanningProblem
from uas_coverage_baselines.milp_mpc.model.reductions import FORMULATIONS
from uas_coverage_baselines.milp_mpc.solvers import SolverLimits
from uas_coverage_baselines.milp_mpc.solvers.highs import solve
from uas_coverage_baselines.milp_mpc.solvers.interface import SolveStatus
from uas_coverage_baselines.reproduction.decisions import (
    with_obstacles,
    with_waypoints,
    without_collision,
)

PAPER_FORM, SOLVED_FORM = "paper", "clique"
"""What is counted, and in which form programs are solved: the paper's is not, within minutes."""

GAP = 0.01
"""To which programs are solved, a share of what all open waypoints cost over the horizon."""

COVERAGE, OBSTACLES, MOVING, COLLISION = "coverage", "obstacles", "moving obstacle", "collision"
_OTHERS = {
    "dynamics": "dynamics",
    "capabilities": "capabilities",
    "thrust": "capabilities",
    "slack": "slack variables",
    "geofence": "geofence",
    "collision": COLLISION,
    "coverage": COVERAGE,
    "covers": COVERAGE,
    "uncovered": COVERAGE,
    "x": "dynamics",
    "u": "dynamics",
}
_REST = "others"


@dataclass(frozen=True)
class ClassSize:
    """The share of a class of constraints in a program.

    Attributes:
        name: Of the class.
        rows: Its rows.
        columns: The columns that it adds.
        binaries: Those of them that take 0 or 1.
    """

    name: str
    rows: int
    columns: int
    binaries: int


@dataclass(frozen=True)
class Timing:
    """How a program was solved, on one thread.

    Attributes:
        name: What was left out, or changed.
        rows: Of the program solved.
        columns: Likewise.
        binaries: Likewise.
        seconds: Processor time.
        gap: Proven, as a share of what all open waypoints cost; infinite without a solution.
        solved: Whether the gap was closed to `GAP` within the time given.
    """

    name: str
    rows: int
    columns: int
    binaries: int
    seconds: float
    gap: float
    solved: bool


def class_sizes(problem: PlanningProblem, form: str = PAPER_FORM) -> list[ClassSize]:
    """The program of a decision, counted by class; the largest number of rows first."""
    milp, _ = FORMULATIONS[form].write(problem)
    return sizes_by_class(milp, _families(problem))


def sizes_by_class(milp: Milp, families: Mapping[str, str]) -> list[ClassSize]:
    """A program counted by class.

    Args:
        milp: The program.
        families: First part of the name of a group of rows or columns -> its class.
    """

    def count(names: Sequence[str]) -> Counter[str]:
        firsts = (name.partition("(")[0].partition(".")[0] for name in names)
        return Counter(families.get(first, _REST) for first in firsts)

    integer, names = milp.build().integer, milp.column_names()
    rows, columns = count(milp.row_names()), count(names)
    binaries = count([name for name, whole in zip(names, integer, strict=True) if whole])
    found = sorted({*rows, *columns}, key=lambda name: (-rows[name], name))
    return [ClassSize(name, rows[name], columns[name], binaries[name]) for name in found]


def _families(problem: PlanningProblem) -> dict[str, str]:
    return {
        **_OTHERS,
        **{name: OBSTACLES for name, _ in problem.obstacles},
        **{moving.name: MOVING for moving in problem.moving},
    }


LEFT_OUT: Mapping[str, Callable[[PlanningProblem], PlanningProblem]] = {
    "nothing": lambda problem: problem,
    "half of the waypoints": lambda problem: with_waypoints(problem, 0.5),
    "all waypoints": lambda problem: with_waypoints(problem, 0.0),
    "half of the obstacles": lambda problem: with_obstacles(problem, 0.5),
    "all obstacles": lambda problem: with_obstacles(problem, 0.0),
    "the distance between UAS": without_collision,
}
"""What a class costs is seen by leaving it out: what -> the decision without it."""


def open_cost(problem: PlanningProblem) -> float:
    """Part III of the objective where no waypoint gets covered; 1 where none is open."""
    return problem.horizon * float(problem.waypoint_weight.sum()) or 1.0


def timed(
    name: str, problem: PlanningProblem, cap_s: float, scale: float, form: str = SOLVED_FORM
) -> Timing:
    """Solve the joint program of a decision to `GAP`.

    Args:
        name: Of the timing.
        problem: The decision.
        cap_s: Longest wall clock [s].
        scale: Of which gaps are a share, see `open_cost`.
        form: How the program is written.
    """
    built, _ = FORMULATIONS[form].build(problem)
    free = built.integer & (built.lower < built.upper)
    began_s = time.process_time()
    found = solve(built, SolverLimits(time_s=cap_s, relative_gap=0.0, absolute_gap=GAP * scale))
    took_s = time.process_time() - began_s
    gap = np.inf
    if np.isfinite(found.objective) and np.isfinite(found.bound):
        gap = max(found.objective - found.bound, 0.0) / scale
    solved = found.status is SolveStatus.OPTIMAL
    return Timing(
        name, len(built.row_lower), len(built.cost), int(free.sum()), took_s, float(gap), solved
    )
