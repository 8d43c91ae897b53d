"""The paper's program in a plane and in space: sizes and times of the same decisions.

    python benchmarks/planar_program.py indoor --formulation clique,reach

A planar mission is flown by `milp-mpc-paper`. Decisions are solved twice from the same state, on
one thread and to the same absolute gap, in the plane and, as if there were no table `[planar]`,
in space; which of both comes first alternates. A relative gap would ask more of the form whose
objective happens to be nearer to zero. Times are those of the processor, to write and to solve the
program; a busy machine makes them longer, and their ratio hardly another. Iterations are the
simplex's, which no machine changes. Printed are medians and ranges, and of the ratio of both forms
in a decision.

A waypoint's sphere is approximated from inside by cos(pi / H_WP)^2 of its radius, its circle by
cos(pi / H_WP): waypoints would be larger in the plane, and with them the program. Here they have
the smaller size in both.
"""

from typing import Annotated

import numpy as np
import typer
from rich.console import Console
from rich.table import Table
from uas_coverage_baselines.milp_mpc import MilpMpcPaper
from uas_coverage_baselines.milp_mpc.paper_planner import PaperOptions

from uas_coverage_env import World, load_scenario
from uas_coverage_env.geometry.round_shapes import inner_factor
from uas_coverage_env.mission import MissionBrief
from uas_coverage_env.scenario import Scenario

FIGURES = ("rows", "columns", "whole", "iterations", "processor_s")


def main(
    scenario: Annotated[str, typer.Argument(help="A planar scenario.")],
    decisions: Annotated[int, typer.Option(min=1, help="So many.")] = 20,
    every: Annotated[int, typer.Option(min=1, help="One in so many, from the start.")] = 1,
    horizon: Annotated[int, typer.Option(min=2, help="N.")] = 10,
    gap: Annotated[float, typer.Option(min=0.0, help="Absolute, at which solving ends.")] = 0.01,
    formulation: Annotated[str, typer.Option(help="How the rows are written: NAME,...")] = "clique",
) -> None:
    """Solve the same decisions in the plane and in space."""
    flat = load_scenario(scenario)
    if flat.planar is None:
        raise typer.BadParameter(f"{scenario} is not planar")
    for name in formulation.split(","):
        options = PaperOptions(horizon=horizon, gap=0.0, absolute_gap=gap, formulation=name)
        solved = both(flat, options, decisions, every)
        Console(width=120).print(table(f"{name}, {len(solved)} decisions", solved))


def both(flat: Scenario, options: PaperOptions, decisions: int, every: int) -> np.ndarray:
    """(D, 2, F) figures of the decisions, in the plane and in space."""
    share = inner_factor(options.waypoint_sides, 3) / inner_factor(options.waypoint_sides, 2)
    circles = tuple(
        waypoint.model_copy(update={"radius_m": share * waypoint.radius_m})
        for waypoint in flat.waypoints
    )
    missions = {
        "plane": flat.model_copy(update={"waypoints": circles}),
        "space": flat.model_copy(update={"planar": None}),
    }
    planners = {name: MilpMpcPaper(options) for name in missions}
    for name, mission in missions.items():
        planners[name].reset(MissionBrief.of(mission), 0)
    world, rows = World(flat), []
    for step in range((decisions - 1) * every + 1):
        swarm = world.swarm_state()
        if not swarm.active:
            break
        asked = list(planners) if step % every == 0 else ["plane"]
        order = asked if len(rows) % 2 else asked[::-1]
        commands = {name: planners[name].act(swarm) for name in order}
        programs = [planners[name].last_program for name in asked]
        if len(asked) == 2:
            rows.append([[getattr(program, figure) for figure in FIGURES] for program in programs])
        world.step(commands["plane"])
    return np.array(rows, float)


def table(title: str, solved: np.ndarray) -> Table:
    """Median, and range, of each figure and of its ratio."""
    result = Table("", "plane", "space", "space over plane", title=title)
    for k, figure in enumerate(FIGURES):
        columns = [*solved[..., k].T, solved[:, 1, k] / solved[:, 0, k]]
        result.add_row(
            figure, *(f"{np.median(c):.3g} ({c.min():.3g} to {c.max():.3g})" for c in columns)
        )
    sums = solved[..., FIGURES.index("processor_s")].sum(axis=0)
    result.add_row("sum of processor_s", *(f"{s:.3g}" for s in sums), f"{sums[1] / sums[0]:.3g}")
    return result


if __name__ == "__main__":
    typer.run(main)
