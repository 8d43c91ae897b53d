"""The paper's program in a plane and in space: sizes and times of the same decisions.

    python benchmarks/planar_program.py indoor --decisions 20

A planar mission is flown by `milp-mpc-paper`. Each decision is solved twice from the same state, on
one thread and to the same gap, in the plane and, as if the table `[planar]` were not there, in
space; which of both comes first alternates. Times are those of the processor, to write and to solve
the program. Printed are medians and ranges, and of the ratio of both times of a decision.
"""

from typing import Annotated

import numpy as np
import typer
from rich.console import Console
from rich.table import Table
from uas_coverage_baselines.milp_mpc import MilpMpcPaper
from uas_coverage_baselines.milp_mpc.paper_planner import PaperOptions

from uas_coverage_env import World, load_scenario
from uas_coverage_env.mission import MissionBrief

FIGURES = ("rows", "columns", "whole", "processor_s")


def main(
    scenario: Annotated[str, typer.Argument(help="A planar scenario.")],
    decisions: Annotated[int, typer.Option(min=1, help="So many, from the start.")] = 20,
    horizon: Annotated[int, typer.Option(min=2, help="N.")] = 10,
    gap: Annotated[float, typer.Option(min=0.0, help="Relative, at which solving ends.")] = 0.01,
    formulation: Annotated[str, typer.Option(help="How the rows are written.")] = "clique",
) -> None:
    """Solve the same decisions in the plane and in space."""
    flat = load_scenario(scenario)
    if flat.planar is None:
        raise typer.BadParameter(f"{scenario} is not planar")
    options = PaperOptions(horizon=horizon, gap=gap, absolute_gap=0.0, formulation=formulation)
    planners = {"plane": MilpMpcPaper(options), "space": MilpMpcPaper(options)}
    for name, planner in planners.items():
        mission = flat if name == "plane" else flat.model_copy(update={"planar": None})
        planner.reset(MissionBrief.of(mission), 0)
    world, rows = World(flat), []
    for decision in range(decisions):
        swarm = world.swarm_state()
        if not swarm.active:
            break
        order = list(planners) if decision % 2 else list(planners)[::-1]
        commands = {name: planners[name].act(swarm) for name in order}
        programs = [planner.last_program for planner in planners.values()]
        rows.append([[getattr(program, figure) for figure in FIGURES] for program in programs])
        world.step(commands["plane"])
    table = Table("", "plane", "space", "plane over space")
    for k, figure in enumerate(FIGURES):
        both = np.array(rows, float)[:, :, k]
        columns = [*both.T, both[:, 0] / both[:, 1]]
        table.add_row(
            figure, *(f"{np.median(c):.3g} ({c.min():.3g} to {c.max():.3g})" for c in columns)
        )
    seconds = np.array(rows)[..., FIGURES.index("processor_s")].sum(axis=0)
    table.add_row("sum of processor_s", *(f"{s:.3g}" for s in seconds))
    Console(width=120).print(table)


if __name__ == "__main__":
    typer.run(main)
