"""A whole mission of the paper's program: sizes, times and gaps of every decision.

    python benchmarks/paper_program.py 3:4:1 --out town
    python benchmarks/paper_program.py village --out village --option gap=0.02 --option threads=2

Solutions are kept in DIR/solutions as they come: the same command goes on where it was stopped
(Ctrl-C), and `--page` puts its tables between the marks of a page, one line for every decision or
for `--every` so many. DIR/flight is the flight's directory, DIR/steps.csv what was solved,
DIR/page.md the tables.
Exits with 1 where the mission is not accomplished or a decision was flown without a solution.
"""

import csv
import json
from collections.abc import Callable
from dataclasses import asdict, fields
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer
from marks import filled
from rich.console import Console
from uas_coverage_baselines.milp_mpc import MilpMpcPaper
from uas_coverage_baselines.milp_mpc.fallback.reasons import Reason
from uas_coverage_baselines.milp_mpc.model.problem import Plan, PlanningProblem
from uas_coverage_baselines.milp_mpc.paper_planner import PaperOptions, SolvedProgram
from uas_coverage_baselines.milp_mpc.solvers.interface import SolveStatus

from uas_coverage_env import Flight, generate_scenario, load_planner, load_scenario, rollout
from uas_coverage_env.files.strict_toml import InputError
from uas_coverage_env.flight.metrics import accomplished, energy_Wh
from uas_coverage_env.scenario import Scenario

MARK = "the paper's program, {mission}"
console = Console(width=150)


class Resumable(MilpMpcPaper):
    """`milp-mpc-paper` that keeps its solutions, and takes those that are kept.

    Args:
        options: of the planner.
        folder: of the solutions.
    """

    def __init__(self, options: PaperOptions, folder: Path) -> None:
        super().__init__(options)
        self.folder, self.programs = folder, dict[int, SolvedProgram]()

    def solved(self, problem: PlanningProblem, step: int) -> Plan | Reason:
        """The kept solution of the step, or a new one that is kept."""
        path = self.folder / f"{step:04d}.npz"
        if path.is_file():
            found = self._kept(path, problem)
        else:
            found = super().solved(problem, step)
            if isinstance(found, Plan) and self.last_program is not None:
                self._keep(path, found, self.last_program)
        if self.last_program is not None:
            self.programs[step] = self.last_program
        return found

    def _keep(self, path: Path, plan: Plan, program: SolvedProgram) -> None:
        arrays: dict[str, Any] = {name: getattr(plan, name) for name in ("x", "u", "covers")}
        unfinished = path.with_suffix(".unfinished.npz")
        np.savez_compressed(unfinished, program=json.dumps(asdict(program)), **arrays)
        unfinished.replace(path)

    def _kept(self, path: Path, problem: PlanningProblem) -> Plan:
        with np.load(path, allow_pickle=False) as kept:
            plan = {name: kept[name] for name in ("x", "u", "covers")}
            told = json.loads(str(kept["program"]))
        if plan["x"].shape[0] != problem.n_uas or np.abs(plan["x"][:, 0] - problem.x0).max() > 1e-9:
            raise InputError(f"{path} is the solution of another flight; give another --out")
        program = SolvedProgram(**told | {"status": SolveStatus(told["status"])})
        self.last_program = program
        return Plan(problem.names, **plan, objective=program.objective, bound=program.bound)


def mission_of(text: str) -> Scenario:
    """A shipped scenario, a file, or SEED:WAYPOINTS:OBSTACLES of a town of two UAS."""
    parts = text.split(":")
    if len(parts) == 3 and all(part.isdigit() for part in parts):
        seed, waypoints, obstacles = map(int, parts)
        return generate_scenario(seed, n_uas=2, n_waypoints=waypoints, n_obstacles=obstacles)
    return load_scenario(text)


def table_of(rows: list[dict[str, Any]]) -> str:
    """One line per decision."""
    heads = ["step", "open", "modes", "rows", "columns", "whole", "J", "bound", "gap, %"]
    heads += ["processor time, s"]
    lines = ["| " + " | ".join(heads) + " |", "|---|---|---|" + "---:|" * (len(heads) - 3)]
    for row in rows:
        cells = [row["step"], row["open"], row["modes"], row["rows"], row["columns"], row["whole"]]
        cells += [f"{row['objective']:.2f}", f"{row['bound']:.2f}", _percent(row["gap"])]
        cells += [f"{row['processor_s']:.1f}"]
        lines.append("| " + " | ".join(map(str, cells)) + " |")
    return "\n".join(lines)


def short_table_of(rows: list[dict[str, Any]], every: int) -> str:
    """One line for so many decisions: median (most)."""
    cells_of: dict[str, Callable[[dict[str, Any]], float | None]] = {
        "rows": lambda row: row["rows"],
        "columns": lambda row: row["columns"],
        "whole": lambda row: row["whole"],
        "gap, %": lambda row: None if row["gap"] is None else round(100.0 * row["gap"], 2),
        "processor time, s": lambda row: round(row["processor_s"], 1),
    }
    heads = ["steps", "open", *cells_of]
    lines = ["| " + " | ".join(heads) + " |", "|---|---|" + "---:|" * len(cells_of)]
    for first in range(0, len(rows), every):
        some = rows[first : first + every]
        cells = [f"{some[0]['step']}–{some[-1]['step']}", f"{some[0]['open']}–{some[-1]['open']}"]
        for value_of in cells_of.values():
            values = [value for value in map(value_of, some) if value is not None]
            cells.append(f"{np.median(values):.4g} ({max(values):g})" if values else "–")
        lines.append("| " + " | ".join(cells) + " |")
    return "\n".join(lines)


