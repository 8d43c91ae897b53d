"""What routes promise beside what is flown: the numbers of `uas_coverage_env.planning.reserves`.

    python benchmarks/reserves.py
    python benchmarks/reserves.py --planners tour --scenarios generated --seeds 3000:3040

Missions are flown, and each UAS's visits are timed once more by the clock of routes, with nothing
added. Reported is the time up to the last visit over that of the clock (`legs_share`), how much
longer than its leg the way home took (`landing_s`), and the flying time left in the battery at the
landing, of the UAS that had least (`kept_s` is to be met there).
"""

from __future__ import annotations

import argparse
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from rich.console import Console
from rich.table import Table

from uas_coverage_env import MissionBrief, Scenario, load_planner, load_scenario, rollout
from uas_coverage_env.flight import Flight
from uas_coverage_env.flight.record import LANDED
from uas_coverage_env.leaderboard import seed_range
from uas_coverage_env.mission import first_sight
from uas_coverage_env.planning.reserves import TRAJECTORY
from uas_coverage_env.planning.routing import RoutingProblem, SearchEffort, improve_routes
from uas_coverage_env.planning.routing.problem import battery_s
from uas_coverage_env.planning.routing.search import routes_of
from uas_coverage_env.planning.routing.terrain import Terrain
from uas_coverage_env.scenario import Execution

PLANNERS = "tour", "trajectory", "learned-route", "by-legs"
_BY_LEGS = "by-legs"  # `trajectory` where an autopilot flies
_ROUNDING_M = 0.01
CLOCK = TRAJECTORY._replace(landing_s=0.0, legs_share=1.0)  # legs, turns, and nothing more


class Measured(NamedTuple):
    """Of one UAS that visited something and came home.

    Attributes:
        share: Time up to its last visit, over that of the clock.
        landing_s: From the last visit to the landing, beyond the leg home.
        left_s: Flying time left at the landing.
    """

    share: float
    landing_s: float
    left_s: float


def visits_of(flight: Flight) -> list[tuple[NDArray[np.int64], NDArray[np.int64]]]:
    """Of each UAS the waypoints that it was the first to cover, and at which samples, in order."""
    waypoints = flight.scenario.waypoints
    places_m = np.array([w.position_m for w in waypoints])
    radii_m = np.array([w.radius_m for w in waypoints]) + _ROUNDING_M
    away_m = np.linalg.norm(flight.x[:, :, None, :3] - places_m, axis=3)  # (T, U, W)
    inside = away_m <= radii_m
    first = np.where(inside.any(axis=0), inside.argmax(axis=0), len(flight.x))  # (U, W)
    by = first.argmin(axis=0)
    covered = first.min(axis=0) < len(flight.x)
    found = []
    for u in range(first.shape[0]):
        mine = np.flatnonzero(covered & (by == u))
        mine = mine[np.argsort(first[u, mine], kind="stable")]
        found.append((mine, first[u, mine]))
    return found


def measured(flight: Flight) -> list[Measured]:
    """Each UAS that visited something, and landed."""
    scenario = flight.scenario
    brief, dt_s, landed = MissionBrief.of(scenario), scenario.dt_s, flight.mode == LANDED
    terrain, visits = Terrain(brief), visits_of(flight)
    works = np.ones(len(brief.uas), np.bool_)
    problem = RoutingProblem.seen(brief, first_sight(brief), terrain, works, CLOCK)
    routes = routes_of([route for route, _ in visits])
    clock_s = improve_routes(problem, routes, SearchEffort(0), 0).seconds
    left_s = battery_s(brief, terrain.legs, flight.x[-1])
    found = []
    for u, (route, samples) in enumerate(visits):
        if len(route) and landed[:, u].any():
            home_s = float(problem.home_s[u, route[-1]])
            last_s, home_at_s = dt_s * samples[-1], dt_s * int(landed[:, u].argmax())
            share = last_s / (clock_s[u] - home_s)
            found.append(Measured(share, home_at_s - last_s - home_s, float(left_s[u])))
    return found


def flown(name: str, planner: str) -> Flight:
    """A mission as a planner flies it."""
    scenario: Scenario = load_scenario(name)
    if planner == _BY_LEGS:
        execution = Execution(flown_by="autopilot")
        scenario, planner = scenario.model_copy(update={"execution": execution}), "trajectory"
    return rollout(scenario, load_planner(planner), seed=0)


def spread(values: list[float], digits: int) -> str:
    """Median, and from which to which 9 of 10 are."""
    low, middle, high = np.quantile(values, (0.05, 0.5, 0.95))
    return f"{middle:.{digits}f} ({low:.{digits}f} to {high:.{digits}f})"


def main() -> None:
    """Fly, and print a table."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--planners", default=",".join(PLANNERS))
    parser.add_argument("--scenarios", default="generated", help="families, with commas between")
    parser.add_argument("--seeds", default="3000:3006")
    asked = parser.parse_args()
    table = Table("planner", "UAS", "legs_share", "landing_s", "least left, s")
    seeds = seed_range("--seeds", asked.seeds)
    names = [f"{family}:{seed}" for family in asked.scenarios.split(",") for seed in seeds]
    for planner in asked.planners.split(","):
        all_ = [one for name in names for one in measured(flown(name, planner))]
        shares, landings_s, left_s = (list(column) for column in zip(*all_, strict=True))
        table.add_row(
            planner, str(len(all_)), spread(shares, 3), spread(landings_s, 1), f"{min(left_s):.0f}"
        )
    Console(width=100).print(table)


if __name__ == "__main__":
    main()
