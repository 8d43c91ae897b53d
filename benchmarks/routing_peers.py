"""The order search beside OR-Tools and PyVRP, on the same leg times.

    python -m pip install ortools pyvrp      two libraries that only this benchmark needs
    python benchmarks/routing_peers.py
    python benchmarks/routing_peers.py --sizes 2x50,1x1000 --seconds 20

A size is UAS x waypoints of a generated town. All minimise the same: the longest flight plus
`weight` times the sum of all. The libraries know arcs, not turns; so turns are free for all first.
PyVRP has no term for the longest flight and is asked where there is one UAS. Reported is the
processor time until the order costs at most 1 % (5 %) more than the best that any has found, of our
search of the shortest search that ends there, the number of its moves being doubled; and what the
last orders cost once turns are counted.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from typing import Annotated, Any, NamedTuple

import numpy as np
import typer
from numpy.typing import NDArray
from rich.console import Console
from rich.table import Table
from scale import town

from uas_coverage_env import MissionBrief
from uas_coverage_env.files.strict_toml import InputError
from uas_coverage_env.mission import first_sight
from uas_coverage_env.planning.reserves import TRAJECTORY
from uas_coverage_env.planning.routing import (
    Routes,
    RoutingProblem,
    SearchEffort,
    empty_routes,
    improve_routes,
)
from uas_coverage_env.planning.routing.terrain import Terrain

console = Console(width=130)
_MS = 1000.0
SECONDS, COST = range(2)
_FIRST_MOVES, _MOST_MOVES = 5_000, 20_000_000
_GAPS = 0.01, 0.05
_PER_BATTERY = 25  # waypoints


class Found(NamedTuple):
    """What a solver has found.

    Attributes:
        trace: (K, 2) processor `SECONDS` and `COST` [s], of better and better orders.
        routes: Of the last one.
    """

    trace: NDArray[np.float64]
    routes: list[list[int]]


def problem_of(n_uas: int, n_waypoints: int, seed: int) -> RoutingProblem:
    """The routing problem of a town before take-off; batteries are not what is compared."""
    enough = max(n_uas, -(-n_waypoints // _PER_BATTERY))
    brief = MissionBrief.of(town(enough, n_waypoints, seed))
    works = np.ones(enough, np.bool_)
    problem = RoutingProblem.seen(brief, first_sight(brief), Terrain(brief), works, TRAJECTORY)
    per_uas = "uas", "first_s", "home_s", "turn_s", "forbidden"
    fewer = {name: getattr(problem, name)[:n_uas] for name in per_uas}
    return problem.replace(**fewer).replace(budget_s=np.full(n_uas, 1e6))


def own(problem: RoutingProblem, weight: float, seconds: float, seed: int) -> Found:
    """Searches of this package, each twice as long as the one before."""
    trace: list[tuple[float, float]] = []
    best, moves = None, _FIRST_MOVES
    improve_routes(problem, empty_routes(problem.n_uas), SearchEffort(10, by_pieces=True), 0)
    while moves < _MOST_MOVES:
        began = time.process_time()

        def told(order: Routes, began: float = began) -> None:
            trace.append((time.process_time() - began, order.cost_s))

        effort = SearchEffort(moves, total_weight=weight, by_pieces=True)
        order = improve_routes(problem, empty_routes(problem.n_uas), effort, seed, told)
        if best is None or order.cost_s < best.cost_s:
            best = order
        if time.process_time() - began > 0.5 * seconds:
            break
        moves *= 2
    assert best is not None
    return Found(np.array(trace), [route.tolist() for route in best.routes])


def _arcs_s(problem: RoutingProblem, uas: int) -> NDArray[np.float64]:
    """(W+U, W+U) times of a UAS between waypoints, then starts; setting off included."""
    n, n_uas = problem.n_waypoints, problem.n_uas
    arcs = np.zeros((n + n_uas, n + n_uas))
    arcs[:n, :n] = problem.between_s[problem.uas["kind"][uas]]
    setting_off_s = problem.uas["speed_mps"][uas] / (2.0 * problem.uas["acceleration_mps2"][uas])
    for u in range(n_uas):
        arcs[n + u, :n] = problem.first_s[u] + setting_off_s
        arcs[:n, n + u] = problem.home_s[u]
    return arcs


def or_tools(problem: RoutingProblem, weight: float, seconds: float, seed: int) -> Found:
    """Guided local search from the cheapest arcs."""
    del seed  # it draws nothing
    from ortools.constraint_solver import (
        pywrapcp,
        routing_enums_pb2,
    )

    n, n_uas = problem.n_waypoints, problem.n_uas
    ends = [n + u for u in range(n_uas)]
    manager = pywrapcp.RoutingIndexManager(n + n_uas, n_uas, ends, ends)
    routing = pywrapcp.RoutingModel(manager)
    arcs_ms = np.round(_MS * _arcs_s(problem, 0)).astype(np.int64)
    flight = routing.RegisterTransitMatrix(arcs_ms.tolist())
    price = routing.RegisterTransitMatrix(np.round(weight * arcs_ms).astype(np.int64).tolist())
    routing.SetArcCostEvaluatorOfAllVehicles(price)
    routing.AddDimension(flight, 0, int(1e9), True, "time")
    routing.GetDimensionOrDie("time").SetGlobalSpanCostCoefficient(1)
    began, trace = time.process_time(), []
    routing.AddAtSolutionCallback(
        lambda: trace.append((time.process_time() - began, routing.CostVar().Max() / _MS))
    )
    ends_at = began + seconds
    routing.AddSearchMonitor(routing.solver().CustomLimit(lambda: time.process_time() > ends_at))
    parameters = pywrapcp.DefaultRoutingSearchParameters()
    parameters.first_solution_strategy = routing_enums_pb2.FirstSolutionStrategy.PATH_CHEAPEST_ARC
    parameters.local_search_metaheuristic = (
        routing_enums_pb2.LocalSearchMetaheuristic.GUIDED_LOCAL_SEARCH
    )
    parameters.time_limit.seconds = int(20 * seconds)
    solution = routing.SolveWithParameters(parameters)
    if solution is None:
        return Found(np.array([[seconds, np.inf]]), [])
    routes = []
    for u in range(n_uas):
        at, route = solution.Value(routing.NextVar(routing.Start(u))), []
        while not routing.IsEnd(at):
            route.append(manager.IndexToNode(at))
            at = solution.Value(routing.NextVar(at))
        routes.append(route)
    return Found(np.array(trace), routes)


def pyvrp(problem: RoutingProblem, weight: float, seconds: float, seed: int) -> Found | None:
    """Iterated local search of PyVRP; None where several UAS fly."""
    from pyvrp import Model

    if problem.n_uas > 1:
        return None
    arcs_ms = np.round(_MS * _arcs_s(problem, 0)).astype(np.int64)
    model: Any = Model()
    places = [model.add_location(x=0, y=0) for _ in range(problem.n_waypoints + 1)]
    depot = model.add_depot(places[-1])
    for place in places[:-1]:
        model.add_client(place)
    model.add_vehicle_type(1, start_depot=depot, end_depot=depot)
    for i, start in enumerate(places):
        for j, end in enumerate(places):
            if i != j:
                model.add_edge(start, end, distance=int(arcs_ms[i, j]))
    began, trace = time.process_time(), []

    def stop(best_cost: float) -> bool:
        now = time.process_time() - began
        cost = (1.0 + weight) * best_cost / _MS
        if not trace or cost < trace[-1][1]:
            trace.append((now, cost))
        return now > seconds

    result = model.solve(stop, seed=seed, display=False, collect_stats=False)
    routes = [[int(place) for place in _clients(route)] for route in result.best.routes()]
    return Found(np.array(trace), routes or [[]])


def _clients(route: Any) -> list[int]:
    visits = [activity for activity in route if activity.is_client()]
    return [activity.idx for activity in visits]


SOLVERS: dict[str, Callable[[RoutingProblem, float, float, int], Found | None]] = {
    "this package": own,
    "OR-Tools": or_tools,
    "PyVRP": pyvrp,
}


def flown_cost_s(problem: RoutingProblem, routes: list[list[int]], weight: float) -> float:
    """What an order costs with its turns."""
    seconds, nobody = np.zeros(len(routes)), np.zeros(0, np.int64)
    order = Routes(tuple(np.array(r, np.int64) for r in routes), nobody, seconds, np.inf)
    return improve_routes(problem, order, SearchEffort(0, total_weight=weight), 0).cost_s


def measure(table: Table, n_uas: int, n_waypoints: int, seconds: float, weight: float) -> None:
    """All solvers on one size: a row each."""
    problem = problem_of(n_uas, n_waypoints, 1)
    arcs_only = problem.replace(turn_s=np.zeros_like(problem.turn_s))
    found: dict[str, list[Found]] = {}
    for name, solver in SOLVERS.items():
        seeds = range(1 if solver is or_tools else 3)
        runs = [solver(arcs_only, weight, seconds, seed) for seed in seeds]
        found[name] = [run for run in runs if run is not None]
    best = min(run.trace[:, COST].min() for runs in found.values() for run in runs)
    effort = SearchEffort(2_000_000, total_weight=weight, by_pieces=True)
    turning = improve_routes(problem, empty_routes(n_uas), effort, 0).cost_s
    for name, runs in found.items():
        if not runs:
            table.add_row(f"{n_uas} x {n_waypoints}", name, *["-"] * 4)
            continue
        cells = [_median([_time_to(run, best * (1.0 + gap)) for run in runs]) for gap in _GAPS]
        last = [100.0 * (run.trace[:, COST].min() / best - 1.0) for run in runs]
        flown = [
            100.0 * (flown_cost_s(problem, run.routes, weight) / turning - 1.0) for run in runs
        ]
        cells += [f"{np.median(last):.2f}", f"{np.median(flown):+.1f}"]
        table.add_row(f"{n_uas} x {n_waypoints}", name, *cells)


def _time_to(run: Found, cost: float) -> float:
    good = run.trace[run.trace[:, COST] <= cost]
    return float(good[:, SECONDS].min()) if len(good) else np.inf


def _median(seconds: list[float]) -> str:
    value = float(np.median(seconds))
    return f"{value:.2f}" if np.isfinite(value) else "never"


def main(
    sizes: Annotated[
        str, typer.Option(help="UASxWAYPOINTS, separated by commas.")
    ] = "1x50,1x200,4x100,8x200",
    seconds: Annotated[float, typer.Option(help="Processor time of each search.", min=0.1)] = 2.0,
    weight: Annotated[float, typer.Option(help="As `weight_energy`.", min=0.0)] = 0.6,
) -> None:
    """Search, and print a table."""
    columns = [f"to {100 * gap:g} %, s" for gap in _GAPS]
    table = Table("UAS x waypoints", "search", *columns, "last gap, %", "with turns, %")
    for text in sizes.split(","):
        n_uas, x, n_waypoints = text.partition("x")
        if not (x and n_uas.isdecimal() and n_waypoints.isdecimal()):
            raise InputError(f"--sizes {text!r}: should be UASxWAYPOINTS, as 2x50")
        with console.status(text):
            measure(table, int(n_uas), int(n_waypoints), seconds, weight)
    console.print(table)


if __name__ == "__main__":
    app = typer.Typer(add_completion=False, pretty_exceptions_enable=False)
    app.command()(main)
    try:
        app()
    except (InputError, ImportError) as error:
        hint = "; python -m pip install ortools pyvrp" if isinstance(error, ImportError) else ""
        sys.stderr.write(f"error: {error}{hint}\n")
        sys.exit(2)