def _percent(gap: float | None) -> str:
    return "–" if gap is None else f"{100.0 * gap:.2f}"


def summary_of(flight: Flight, rows: list[dict[str, Any]]) -> str:
    """The flight in a few lines."""
    options = flight.planner_options
    busy = np.array([row["processor_s"] for row in rows])
    gaps = np.array([row["gap"] for row in rows if row["gap"] is not None])
    fallbacks = sum(decision.fallback for decision in flight.decisions)
    covered, total = int(flight.covered[-1]), len(flight.scenario.waypoints)
    return "\n".join(
        (
            f"{flight.scenario.name}, N = {options['horizon']}, formulation "
            f"`{options['formulation']}`, {options['solver']} on {options['threads']} thread(s), "
            f"asked for a gap of {100.0 * options['gap']:g} % or {options['absolute_gap']:g}.",
            "",
            f"- {covered} of {total} waypoints, {flight.steps} steps, "
            f"{energy_Wh(flight).sum():.2f} Wh, {len(flight.violations)} violations, "
            f"{flight.breaches} breaches, {fallbacks} decisions without a solution; "
            + ("accomplished" if accomplished(flight) else "not accomplished"),
            f"- processor time: {busy.sum():.0f} s, of a decision {np.median(busy):.1f} s in the "
            f"median and {busy.max():.1f} s at most",
            f"- gap: {_percent(float(np.median(gaps)))} % in the median, "
            f"{_percent(float(gaps.max()))} % at most",
        )
    )


def main(
    mission: Annotated[str, typer.Argument(help="Name, file, or SEED:WAYPOINTS:OBSTACLES.")],
    out: Annotated[Path, typer.Option(help="Folder of solutions, flight and tables.")],
    option: Annotated[list[str] | None, typer.Option(help="NAME=VALUE of the planner.")] = None,
    steps: Annotated[int | None, typer.Option(min=1, help="Stop after so many.")] = None,
    page: Annotated[Path | None, typer.Option(help="Page whose marks are filled.")] = None,
    mark: Annotated[str, typer.Option(help="Which; default: of the mission.")] = "",
    every: Annotated[int, typer.Option(min=1, help="Decisions per line of the page.")] = 1,
) -> None:
    """Fly a mission with `milp-mpc-paper` and tell every decision."""
    scenario = mission_of(mission)
    given = {name: value for name, _, value in (part.partition("=") for part in option or [])}
    options = load_planner("milp-mpc-paper", given).options  # pyrefly: ignore[missing-attribute]
    folder = out / "solutions"
    folder.mkdir(parents=True, exist_ok=True)
    told = json.dumps({"mission": mission, "options": options.model_dump(mode="json")}, indent=1)
    asked = out / "asked.json"
    if asked.is_file() and asked.read_text(encoding="utf-8") != told:
        raise InputError(f"{asked} is of a flight with other options; give another --out")
    asked.write_text(told, encoding="utf-8")
    planner = Resumable(options, folder)
    modes: dict[int, str] = {}
    names = [uas.name for uas in scenario.uas]

    def tell(progress: Any) -> None:
        step = progress.swarm.step - 1
        program = planner.programs.get(step)
        if program is not None:
            modes[step] = ", ".join(planner.mode(name) for name in names)
            console.print(
                f"step {step}: {progress.covered} covered, {program.rows} rows, {program.whole} "
                f"whole, J {program.objective:.2f}, bound {program.bound:.2f}, "
                f"{program.processor_s:.1f} s, {program.status}",
                highlight=False,
            )

    flight = rollout(scenario, planner, max_steps=steps, on_step=tell)
    total = len(scenario.waypoints)
    rows = [
        asdict(program)
        | {
            "open": total - int(flight.covered[step]),
            "modes": modes[step],
            "gap": flight.decisions[step].mip_gap,
        }
        for step, program in planner.programs.items()
        if step in modes
    ]
    flight.save(out / "flight", overwrite=True)
    with (out / "steps.csv").open("w", newline="", encoding="utf-8") as file:
        heads = [one.name for one in fields(SolvedProgram)]
        writer = csv.DictWriter(file, [*heads, "open", "modes", "gap"])
        writer.writeheader()
        writer.writerows(rows)
    summary, table = summary_of(flight, rows), table_of(rows)
    (out / "page.md").write_text(f"{summary}\n\n{table}\n", encoding="utf-8")
    console.print(summary, highlight=False)
    if page is not None:
        text = f"{summary}\n\n{table if every == 1 else short_table_of(rows, every)}\n"
        where = MARK.format(mission=mark or mission)
        try:
            text = filled(page.read_text(encoding="utf-8"), text, where)
        except ValueError as error:
            raise InputError(f"{page} {error}") from error
        page.write_text(text, encoding="utf-8")
    if not accomplished(flight) or any(decision.fallback for decision in flight.decisions):
        raise typer.Exit(1)


if __name__ == "__main__":
    try:
        typer.run(main)
    except InputError as error:
        console.print(f"error: {error}", highlight=False)
        raise SystemExit(2) from None
