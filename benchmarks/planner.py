"""The planner in figures: formulations of its OCP, its decisions in flight, its growth.

    python benchmarks/planner.py                                  all parts, with short defaults
    python benchmarks/planner.py formulations --which all --cap 60 --plot gaps.png
    python benchmarks/planner.py restricted
    python benchmarks/planner.py joint
    python benchmarks/planner.py closed-loop --planner milp-mpc --steps 400
    python benchmarks/planner.py growth --waypoints 49,100,200,500,1000 --uas 2,4,8,16,32
    python benchmarks/planner.py states                           writes village_decisions.json anew

Exits with 1 where two formulations contradict each other.
"""

import time
from dataclasses import replace
from importlib.util import find_spec
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer
from rich.console import Console
from rich.table import Table
from solver_watch import SECONDS, Watched, watch
from uas_coverage_baselines.milp_mpc import MilpMpc
from uas_coverage_baselines.milp_mpc.model.blocks.coverage import coverable
from uas_coverage_baselines.milp_mpc.model.ocp import formulate
from uas_coverage_baselines.milp_mpc.model.problem import Plan, PlanningProblem
from uas_coverage_baselines.milp_mpc.model.problem_file import read_problems, write_problems
from uas_coverage_baselines.milp_mpc.model.reductions import FORMULATIONS
from uas_coverage_baselines.milp_mpc.model.reductions.formulations import Formulation
from uas_coverage_baselines.milp_mpc.planner import MilpMpcOptions
from uas_coverage_baselines.milp_mpc.search.decision import Effort, decide
from uas_coverage_baselines.milp_mpc.search.heuristic import construct
from uas_coverage_baselines.milp_mpc.search.restricted import RestrictedMilp
from uas_coverage_baselines.milp_mpc.search.trajectories import teams
from uas_coverage_baselines.milp_mpc.solvers import SolverLimits
from uas_coverage_baselines.milp_mpc.solvers.highs import solve

from uas_coverage_env import Flight, generate_scenario, load_planner, load_scenario, rollout
from uas_coverage_env.geometry.round_shapes import inner_factor
from uas_coverage_env.mission import MissionBrief
from uas_coverage_env.scenario import Scenario
from uas_coverage_env.world import SwarmState

DECISIONS = Path(__file__).with_name("village_decisions.json")
STAGES = {"take-off": 0, "built-up": 17, "mid-mission": 60, "return": 140}
"""Of the village's flight: which sample stands for which part of the mission."""
STORED = (0, 17, 35, 60, 95, 109, 125, 140)
_ALL = list(FORMULATIONS)
_CONTRADICTION = 1e-3

app = typer.Typer(invoke_without_command=True, add_completion=False)
console = Console(width=170)

PlannerName = Annotated[str, typer.Option(help="See `uas-coverage planner list`.")]
PlannerOption = Annotated[list[str] | None, typer.Option("--option", help="NAME=VALUE.")]


@app.callback()
def everything(context: typer.Context) -> None:
    """All parts, short."""
    if context.invoked_subcommand is None:
        formulations()
        restricted(which="corner,clique")
        closed_loop(steps=40)
        growth(waypoints="49,200", uas="2,4", steps=10)


@app.command()
def formulations(
    which: Annotated[str, typer.Option(help="Comma-separated names, or `all`.")] = "paper,lift",
    stages: Annotated[str, typer.Option(help="Of the stored flight.")] = ",".join(STAGES),
    cap: Annotated[float, typer.Option(min=0.1, help="Processor seconds each.")] = 5.0,
    plot: Annotated[Path | None, typer.Option(help="Gap over time, as a picture.")] = None,
) -> None:
    """Naive against reduced formulations of the joint OCP, on states from a flight."""
    if plot is not None and find_spec("matplotlib") is None:
        raise typer.BadParameter("needs matplotlib: pip install 'uas-coverage-env[view]'")
    names = _ALL if which == "all" else which.split(",")
    problems = read_problems(DECISIONS)
    runs: dict[str, dict[str, Watched]] = {}
    table = Table(
        *("state", "form", "rows", "cols", "whole", "entries", "build ms", "LP", "first s"),
        *("1% J s", "1% part s", "opt s", "objective", "bound", "gap J", "gap part"),
        title=f"Formulations, capped at {cap:g} s; J: the paper's, part: what a plan influences",
    )
    for stage in stages.split(","):
        problem = problems[STAGES[stage]]
        offset = -formulate(problem)[0].build().constant
        for name in names:
            with console.status(f"{stage}, {name}"):
                cells, watched = _measured(problem, FORMULATIONS[name], offset, cap)
            runs.setdefault(stage, {})[name] = watched
            table.add_row(stage, name, *cells)
        table.add_section()
    console.print(table)
    for name in names:
        console.print(f"{name}: {FORMULATIONS[name].adds}", highlight=False)
    if plot is not None:
        _draw_gaps(runs, plot)
    contradictions = _contradictions(runs)
    for line in contradictions:
        console.print(f"[red]{line}")
    if contradictions:
        raise typer.Exit(1)


