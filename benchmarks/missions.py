"""Missions on generated scenarios, one planner: how they end, what they take.

    python benchmarks/missions.py --planner milp-mpc --seeds 0:10

Scenario number s has 1 + s mod 4 UAS. Exits with 1 where a flight has a violation or a breach.
"""

import time
from typing import Annotated

import typer
from rich.console import Console
from rich.table import Table

from uas_coverage_env import Flight, generate_scenario, load_planner, rollout
from uas_coverage_env.flight import summary


def main(
    planner: Annotated[str, typer.Option(help="See `uas-coverage planners`.")] = "milp-mpc",
    seeds: Annotated[str, typer.Option(help="FIRST:END of the scenarios' seeds.")] = "0:10",
    waypoints: Annotated[int, typer.Option(min=1, help="Waypoints of each scenario.")] = 20,
    obstacles: Annotated[int, typer.Option(min=0, help="Fixed obstacles of each.")] = 6,
) -> None:
    """Fly one planner on generated scenarios and print a table."""
    first, end = (int(part) for part in seeds.split(":"))
    table = Table(
        *("seed", "UAS", "covered", "steps", "Wh", "home", "violations", "breaches"),
        *("fallbacks", "p50 s", "p95 s", "wall s"),
    )
    console = Console()
    clean = True
    for seed in range(first, end):
        scenario = generate_scenario(
            seed, n_uas=1 + seed % 4, n_waypoints=waypoints, n_obstacles=obstacles
        )
        began = time.perf_counter()
        with console.status(f"seed {seed}"):
            flight = rollout(scenario, load_planner(planner), seed=seed)
        row = _row(seed, flight, time.perf_counter() - began)
        table.add_row(*row)
        console.print("  ".join(row), highlight=False)
        clean = clean and not flight.violations and flight.breaches == 0
    console.print(table)
    raise typer.Exit(0 if clean else 1)


def _row(seed: int, flight: Flight, wall_s: float) -> list[str]:
    result = summary(flight)
    times = result["decision_time_s"]
    return [
        str(seed),
        str(len(flight.names)),
        f"{result['coverage']:.0%}",
        str(flight.steps),
        f"{result['energy_Wh']:.2f}",
        "all" if result["all_home"] else "no",
        str(len(flight.violations)),
        str(flight.breaches),
        str(result["fallbacks"]),
        f"{times['p50']:.2f}",
        f"{times['p95']:.2f}",
        f"{wall_s:.0f}",
    ]


if __name__ == "__main__":
    typer.run(main)
