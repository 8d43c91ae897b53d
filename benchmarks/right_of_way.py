"""Which UAS come home among others in their way: missions in which the others try to prevent it.

    python benchmarks/right_of_way.py
    python benchmarks/right_of_way.py --missions 140 --policies cage,doorstep

The mission of a seed is a generated town with 2 to 8 UAS. One of them, drawn, has half a battery
and flies to a drawn corner of the geofence, until return mode calls it home; the others have full
batteries and fly, for as long as it is out, where the policy sends them:

- corner: to the same corner, at full speed, as untrained policies do;
- siege: at it, at full speed;
- press: at it, more slowly the nearer they are;
- goalkeeper: to a place 6 m from it on its way home, and stay there;
- cage: to places 6.3 m from it, one on its way home, then above, on both sides, below;
- doorstep: to its start, and stay there.

Return mode and safety filter are on, and nothing else moves. A flight ends when the UAS has landed
or is lost. Exits 0 where all came home without a contact, 1 otherwise, 2 where the input is bad.
"""

from __future__ import annotations

import sys
from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Annotated

import numpy as np
import typer
from numpy.typing import NDArray
from rich.console import Console
from rich.table import Table

from uas_coverage_env.entities.commands import COMMAND_DTYPE, KIND_NAMES
from uas_coverage_env.entities.outcome import CONTACT_NAMES
from uas_coverage_env.entities.state import FLYING, LANDED
from uas_coverage_env.files.strict_toml import InputError
from uas_coverage_env.scenario import Scenario, generate_scenario
from uas_coverage_env.simulation import World

FIRST_SEED = 4100
LEAST_UAS, MOST_UAS = 2, 8
STEPS = 800
_VELOCITY = KIND_NAMES.index("velocity")
_ALTITUDES_M = (6.0, 25.0, 49.0)
_FULL_MPS = 12.0
_GAIN_PER_S = 0.4
_KEEPER_M, _CAGE_M, _OVER_THE_START_M = 6.0, 6.3, 4.0

Vector = NDArray[np.float64]


@dataclass(frozen=True)
class Scene:
    """What mates look at: where the UAS is that shall not come home, its start, its corner."""

    place_m: Vector
    home_m: Vector
    corner_m: Vector

    @property
    def homewards(self) -> Vector:
        """(2,) the horizontal direction home."""
        way_m = (self.home_m - self.place_m)[:2]
        return way_m / (np.linalg.norm(way_m) + 1e-9)


def _goalkeeper(scene: Scene, _: int) -> Vector:
    way_m = scene.home_m - scene.place_m
    return scene.place_m + _KEEPER_M * way_m / (np.linalg.norm(way_m) + 1e-9)


def _cage(scene: Scene, mate: int) -> Vector:
    north, east = scene.homewards
    bars = (
        (north, east, 0.0),
        (0.0, 0.0, -1.0),
        (0.3 * north - 0.95 * east, 0.3 * east + 0.95 * north, 0.0),
        (0.3 * north + 0.95 * east, 0.3 * east - 0.95 * north, 0.0),
        (0.0, 0.0, 1.0),
        (0.7 * north, 0.7 * east, -1.0),
        (0.7 * north, 0.7 * east, 1.0),
    )
    return scene.place_m + _CAGE_M * np.array(bars[mate % len(bars)])


def _doorstep(scene: Scene, _: int) -> Vector:
    return scene.home_m - (0.0, 0.0, _OVER_THE_START_M)


@dataclass(frozen=True)
class Policy:
    """Where it sends the mates, and whether they slow down on the way there."""

    target: Callable[[Scene, int], Vector]
    slows: bool


POLICIES: Mapping[str, Policy] = {
    "corner": Policy(lambda scene, _: scene.corner_m, slows=False),
    "siege": Policy(lambda scene, _: scene.place_m, slows=False),
    "press": Policy(lambda scene, _: scene.place_m, slows=True),
    "goalkeeper": Policy(_goalkeeper, slows=True),
    "cage": Policy(_cage, slows=True),
    "doorstep": Policy(_doorstep, slows=True),
}


def _mission(seed: int, n_uas: int) -> tuple[Scenario, int, Vector]:
    """The scenario, who shall not come home, and the corner it flies to."""
    scenario = generate_scenario(seed, n_uas=n_uas, n_waypoints=20, n_obstacles=6)
    rng = np.random.default_rng([seed, 5])
    chosen = int(rng.integers(n_uas))
    corners_m = scenario.fence.vertices_m
    corner_m = corners_m[rng.integers(len(corners_m))].copy()
    corner_m[2] = -rng.choice(_ALTITUDES_M)
    uas = tuple(
        entry.model_copy(update={"soc_0": 0.5 if i == chosen else 1.0})
        for i, entry in enumerate(scenario.uas)
    )
    return scenario.model_copy(update={"uas": uas, "max_steps": STEPS}), chosen, corner_m