def _measured(
    problem: PlanningProblem, formulation: Formulation, offset: float, cap_s: float
) -> tuple[list[str], Watched]:
    """Cells of one row, and how the program was solved."""
    formulation.build(replace(problem))  # compile and warm up
    began = time.process_time()
    built, _ = formulation.build(replace(problem))  # a fresh copy: reachable sets are not known
    build_s = time.process_time() - began
    relaxed = solve(replace(built, integer=np.zeros_like(built.integer)), SolverLimits())
    watched = watch(built, cap_s)
    whole = int((built.integer & (built.lower < built.upper)).sum())
    gap_J, gap_part = watched.gaps(offset)[-1], watched.gaps(0.0)[-1]
    cells = [
        *(f"{n}" for n in (len(built.row_lower), len(built.cost), whole, len(built.column))),
        f"{1e3 * build_s:.0f}",
        f"{relaxed.bound:.1f}",
        _seconds(watched.first_s(), cap_s),
        _seconds(watched.within_one_percent_s(offset), cap_s),
        _seconds(watched.within_one_percent_s(0.0), cap_s),
        _seconds(watched.took_s if watched.optimal else None, cap_s),
        f"{watched.objective:.2f}",
        f"{watched.bound:.2f}",
        _share(gap_J),
        _share(gap_part),
    ]
    return cells, watched


def _seconds(value: float | None, cap_s: float) -> str:
    # HiGHS looks up now and then only: what came after the cap does not count
    return f">{cap_s:g}" if value is None or value > cap_s else f"{value:.2f}"


def _share(gap: float) -> str:
    return "none" if np.isinf(gap) else f"{gap:.0%}" if gap > 1.0 else f"{gap:.2%}"


def _contradictions(runs: dict[str, dict[str, Watched]]) -> list[str]:
    """A bound above another formulation's solution, or a solution that breaks its own rows."""
    lines = []
    for stage, row in runs.items():
        for name, one in row.items():
            if np.isfinite(one.objective) and one.violation > 1e-5:
                lines.append(f"{stage}: {name} breaks its rows by {one.violation:.1e}")
            for other_name, other in row.items():
                if one.bound > other.objective + _CONTRADICTION:
                    lines.append(
                        f"{stage}: {name} proves {one.bound:.4f}, "
                        f"{other_name} has {other.objective:.4f}"
                    )
    return lines


def _draw_gaps(runs: dict[str, dict[str, Watched]], path: Path) -> None:
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    figure, axes = pyplot.subplots(
        1, len(runs), figsize=(3.6 * len(runs), 3.4), sharey=True, squeeze=False, layout="tight"
    )
    for axis, (stage, row) in zip(axes[0], runs.items(), strict=True):
        for name, watched in row.items():
            gap = np.where(watched.gaps(0.0) < 10.0, watched.gaps(0.0), np.nan)
            axis.step(watched.history[:, SECONDS], np.maximum(gap, 1e-2), where="post", label=name)
        axis.set(title=stage, xlabel="processor time [s]", yscale="log", ylim=(8e-3, 12.0))
        axis.set_xlim(left=0.0)
        axis.grid(alpha=0.3)
    axes[0, 0].set_ylabel("gap to what the plan influences")
    axes[0, -1].legend(fontsize="small")
    figure.savefig(path, dpi=120)
    console.print(f"picture: {path}")


