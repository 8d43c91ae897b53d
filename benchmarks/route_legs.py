"""Where `learned-route` takes more steps than `trajectory` along the same routes.

    python benchmarks/route_legs.py
    python benchmarks/route_legs.py --seeds 900000:900004

`trajectory` plans validation towns; `learned-route` flies along the routes of these plans. Steps
between two visits are summed up by kind of leg: the first one, the last one home, and the others by
how much the route turns before them, apart for legs that are not clear between their ends.
"""

from __future__ import annotations

import argparse
from collections import defaultdict
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray
from uas_coverage_agents.route.planner import LearnedRoute
from uas_coverage_agents.route.policy_runner import RouteRunner
from uas_coverage_agents.route.rehearsal import Rehearsal

from uas_coverage_env import MissionBrief, Scenario, load_planner, rollout
from uas_coverage_env.leaderboard import seed_range
from uas_coverage_env.scenario import sample_scenario
from uas_coverage_env.world import build_arena
from uas_coverage_env.world.routes import CLEAR, route

WEIGHT_ENERGY = 0.6
TURNS_DEG = (0, 45, 90, 135)
_ROUNDING_M = 0.01


class AlongRunner(RouteRunner):
    """Flies given routes instead of those it built."""

    routes: Sequence[NDArray[np.int64]] = ()

    def choose_routes(self, rehearsal: Rehearsal) -> None:
        """Take the given routes."""
        self.take(list(self.routes), rehearsal)


class Along(LearnedRoute):
    """`learned-route` along the routes of its `runner`."""

    def _make_runner(self) -> AlongRunner:
        self.runner = AlongRunner(self.policy, self.assistants, samples=1, changes=0)
        return self.runner


def visits(path_m: NDArray, places_m: NDArray, radii_m: NDArray) -> NDArray[np.int64]:
    """(K,) first samples in each of the spheres, in their order."""
    found, step = [], 0
    for place_m, radius_m in zip(places_m, radii_m, strict=True):
        inside = np.linalg.norm(path_m[step:] - place_m, axis=1) <= radius_m + _ROUNDING_M
        step += int(np.argmax(inside))
        found.append(step)
    return np.array(found)


def kinds(scenario: Scenario, uas: int, route_: NDArray[np.int64]) -> list[str]:
    """The kind of each leg of a route."""
    arena = build_arena(scenario)
    home_m = np.array(scenario.uas[uas].start_m)
    places_m = np.array([home_m, *(scenario.waypoints[w].position_m for w in route_), home_m])
    rows = [*route_.tolist(), len(scenario.waypoints) + uas]
    legs_m = np.diff(places_m[:, :2], axis=0)
    names = []
    for k, row in enumerate(rows):
        name = "home" if k == len(route_) else "first"
        if 0 < k < len(route_):
            cosine = (
                legs_m[k - 1] @ legs_m[k] / np.prod(np.linalg.norm(legs_m[k - 1 : k + 1], axis=1))
            )
            turned = np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0)))
            name = f"turn from {max(t for t in TURNS_DEG if t <= turned)} degrees"
        _, _, _, leg = route(arena, row, *places_m[k], *places_m[k + 1])
        names.append(name if leg == CLEAR else f"{name}, past obstacles")
    return names


def main() -> None:
    """Fly and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--seeds", default="900000:900016")
    asked = parser.parse_args()
    planner: Any = load_planner("trajectory", {"weight_energy": WEIGHT_ENERGY})
    along = Along()
    sums: dict[str, list[int]] = defaultdict(lambda: [0, 0, 0])
    shares = []
    for seed in seed_range("--seeds", asked.seeds):
        scenario = sample_scenario(seed)
        planner.reset(MissionBrief.of(scenario), 0)
        along.runner.routes = planner.mission_plan.order.routes
        flight = rollout(scenario, along)
        both = [0, 0]
        for u, planned in planner.mission_plan.planned.items():
            places_m = np.array([scenario.waypoints[w].position_m for w in planned.route])
            radii_m = np.array([scenario.waypoints[w].radius_m for w in planned.route])
            flown_m = flight.x[:, u, :3]
            landed = int(np.flatnonzero(np.any(np.diff(flown_m, axis=0), axis=1))[-1]) + 1
            ends = []
            for path_m, end in ((planned.flight.path_m, planned.flight.steps), (flown_m, landed)):
                ends.append(np.diff([0, *visits(path_m, places_m, radii_m), end]))
            for name, steps, flown in zip(kinds(scenario, u, planned.route), *ends, strict=True):
                for k, more in enumerate((1, int(steps), int(flown))):
                    sums[name][k] += more
            both = [both[0] + planned.flight.steps, both[1] + landed]
        shares.append(100.0 * (both[1] / both[0] - 1.0))
    total = sum(steps for _, steps, _ in sums.values())
    print("| legs | number | planned, steps | flown | more, % of all planned |")
    print("| --- | ---: | ---: | ---: | ---: |")
    for name, (n, steps, flown) in sorted(sums.items()):
        print(f"| {name} | {n} | {steps} | {flown} | {100.0 * (flown - steps) / total:.1f} |")
    n, _, flown = np.sum(list(sums.values()), axis=0)
    print(f"| all | {n} | {total} | {flown} | {100.0 * (flown - total) / total:.1f} |")
    low, middle, high = np.percentile(shares, [0, 50, 100])
    towns = f"median of {len(shares)} towns (range)"
    print(f"\nmore steps, {towns}: {middle:.1f} % ({low:.1f} to {high:.1f})")


if __name__ == "__main__":
    main()
