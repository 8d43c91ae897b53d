"""The tour planner's order: our annealing beside OR-tools routing, in equal time; and flown.

    python benchmarks/tour.py
    PYTHONPATH=ORTOOLS_FOLDER python benchmarks/tour.py --seconds 5 --fly

where ORTOOLS_FOLDER holds OR-tools (`pip install --no-deps --target ORTOOLS_FOLDER ortools absl-py
protobuf immutabledict`), so that the project's own environment needs no more. Without it ours is
measured alone.

Both solve the same problem: the longest flight of the swarm in seconds, plus 0.4 of the sum of all,
on the same legs, with the same batteries, judged by the same function. OR-tools' arc costs cannot
hold what setting off costs; it minimises the sum of its arcs and a cost of the longest route (a
global span), with guided local search.

With --fly the order of either is flown by `tour`, which searches no other before take-off; on
events in flight it searches on from the order that it was given.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Sequence
from dataclasses import replace
from typing import Annotated

import numpy as np
import typer
from numpy.typing import NDArray
from rich.console import Console
from rich.table import Table
from uas_coverage_baselines.tour import Tour
from uas_coverage_baselines.tour.schedule import Schedule, View
from uas_coverage_baselines.tour.tour_flight import TourFlight

from uas_coverage_env import MissionBrief, Scenario, load_scenario
from uas_coverage_env.files.strict_toml import InputError
from uas_coverage_env.flight import rollout
from uas_coverage_env.flight.metrics import energy_Wh
from uas_coverage_env.leaderboard import seed_range
from uas_coverage_env.mission import first_sight
from uas_coverage_env.planning.routing import (
    Routes,
    RoutingProblem,
    SearchEffort,
    empty_routes,
    improve_routes,
)
from uas_coverage_env.scenario import sample_scenario
from uas_coverage_env.simulation import World

_MOVES_AT_ONCE = 250_000
_PER_SECOND = 10  # OR-tools counts in whole numbers
_SUM_TO_LONGEST = (2, 5)  # 0.4 of the sum for once the longest, as in `SearchEffort`
_LEFT_OUT_S = 120  # for a waypoint of weight 1, as in our search


def problem(scenario: Scenario) -> RoutingProblem:
    """The routing problem before take-off, nothing blocked."""
    swarm = World(scenario).swarm_state()
    all_uas = np.ones(len(swarm.names), np.bool_)
    view = View(
        x=swarm.x,
        may_work=all_uas,
        flies=all_uas,
        uncovered=swarm.uncovered,
        blocked=np.zeros_like(swarm.uncovered),
        time_s=0.0,
    )
    return Schedule(MissionBrief.of(scenario), SearchEffort(0)).problem(view)


def annealed(task: RoutingProblem, seconds: float) -> Routes:
    """Our search: as many anneals as the time allows, the best of them."""
    moves, best, until = _MOVES_AT_ONCE, empty_routes(task.n_uas), time.perf_counter() + seconds
    seed = 0
    while (left_s := until - time.perf_counter()) > 0.0:
        started = time.perf_counter()
        order = improve_routes(task, empty_routes(task.n_uas), SearchEffort(moves), seed)
        best = min(best, order, key=lambda o: o.cost_s)
        took_s = time.perf_counter() - started
        # one long anneal is worth more than many short ones
        moves = int(min(moves * max(left_s - took_s, 0.0) / took_s, 3_000_000))
        seed += 1
        if moves < _MOVES_AT_ONCE // 10:
            break
    return best


def judged(task: RoutingProblem, routes: Sequence[NDArray[np.int64]]) -> Routes:
    """Routes as an order, with what our search says that they take and cost.

    Open waypoints on no route are left out, at the cost that leaving them out has in the search.
    """
    left_out = np.setdiff1d(task.open_waypoints, np.concatenate(routes))
    order = replace(empty_routes(task.n_uas), routes=tuple(routes), left_out=left_out)
    return improve_routes(task, order, SearchEffort(0), 0)


def routed(task: RoutingProblem, seconds: float) -> Routes:
    """OR-tools: one vehicle per UAS, from where it is, to its start."""
    from ortools.constraint_solver import pywrapcp, routing_enums_pb2

    U, W = task.n_uas, task.n_waypoints
    starts, ends = [W + u for u in range(U)], [W + U + u for u in range(U)]
    manager = pywrapcp.RoutingIndexManager(W + 2 * U, U, starts, ends)
    routing = pywrapcp.RoutingModel(manager)
    evaluators = []
    for u in range(U):
        arcs = np.zeros((W + 2 * U, W + 2 * U))
        arcs[:W, :W] = task.between_s[task.uas["kind"][u]]
        arcs[W + u, :W] = task.first_s[u]
        arcs[:W, W + U + u] = task.home_s[u]
        arcs[W + u, W + U + u] = task.uas["idle_s"][u]
        whole = np.rint(_PER_SECOND * arcs).astype(int)
        evaluators.append(routing.RegisterTransitMatrix(whole.tolist()))
        weighted = routing.RegisterTransitMatrix((_SUM_TO_LONGEST[0] * whole).tolist())
        routing.SetArcCostEvaluatorOfVehicle(weighted, u)
    budget = np.maximum(_PER_SECOND * task.uas["budget_s"], 0.0).astype(int).tolist()
    routing.AddDimensionWithVehicleTransitAndCapacity(evaluators, 0, budget, True, "time")
    routing.GetDimensionOrDie("time").SetGlobalSpanCostCoefficient(_SUM_TO_LONGEST[1])
    parameters = pywrapcp.DefaultRoutingSearchParameters()
    parameters.first_solution_strategy = (
        routing_enums_pb2.FirstSolutionStrategy.PARALLEL_CHEAPEST_INSERTION
    )
    parameters.local_search_metaheuristic = (
        routing_enums_pb2.LocalSearchMetaheuristic.GUIDED_LOCAL_SEARCH
    )
    parameters.time_limit.FromMilliseconds(round(1000 * seconds))
    for w in range(W):  # to leave a waypoint out costs what it costs in our search
        worth = _LEFT_OUT_S * task.weight[w] * _PER_SECOND * _SUM_TO_LONGEST[1]
        routing.AddDisjunction([manager.NodeToIndex(w)], round(worth))
    solution = routing.SolveWithParameters(parameters)
    if solution is None:
        return judged(task, [np.zeros(0, np.int64)] * U)
    routes = []
    for u in range(U):
        index, route = solution.Value(routing.NextVar(routing.Start(u))), []
        while not routing.IsEnd(index):
            route.append(manager.IndexToNode(index))
            index = solution.Value(routing.NextVar(index))
        routes.append(np.array(route, np.int64))
    return judged(task, routes)


class _Ordered(Tour):
    """`tour` with an order that is given."""

    def __init__(self, order: Routes) -> None:
        super().__init__()
        self._given = order

    def reset(self, brief: MissionBrief, seed: int) -> None:
        super().reset(brief, seed)
        assert isinstance(self.flight, TourFlight)
        view = self.flight._view(first_sight(brief))
        self.flight.schedule.take(self._given, view)


def main(
    seeds: Annotated[str, typer.Option(help="FIRST:END of generated scenarios.")] = "2000:2020",
    village: Annotated[bool, typer.Option(help="The village too.")] = True,
    seconds: Annotated[float, typer.Option(min=0.1, help="Time of each search.")] = 5.0,
    fly: Annotated[bool, typer.Option(help="Fly the orders.")] = False,
) -> None:
    """Compare orders, predicted and flown."""
    try:
        import ortools

        solvers = {"annealing": annealed, f"OR-tools {ortools.__version__}": routed}
    except ImportError:
        solvers = {"annealing": annealed}
    scenarios = [load_scenario("village")] if village else []
    scenarios += [sample_scenario(seed) for seed in seed_range("--seeds", seeds)]
    table = Table(title=f"Orders found in {seconds:g} s each")
    for column in ("scenario", "search", "cost [s]", "longest [s]", "sum [s]", "steps", "Wh"):
        table.add_column(column)
    costs: dict[str, list[float]] = {name: [] for name in solvers}
    for scenario in scenarios:
        task = problem(scenario)
        for name, solve in solvers.items():
            order = solve(task, seconds)
            costs[name].append(order.cost_s)
            row = [scenario.name, name, f"{order.cost_s:.1f}", f"{order.seconds.max():.1f}"]
            row.append(f"{order.seconds.sum():.1f}")
            if fly:
                flight = rollout(scenario, _Ordered(order))
                row += [str(flight.steps), f"{energy_Wh(flight).sum():.2f}"]
            table.add_row(*row)
    console = Console()
    console.print(table)
    ours = np.array(costs["annealing"])
    for name, values in costs.items():
        ratio = np.array(values) / ours
        console.print(
            f"{name}: {ratio.mean():.4f} of annealing's cost on average, "
            f"{ratio.min():.4f} to {ratio.max():.4f}"
        )


if __name__ == "__main__":
    app = typer.Typer(add_completion=False, pretty_exceptions_enable=False)
    app.command()(main)
    try:
        app()
    except InputError as error:
        sys.stderr.write(f"error: {error}\n")
        sys.exit(2)