@app.command()
def restricted(
    which: Annotated[str, typer.Option(help="Comma-separated names, or `all`.")] = "all",
) -> None:
    """What a decision mostly solves: one UAS's own OCP, restricted to what lies near a flight."""
    table = Table(
        *("form", "programs", "solved", "build ms", "solve ms", "mean objective"),
        title="Programs along constructed flights, 3 teams per stored state; processor time",
    )
    limits = SolverLimits(nodes=60, relative_gap=0.01, absolute_gap=0.05, heuristics=False)
    problems = [_reached(problem) for problem in read_problems(DECISIONS).values()]
    for name in _ALL if which == "all" else which.split(","):
        build_s, solve_s, objectives = [], [], []
        for problem in problems:
            pools = [construct(problem, uas, problem.dt_s) for uas in range(problem.n_uas)]
            best_teams = teams(problem, pools, 3)
            for uas in range(problem.n_uas):
                own = problem.only(uas)
                RestrictedMilp(own, formulation=FORMULATIONS[name])  # compile and warm up
                began = time.process_time()
                program = RestrictedMilp(replace(own), formulation=FORMULATIONS[name])
                build_s.append(time.process_time() - began)
                paths = {team[uas].visit.tobytes(): team[uas] for team in best_teams}
                for flight in paths.values():
                    near = flight.positions_m[None], flight.visit[None]
                    lower, upper = program.bounds_near(*near)
                    start = program.start(*near)
                    began = time.process_time()
                    solution = solve(program.built, limits, start=start, lower=lower, upper=upper)
                    solve_s.append(time.process_time() - began)
                    objectives.append(solution.objective)
        found = np.isfinite(objectives)
        table.add_row(
            *(name, f"{len(found)}", f"{found.sum()}"),
            *(f"{1e3 * np.mean(seconds):.1f}" for seconds in (build_s, solve_s)),
            f"{np.mean(np.array(objectives)[found]):.3f}",
        )
    console.print(table)


@app.command()
def joint(
    which: Annotated[str, typer.Option(help="Forms, comma-separated.")] = "state,clique,lift",
) -> None:
    """What the root of the joint program adds to the team of plans that a decision begins with."""
    names = which.split(",")
    table = Table(
        *("sample", "J of the team", "s"),
        *(head for name in names for head in (f"J, {name}", "gap", "s more")),
        title="Deterministic decisions on the stored states; processor time",
    )
    for step, problem in read_problems(DECISIONS).items():
        problem = _reached(problem)
        cells, alone_s = [f"{step}"], 0.0
        for name in (None, *names):
            effort = Effort(work=5.0, threads=1, joint=name)
            began = time.process_time()
            plan = decide(replace(problem), None, problem.dt_s, effort)
            took_s = time.process_time() - began
            if not isinstance(plan, Plan):
                cells += [plan, "", ""][: 2 if name is None else 3]
                continue
            cells.append(f"{plan.objective:.2f}")
            if name is None:
                alone_s = took_s
            else:
                gap = plan.relative_gap()
                cells.append("none" if gap is None else _share(gap))
            cells.append(f"{took_s - (0.0 if name is None else alone_s):.2f}")
        table.add_row(*cells)
    console.print(table)


def _reached(problem: PlanningProblem) -> PlanningProblem:
    """Without the waypoints that no UAS reaches in time, as the planner has it."""
    kept = np.flatnonzero(coverable(problem).any(axis=(0, 1)))
    return replace(
        problem,
        waypoints_m=problem.waypoints_m[kept],
        waypoint_reach_m=problem.waypoint_reach_m[kept],
        waypoint_weight=problem.waypoint_weight[kept],
        waypoint_index=problem.waypoint_index[kept],
    )


@app.command("closed-loop")
def closed_loop(
    planner: PlannerName = "milp-mpc",
    steps: Annotated[int, typer.Option(min=1)] = 400,
    scenario: Annotated[str, typer.Option(help="Name or file.")] = "village",
    option: PlannerOption = None,
) -> None:
    """Fly a mission and look at the planner's decisions."""
    table = _decision_table(f"Decisions of {planner} in {scenario}, {steps} steps at most")
    flown = load_planner(planner, _options(option))
    with console.status(f"{planner} flies {scenario}"):
        flight = rollout(load_scenario(scenario), flown, max_steps=steps)
    table.add_row(scenario, *_decision_cells(flight, _limit_s(flown)))
    console.print(table)


@app.command()
def growth(
    planner: PlannerName = "milp-mpc",
    waypoints: Annotated[str, typer.Option(help="Numbers, for 2 UAS.")] = "49,100,200,500,1000",
    uas: Annotated[str, typer.Option(help="Numbers, for the first number of waypoints.")] = (
        "2,4,8,16,32"
    ),
    steps: Annotated[int, typer.Option(min=1, help="Decisions per size.")] = 30,
    seed: Annotated[int, typer.Option(min=0)] = 1,
    option: PlannerOption = None,
) -> None:
    """Decision times against the number of waypoints at equal density, and of UAS."""
    waypoint_counts, uas_counts = _numbers(waypoints), _numbers(uas)
    for title, sizes in (
        ("waypoints", [(2, count) for count in waypoint_counts]),
        ("UAS", [(count, max(waypoint_counts[0], 8 * count)) for count in uas_counts]),
    ):
        table = _decision_table(f"{planner} against the number of {title}")
        table.add_column("planned anew")
        p95_s = []
        for n_uas, n_waypoints in sizes:
            flown = load_planner(planner, _options(option))
            town = _town(seed, n_uas, n_waypoints)
            with console.status(town.name):
                anew: list[int] = []
                flight = rollout(
                    *(town, flown),
                    seed=seed,
                    max_steps=steps,
                    on_step=lambda _, flown=flown, anew=anew: anew.append(_planned_anew(flown)),
                )
            table.add_row(
                *(f"{n_uas} UAS, {n_waypoints} waypoints",),
                *_decision_cells(flight, _limit_s(flown)),
                f"{np.mean(anew[1:]):.1f} of {n_uas}",
            )
            p95_s.append(np.percentile([d.duration_s for d in flight.decisions], 95))
        console.print(table)
        console.print(f"p95, last over first: {p95_s[-1] / p95_s[0]:.2f}")


