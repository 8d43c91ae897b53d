"""Obstacles only where they are met: solve without, look, add what the flight touches, again.

Leaving out an obstacle's rows gives a relaxation: its optimum is a lower bound of the OCP's. If the
relaxation's best flight keeps clear of what was left out (over each interval some face of each
obstacle separates, which is all that its rows ask), it is feasible for the OCP, with the same
objective, because those rows' columns cost nothing: so it is optimal there too. If not, the
obstacles that it touches are added. Each round adds at least one, so that it ends; at the latest
with all of them, which is the OCP itself. With a time limit, too, the bound of every round holds.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

from uas_coverage_baselines.milp_mpc.model.blocks.separation import from_obstacles
from uas_coverage_baselines.milp_mpc.model.milp import BuiltMilp
from uas_coverage_baselines.milp_mpc.model.problem import PlanningProblem, Variables
from uas_coverage_baselines.milp_mpc.model.reductions.formulations import Formulation
from uas_coverage_baselines.milp_mpc.solvers.interface import Solution


@dataclass(frozen=True)
class LazySolution:
    """A solution of the OCP, and what it took.

    Attributes:
        solution: of the last round; its values, where it has any, keep clear of all obstacles.
        variables: the shared columns of the last round's program.
        obstacles: names of the obstacles whose rows were needed.
        rounds: how many programs were solved.
    """

    solution: Solution
    variables: Variables
    obstacles: tuple[str, ...]
    rounds: int


def solve_lazily(
    problem: PlanningProblem,
    formulation: Formulation,
    solve: Callable[[BuiltMilp], Solution],
) -> LazySolution:
    """Solve the OCP with the rows of those fixed obstacles only that flights meet.

    Args:
        problem: the decision.
        formulation: how its programs are written.
        solve: solves one program.
    """
    everything = list(from_obstacles(problem))
    row_of = {name: row for row, (name, _) in enumerate(problem.obstacles)}
    rows: list[int] = []
    rounds = 0
    while True:
        rounds += 1
        built, v = formulation.build(with_obstacles(problem, rows))
        solution = solve(built)
        touched = []
        if solution.values is not None:
            positions = solution.values[v.position]
            touched = [
                row_of[separation.name]
                for separation in everything
                if row_of[separation.name] not in rows and not separation.is_kept(positions)
            ]
        if not touched:
            names = tuple(problem.obstacles[row][0] for row in rows)
            return LazySolution(solution, v, names, rounds)
        rows = sorted(rows + touched)


def with_obstacles(problem: PlanningProblem, rows: list[int]) -> PlanningProblem:
    """The same decision with some of its fixed obstacles."""
    return replace(
        problem,
        obstacles=tuple(problem.obstacles[row] for row in rows),
        obstacle_clearance_m=problem.obstacle_clearance_m[:, rows],
    )
