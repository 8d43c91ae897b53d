"""What the safety filter leaves: random policies among things that move, with it and without it.

    python benchmarks/safety_filter.py
    python benchmarks/safety_filter.py --missions 400 --policies random-velocities

The mission of a seed is a generated town (1 to 4 UAS, 5 to 20 blocks) with one to three cylinders
that fly through it, each at a velocity that is drawn anew every 5 to 20 s, up to 15 m/s: faster
than the UAS, and without a warning. They pass through blocks, and stay in the area and above the
starts. Every flight lasts 200 steps or until all are home or lost; none is called home.

A UAS flight with a contact counts once, under what it was lost to. Its share of all UAS flights
stands beside a 95 % upper bound (Clopper and Pearson's, one-sided: three in n where none was seen).
Breaches are UAS samples too near to something moving, and to anything else.

Exits 0 where the filter lost nothing to the fence, fixed obstacles and other UAS; 1 otherwise; 2
where the input is bad.
"""

from __future__ import annotations

import sys
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise, product
from typing import Annotated, Protocol

import numpy as np
import typer
from rich.console import Console
from rich.table import Table
from scipy.stats import beta
from uas_coverage_baselines.nearest_waypoint import NearestWaypoint
from uas_coverage_baselines.random_walk import RandomWalk, RandomWalkOptions

from uas_coverage_env import MissionBrief, Scenario
from uas_coverage_env.entities.outcome import CONTACT_NAMES
from uas_coverage_env.files.strict_toml import InputError
from uas_coverage_env.runner.jobs import Job
from uas_coverage_env.runner.workers import Workers
from uas_coverage_env.scenario import sample_scenario
from uas_coverage_env.simulation import World
from uas_coverage_env.world import Command, SwarmState

FIRST_SEED = 4000
_AREA_INSET_M = 10.0
_ALTITUDE_M = (14.0, 40.0)
_FASTEST_MPS = 15.0
_CLIMB_MPS = 3.0
_HELD_S = (5.0, 20.0)


class Policy(Protocol):
    """What is asked of a planner here."""

    def reset(self, brief: MissionBrief, seed: int, /) -> None:
        """Start a mission."""
        ...

    def act(self, swarm: SwarmState) -> Mapping[str, Command]:
        """Give each flying UAS a command."""
        ...


def _policy(name: str) -> Policy:
    if name == "random-walk":
        return RandomWalk()
    if name == "random-velocities":
        return RandomWalk(RandomWalkOptions(hold_s=4.0, speed=1.0))
    return NearestWaypoint()


POLICIES = ("random-walk", "random-velocities", "nearest-waypoint")


def with_movers(scenario: Scenario, seed: int) -> Scenario:
    """The scenario with one to three cylinders that fly through it."""
    rng = np.random.default_rng([seed, 3])
    corners_m = scenario.fence.vertices_m
    low_m = np.append(corners_m[:, :2].min(axis=0) + _AREA_INSET_M, -_ALTITUDE_M[1])
    high_m = np.append(corners_m[:, :2].max(axis=0) - _AREA_INSET_M, -_ALTITUDE_M[0])
    starts_m = np.array([uas.start_m for uas in scenario.uas])
    movers = []
    for index in range(int(rng.integers(1, 4))):
        radius_m, height_m, safe_m = rng.uniform((3.0, 4.0, 3.0), (8.0, 8.0, 10.0)).round(1)
        place_m = rng.uniform(low_m, high_m).round(1)
        while np.linalg.norm(starts_m[:, :2] - place_m[:2], axis=1).min() < 60.0:
            place_m = rng.uniform(low_m, high_m).round(1)
        movers.append(
            {
                "name": f"mover_{index + 1}",
                "radius_m": radius_m,
                "height_m": height_m,
                "safe_distance_m": safe_m,
                "start_m": tuple(place_m.tolist()),
                "schedule": _schedule(rng, place_m, low_m, high_m, scenario.max_steps),
            }
        )
    data = scenario.model_dump(by_alias=True) | {"moving_obstacles": movers}
    return Scenario.model_validate(data)


def _schedule(rng, place_m, low_m, high_m, until_s: float) -> list[dict]:
    """Drawn velocities, each held as long as the cylinder stays in the area."""
    pieces, time_s = [], 0.0
    while time_s < until_s:
        held_s = round(float(rng.uniform(*_HELD_S)))
        heading_rad, speed_mps = rng.uniform(0.0, 2.0 * np.pi), rng.uniform(0.0, _FASTEST_MPS)
        level_mps = speed_mps * np.array([np.cos(heading_rad), np.sin(heading_rad)])
        velocity_mps = np.append(level_mps, rng.uniform(-_CLIMB_MPS, _CLIMB_MPS)).round(2)
        after_m = place_m + held_s * velocity_mps
        # turned back in the directions that would lead out
        velocity_mps = np.where((after_m < low_m) | (after_m > high_m), -velocity_mps, velocity_mps)
        after_m = place_m + held_s * velocity_mps
        velocity_mps = np.where((after_m < low_m) | (after_m > high_m), 0.0, velocity_mps)
        pieces.append({"from_s": time_s, "velocity_mps": tuple(velocity_mps.tolist())})
        place_m = place_m + held_s * velocity_mps
        time_s += held_s
    return pieces


@dataclass(frozen=True)
class Case:
    """A policy, with the filter or without it, with things that move or without them."""

    policy: str
    safety_filter: bool
    moving: bool


