"""The solvers on the same programs: how long each takes to the same gap.

    python benchmarks/solvers.py
    python benchmarks/solvers.py --gap 0.01 --cap 60 --every 1

Programs are each UAS's own of the decisions in `village_decisions.json`, every whole column free,
in the form that a decision takes (`clique`), with waypoints left out, the farthest first, until
gurobipy's free licence allows it. Times are of the processor, on one thread, making the model
included.
"""

import time
from dataclasses import replace
from pathlib import Path
from typing import Annotated

import numpy as np
import typer
from rich.console import Console
from rich.progress import track
from uas_coverage_baselines.milp_mpc.model.problem import PlanningProblem
from uas_coverage_baselines.milp_mpc.model.problem_file import read_problems
from uas_coverage_baselines.milp_mpc.search.restricted import TIGHTEST, RestrictedMilp
from uas_coverage_baselines.milp_mpc.solvers import SOLVERS, SolverLimits, solver_named

DECISIONS = Path(__file__).with_name("village_decisions.json")
FREE = 2000
"""Rows, and columns, that gurobipy's free licence allows."""


def small(problem: PlanningProblem) -> RestrictedMilp | None:
    """One UAS's program with as many of the nearest waypoints as the free licence allows."""
    away_m = np.linalg.norm(problem.waypoints_m - problem.x0[0, :3], axis=1)
    nearest = np.argsort(away_m, kind="stable")
    targets = tuple(t if t is None else replace(t, waypoint=None) for t in problem.targets)
    for many in range(len(nearest), -1, -1):
        kept = np.sort(nearest[:many])
        few = replace(
            problem,
            targets=targets,
            waypoints_m=problem.waypoints_m[kept],
            waypoint_reach_m=problem.waypoint_reach_m[kept],
            waypoint_weight=problem.waypoint_weight[kept],
            waypoint_index=problem.waypoint_index[kept],
        )
        program = RestrictedMilp(few, first=TIGHTEST)
        if max(len(program.built.row_lower), len(program.built.cost)) <= FREE:
            return program
    return None


def main(
    gap: Annotated[float, typer.Option(help="Relative; solved until it is proven.")] = 0.05,
    cap: Annotated[float, typer.Option(help="Most seconds of a solve, on the clock.")] = 30.0,
    every: Annotated[
        int, typer.Option(help="Of the recorded decisions, each so-and-so-many-th.")
    ] = 2,
) -> None:
    """Solve and print the table."""
    steps = list(read_problems(DECISIONS).items())[::every]
    programs = [(step, u, problem.only(u)) for step, problem in steps for u in range(problem.n_uas)]
    lines = [
        "| sample, UAS | rows | whole | " + " | ".join(f"`{name}`, s" for name in SOLVERS) + " |"
    ]
    lines.append("| --- | ---: | ---: |" + " ---: |" * len(SOLVERS))
    limits = SolverLimits(time_s=cap, relative_gap=gap, absolute_gap=1e-6)
    unit_s: list[float] = []  # of HiGHS, per iteration and row: what work is counted by
    times: dict[str, list[float]] = {name: [] for name in SOLVERS}
    for step, uas, problem in track(programs, console=Console(stderr=True)):
        program = small(problem)
        if program is None:  # too many rows of obstacles
            continue
        cells = []
        for name in SOLVERS:
            began = time.process_time()
            solution = solver_named(name)(program.built, limits)
            took_s = time.process_time() - began
            if name == "highs":
                unit_s.append(took_s / max(solution.iterations * len(program.built.row_lower), 1))
            missing = (solution.objective - solution.bound) / max(abs(solution.objective), 1e-9)
            reached = (
                missing <= gap * 1.05 + 1e-9
            )  # of the objective or of the bound, as they have it
            times[name].append(took_s if reached else np.inf)
            cells.append(
                f"{took_s:.2f}" if reached else f"{100 * missing:.0f} % left at {took_s:.0f}"
            )
        free = int((program.built.integer & (program.built.lower < program.built.upper)).sum())
        lines.append(
            f"| {step}, {uas + 1} | {len(program.built.row_lower)} | {free} | "
            + " | ".join(cells)
            + " |"
        )
    medians = " | ".join(f"{np.median(times[name]):.2f}" for name in SOLVERS)
    lines.append(f"| median of {len(times['highs'])} | | | {medians} |")
    lines.append(
        f"\nHiGHS: {1e9 * np.median(unit_s):.0f} ns per simplex iteration and row (median)"
    )
    print("\n".join(lines))


if __name__ == "__main__":
    typer.run(main)