def _town(seed: int, n_uas: int, n_waypoints: int) -> Scenario:
    """A town at the usual density; it may have more waypoints than its batteries can cover."""
    enough = max(n_uas, -(-n_waypoints // 20))
    town = generate_scenario(
        seed, n_uas=min(enough, 64), n_waypoints=n_waypoints, n_obstacles=min(n_waypoints // 5, 400)
    )
    fields: dict[str, Any] = {name: getattr(town, name) for name in type(town).model_fields}
    fields["schema"] = fields.pop("schema_version")
    name = f"town-s{seed}-u{n_uas}-w{n_waypoints}"
    fields |= {"name": name, "uas": town.uas[:n_uas]}
    return Scenario(**fields)


def _decision_table(title: str) -> Table:
    return Table(
        *("flight", "steps", "covered", "p50 s", "p95 s", "p99 s", "max s"),
        *("> limit", "> 1.5 limit", "fallbacks", "violations"),
        title=title,
    )


def _decision_cells(flight: Flight, limit_s: float) -> list[str]:
    times_s = np.array([decision.duration_s for decision in flight.decisions])
    return [
        f"{flight.steps}",
        f"{int(flight.covered[-1])}/{len(flight.scenario.waypoints)}",
        *(f"{value:.3f}" for value in np.percentile(times_s, (50, 95, 99, 100))),
        f"{(times_s > limit_s).mean():.1%}",
        f"{(times_s > 1.5 * limit_s).mean():.1%}",
        f"{sum(decision.fallback for decision in flight.decisions)}",
        f"{len(flight.violations)}",
    ]


def _planned_anew(planner: object) -> int:
    """How many UAS have a new plan from the last decision; planners without plans have none."""
    plan = getattr(planner, "plan", None)
    return 0 if plan is None else len(plan.renewed)


def _limit_s(planner: object) -> float:
    """The planner's own time limit; planners without one are measured against the step of 1 s."""
    return float(getattr(getattr(planner, "options", None), "time_limit_s", None) or 1.0)


def _options(given: list[str] | None) -> dict[str, str]:
    return dict(part.split("=", 1) for part in given or [])


def _numbers(text: str) -> list[int]:
    return [int(part) for part in text.split(",")]


class _Recording(MilpMpc):
    """`milp-mpc` that keeps the problems of some samples, with every open waypoint in them."""

    def reset(self, brief: MissionBrief, seed: int) -> None:
        super().reset(brief, seed)
        self.brief, self.kept = brief, {}

    def problem(self, swarm: SwarmState) -> PlanningProblem:
        problem = super().problem(swarm)
        if swarm.step in STORED:
            self.kept[swarm.step] = _with_all_open(problem, swarm, self.brief)
        return problem


def _with_all_open(
    problem: PlanningProblem, swarm: SwarmState, brief: MissionBrief
) -> PlanningProblem:
    """The problem before waypoints out of reach were left out."""
    left_out = np.setdiff1d(np.flatnonzero(swarm.uncovered), problem.waypoint_index)
    rows = [brief.waypoints[row] for row in left_out]
    factor = inner_factor(problem.waypoint_sides, 3)
    return replace(
        problem,
        waypoints_m=np.vstack([problem.waypoints_m, *(row.position_m for row in rows)]),
        waypoint_reach_m=np.append(
            problem.waypoint_reach_m, [row.radius_m * factor for row in rows]
        ),
        waypoint_weight=np.append(problem.waypoint_weight, [row.weight for row in rows]),
        waypoint_index=np.append(problem.waypoint_index, left_out),
    )


@app.command()
def states() -> None:
    """Fly the village deterministically and store the decisions of some samples."""
    planner = _Recording(MilpMpcOptions())
    rollout(load_scenario("village"), planner, max_steps=max(STORED) + 1)
    problems = [planner.kept[step] for step in STORED]
    write_problems(DECISIONS, "python benchmarks/planner.py states", problems, STORED)
    console.print(f"{DECISIONS.name}: {len(STORED)} decisions")


if __name__ == "__main__":
    app()
