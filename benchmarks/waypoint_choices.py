"""What makes a choice of waypoints good: lookahead, learning, or missions tried out before.

    python benchmarks/waypoint_choices.py                        # village and the 20 dev scenarios
    python benchmarks/waypoint_choices.py --seeds 3000:3020 --simulations 0,8,32,128

Flies the village and generated scenarios (see `missions.py`) with `nearest-waypoint`; with the
choice whose greedy rollout is cheapest, home included, which is what the network is told but
without a network; with the network of `learned-waypoint` alone (0 simulations); and with so many
missions simulated before each decision. Differences to `nearest-waypoint` are paired, with 95 %
bootstrap intervals. Decision times are those of all steps; most have nothing to decide.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray
from rich.console import Console
from rich.table import Table
from uas_coverage_agents.training.score import interval
from uas_coverage_agents.waypoint.layout import CANDIDATE, HOME_CHOICE, N_TEAM, TEAM, K
from uas_coverage_agents.waypoint.sub_environments import (
    begin_lanes,
    make_lanes,
    pool_legs,
    step_lanes,
)
from uas_coverage_agents.waypoint.team import ENERGY, LEFT, LOST_UAS, NO_UAS, NOT_HOME, TIME

from uas_coverage_env import Scenario, load_planner, load_scenario, rollout
from uas_coverage_env.autopilot.assist import assistants
from uas_coverage_env.flight.metrics import coverage, energy_Wh, home, percentiles
from uas_coverage_env.leaderboard import seed_range
from uas_coverage_env.scenario import sample_scenario
from uas_coverage_env.simulation.pool import pool_worlds

COLUMNS = ("coverage", "all home", "violations", "breaches", "Wh", "steps", "p95 s", "max s")
WH, STEPS = COLUMNS.index("Wh"), COLUMNS.index("steps")


def flown(scenarios: Sequence[Scenario], name: str, options: dict[str, Any]) -> NDArray:
    """(missions, columns) of a planner."""
    planner = load_planner(name, options)
    rows = []
    for scenario in scenarios:
        flight = rollout(scenario, planner)
        thought_s = percentiles(flight, "duration_s")
        rows.append(
            (
                coverage(flight), home(flight).all(), len(flight.violations), flight.breaches,
                energy_Wh(flight).sum(), flight.steps, thought_s["p95"], thought_s["max"],
            )
        )  # fmt: skip
    return np.array(rows, dtype=np.float64)


def by_greedy_rollout(scenarios: Sequence[Scenario]) -> NDArray:
    """(missions, columns) of who chooses whose greedy rollout is cheapest."""
    worlds, legs = pool_worlds(scenarios), pool_legs(scenarios)
    n = len(scenarios)
    lanes, states = make_lanes(n, worlds)
    covered, discharged = np.zeros(states.uncovered.shape, bool), np.zeros(states.uas.shape)
    each = np.arange(n)
    helped = (True, assistants(True, True))
    begin_lanes(worlds, legs, lanes, states, each, each, covered, discharged, *helped)
    candidate = [feature.name for feature in CANDIDATE.features]
    team = [feature.name for feature in TEAM.features]
    # back to seconds / unit_s, see the scales in the layout
    costs = {"total": 2.0, "longest": 2.0, "left": 5.0 * 120.0 / 8.0}
    home_costs = {"home_total": 5.0, "home_longest": 5.0, "home_left": 5.0 * 120.0 / 8.0}
    while (lanes.decider != NO_UAS).any():
        seen = lanes.observation
        rows = seen[:, N_TEAM:].reshape(n, K, -1)
        cost = np.full((n, K + 1), np.inf)
        cost[:, :K] = sum(scale * rows[..., candidate.index(f)] for f, scale in costs.items())
        cost[:, HOME_CHOICE] = sum(
            scale * seen[:, team.index(f)] for f, scale in home_costs.items()
        )
        choices = np.where(lanes.legal, cost, np.inf).argmin(axis=1)
        step_lanes(worlds, legs, lanes, states, choices, *helped)
    account = lanes.account
    n_waypoints = np.array([len(scenario.waypoints) for scenario in scenarios])
    return np.column_stack(
        [
            1.0 - account[:, LEFT] / n_waypoints, account[:, NOT_HOME] == 0,
            account[:, LOST_UAS], np.full(n, np.nan), account[:, ENERGY], account[:, TIME],
            np.full(n, np.nan), np.full(n, np.nan),
        ]
    )  # fmt: skip


def table(title: str, flights: dict[str, NDArray]) -> Table:
    """Means, and the differences to the first."""
    table = Table(title=title)
    for column in ("", *COLUMNS, "Wh, % of the first's", "steps, % of the first's"):
        table.add_column(column, justify="right" if column else "left")
    first = next(iter(flights.values()))
    for name, rows in flights.items():
        cells = ["" if np.isnan(value) else f"{value:.4g}" for value in rows.mean(axis=0)]
        for column in (WH, STEPS):
            change = interval(
                100.0 * (rows[:, column] - first[:, column]) / first[:, column].mean()
            )
            cells.append(f"{change.mean:+.1f} [{change.low:+.1f}, {change.high:+.1f}]")
        table.add_row(name, *cells)
    return table


def main(argv: Sequence[str] | None = None) -> int:
    """Fly and print; the exit code."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--seeds", default="2000:2020", help="FIRST:END")
    parser.add_argument("--simulations", default="0,32", help="how many; default 0,32")
    parser.add_argument("--filter", default="true", help="false: fly without the safety filter")
    arguments = parser.parse_args(argv)
    towns = [sample_scenario(seed) for seed in seed_range("--seeds", arguments.seeds)]
    console = Console(width=170)
    for title, scenarios in (("village", [load_scenario("village")]), ("generated", towns)):
        options = {"filter": arguments.filter}
        flights = {"nearest-waypoint": flown(scenarios, "nearest-waypoint", options)}
        if arguments.filter == "true":
            flights["greedy rollout, not learned"] = by_greedy_rollout(scenarios)
        for number in arguments.simulations.split(","):
            name = f"learned-waypoint, {number} simulations"
            choice = {**options, "simulations": number}
            flights[name] = flown(scenarios, "learned-waypoint", choice)
        console.print(table(f"{title}: {len(scenarios)} missions", flights))
    return 0


if __name__ == "__main__":
    sys.exit(main())