@dataclass
class Tally:
    """What happened in some flights: sums."""

    uas_flights: int = 0
    uas_steps: int = 0
    filtered: int = 0
    moving_breaches: int = 0
    other_breaches: int = 0
    lost: Counter[str] | None = None

    def add(self, other: Tally) -> None:
        """Add the sums of other flights."""
        self.uas_flights += other.uas_flights
        self.uas_steps += other.uas_steps
        self.filtered += other.filtered
        self.moving_breaches += other.moving_breaches
        self.other_breaches += other.other_breaches
        self.lost = (self.lost or Counter()) + (other.lost or Counter())


def fly(case: Case, seed: int, steps: int) -> Tally:
    """One mission of a case."""
    scenario = sample_scenario(seed)
    if case.moving:
        scenario = with_movers(scenario, seed)
    world = World(scenario, safety_filter=case.safety_filter)
    policy = _policy(case.policy)
    policy.reset(MissionBrief.of(scenario), seed)
    tally = Tally(uas_flights=len(world.names), lost=Counter())
    for _ in range(steps):
        if world.done:
            break
        swarm = world.swarm_state()
        tally.uas_steps += len(swarm.active)
        outcome = world.step(policy.act(swarm))
        tally.filtered += int(outcome["filtered"].sum())
        contacts = [CONTACT_NAMES[code] for code in outcome["contact"] if code]
        tally.lost = (tally.lost or Counter()) + Counter(contacts)
        near = int(outcome["breaches"].sum())
        moving = _moving_breaches(scenario, world, outcome["contact"] == 0)
        tally.moving_breaches += moving
        tally.other_breaches += near - moving
    return tally


def _moving_breaches(scenario: Scenario, world: World, whole: np.ndarray) -> int:
    """How often a UAS that flies is now too near to something that moves."""
    swarm, count = world.swarm_state(), 0
    for m, i in product(range(len(scenario.moving_obstacles)), range(len(world.names))):
        mover, uas = scenario.moving_obstacles[m], scenario.uas[i]
        away_m = np.abs(swarm.x[i, :3] - swarm.moving_position_m[m])
        keep_m = mover.safe_distance_m + uas.radius_m
        beside_m, above_m = np.hypot(*away_m[:2]) - mover.radius_m, away_m[2] - mover.height_m / 2
        flew = world.names[i] in swarm.active and bool(whole[i])
        count += int(flew and max(beside_m, above_m) < keep_m)
    return count


def upper_bound(hits: int, trials: int) -> float:
    """95 % upper bound of a share of which `hits` in `trials` were seen."""
    return 1.0 if hits >= trials else float(beta.ppf(0.95, hits + 1, trials - hits))


def _table(tallies: Mapping[Case, Tally]) -> Table:
    table = Table(title="UAS flights that ended in a contact; UAS samples too near to something")
    for column in ("policy", "filter", "moving", "UAS flights", "lost to: moving", "at most"):
        table.add_column(column)
    for column in ("UAS", "obstacle", "fence", "these at most", "breaches: moving", "others"):
        table.add_column(column)
    table.add_column("commands changed")
    for case, tally in tallies.items():
        lost, n = tally.lost or Counter(), tally.uas_flights
        moving = lost["moving_obstacle"]
        others = sum(lost.values()) - moving
        table.add_row(
            case.policy,
            "on" if case.safety_filter else "off",
            "yes" if case.moving else "no",
            str(n),
            f"{moving} ({moving / n:.2%})",
            f"{upper_bound(moving, n):.2%}",
            str(lost["uas"]),
            str(lost["obstacle"]),
            str(lost["geofence"]),
            f"{upper_bound(others, n):.2%}",
            f"{tally.moving_breaches / tally.uas_steps:.3%}",
            f"{tally.other_breaches / tally.uas_steps:.3%}",
            f"{tally.filtered / tally.uas_steps:.1%}",
        )
    return table


def _fly_many(case: Case, seeds: Sequence[int], steps: int) -> Tally:
    total = Tally()
    for seed in seeds:
        total.add(fly(case, seed, steps))
    return total


def main(
    missions: Annotated[int, typer.Option(min=1, help="Generated missions of each case.")] = 60,
    policies: Annotated[
        str, typer.Option("--policies", "--players", help="Which policies.")
    ] = ",".join(POLICIES),
    steps: Annotated[int, typer.Option(min=1, help="Steps of a flight at most.")] = 200,
    jobs: Annotated[int, typer.Option(min=1, help="Processes side by side.")] = 2,
) -> None:
    """Fly random policies with the safety filter and without it, and print a table."""
    names = [name.strip() for name in policies.split(",") if name.strip()]
    for name in names:
        if name not in POLICIES:
            raise InputError(f"unknown policy {name!r}; allowed: {', '.join(POLICIES)}")
    cases = [
        Case(name, *switches)
        for name in names
        for switches in ((False, True), (True, True), (True, False))
    ]
    bounds = np.linspace(0, missions, min(jobs * 4, missions) + 1).astype(int) + FIRST_SEED
    shares = [range(a, b) for a, b in pairwise(bounds.tolist())]
    tallies = {case: Tally() for case in cases}
    with Workers(jobs) as workers:
        work = (
            Job(f"{case} {share}", _fly_many, (case, share, steps))
            for case in cases
            for share in shares
        )
        for job, tally in workers.run(work):
            tallies[job.arguments[0]].add(tally)
    console = Console()
    console.width = max(console.width, 170)
    console.print(_table(tallies))
    clean = all(
        set(tally.lost or ()) <= {"moving_obstacle"}
        for case, tally in tallies.items()
        if case.safety_filter
    )
    raise typer.Exit(0 if clean else 1)


if __name__ == "__main__":
    app = typer.Typer(add_completion=False, pretty_exceptions_enable=False)
    app.command()(main)
    try:
        app()
    except InputError as error:
        sys.stderr.write(f"error: {error}\n")
        sys.exit(2)