def _velocity(place_m: Vector, target_m: Vector, slows: bool) -> tuple[float, ...]:
    """The values of a velocity command towards a place."""
    way_m = (target_m - place_m)[:2]
    distance_m = float(np.linalg.norm(way_m))
    speed_mps = min(_FULL_MPS, _GAIN_PER_S * distance_m) if slows else _FULL_MPS
    north_mps, east_mps = way_m / (distance_m + 1e-9) * speed_mps
    return float(north_mps), float(east_mps), float(-target_m[2]), 0.0


def fly(name: str, seed: int, n_uas: int) -> Counter[str]:
    """One mission: what there is to count."""
    policy = POLICIES[name]
    scenario, chosen, corner_m = _mission(seed, n_uas)
    world = World(scenario, return_mode=True, safety_filter=True)
    mates = [i for i in range(n_uas) if i != chosen]
    commands = np.zeros(n_uas, COMMAND_DTYPE)
    tally = Counter(missions=1)
    status, x = world.state.uas["status"], world.state.x
    while status[chosen] == FLYING and world.state.step[0] < STEPS:
        scene = Scene(x[chosen, :3].copy(), world.arena.uas["home_m"][chosen], corner_m)
        commands[chosen] = (_VELOCITY, _velocity(scene.place_m, corner_m, slows=False), False)
        for number, i in enumerate(mates):
            values = _velocity(x[i, :3], policy.target(scene, number), policy.slows)
            commands[i] = (_VELOCITY, values, False)
        outcome = world.step(commands)
        tally["uas_steps"] += int(outcome["flew"].sum())
        tally["filtered"] += int(outcome["filtered"].sum())
        tally["breaches"] += int(outcome["breaches"].sum())
        tally["on the way home"] += int(outcome["returning"][chosen])
        tally.update(CONTACT_NAMES[code] for code in outcome["contact"] if code)
    tally["not home"] = int(status[chosen] != LANDED)
    return tally


def _table(tallies: Mapping[str, Counter[str]]) -> Table:
    table = Table(title="Which UAS come home among others in their way")
    contacts = [name for name in CONTACT_NAMES if name != "none"]
    for column in ("policy", "missions", "not home", "steps on the way home", "lost to"):
        table.add_column(column)
    for column in ("UAS samples in breach", "UAS samples", "commands changed"):
        table.add_column(column)
    for name, tally in tallies.items():
        lost = ", ".join(f"{kind} {tally[kind]}" for kind in contacts if tally[kind])
        table.add_row(
            name,
            str(tally["missions"]),
            str(tally["not home"]),
            f"{tally['on the way home'] / tally['missions']:.1f}",
            lost or "nothing",
            str(tally["breaches"]),
            str(tally["uas_steps"]),
            f"{tally['filtered'] / tally['uas_steps']:.1%}",
        )
    return table


def main(
    missions: Annotated[int, typer.Option(min=1, help="Missions of each policy.")] = 140,
    policies: Annotated[
        str, typer.Option("--policies", "--players", help="Which policies.")
    ] = ",".join(POLICIES),
) -> None:
    """Fly missions in which mates are in the way, and print a table."""
    names = [name.strip() for name in policies.split(",") if name.strip()]
    for name in names:
        if name not in POLICIES:
            raise InputError(f"unknown policy {name!r}; allowed: {', '.join(POLICIES)}")
    sizes = MOST_UAS - LEAST_UAS + 1
    tallies: dict[str, Counter[str]] = {}
    for name in names:
        tallies[name] = Counter()
        for number in range(missions):
            tallies[name].update(
                fly(name, FIRST_SEED + number // sizes, LEAST_UAS + number % sizes)
            )
    console = Console()
    console.width = max(console.width, 140)
    console.print(_table(tallies))
    bad = sum(
        tally["not home"] + sum(tally[c] for c in CONTACT_NAMES) for tally in tallies.values()
    )
    raise typer.Exit(int(bad > 0))


if __name__ == "__main__":
    app = typer.Typer(add_completion=False, pretty_exceptions_enable=False)
    app.command()(main)
    try:
        app()
    except InputError as error:
        sys.stderr.write(f"error: {error}\n")
        sys.exit(2)
