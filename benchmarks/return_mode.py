"""Which UAS return mode loses: random policies, return mode and safety filter, until all are down.

    python benchmarks/return_mode.py
    python benchmarks/return_mode.py --missions 300 --families overhangs --first-seed 90000
    python benchmarks/return_mode.py --level strong

The mission of a seed belongs to a family: generated towns (`towns`), eight UAS side by side
(`crowd`), hexacopters, steps of half a second (`short_steps`), blocks close together (`clutter`),
far corners of a large empty area (`far`), six-sided fences (`hexagon`), and slabs, mushrooms and
tilted rocks (`overhangs`). Charge is scarce: every UAS begins with what hovering takes in 60 to
240 s, and more where its area is large. The policy sends each UAS its own velocities:

- jitter: drawn anew in every step;
- hold: drawn anew every 8 s;
- fast: at full speed, heading and altitude drawn anew every 5 to 25 s;
- away: at full speed away from its start, at a drawn altitude, in a heading that turns slowly.

Nothing else moves; with `--level`, wind with turbulence and gusts, and vehicles other than
believed, are drawn for each mission. A UAS is lost by any contact: `battery` is what return mode
has to prevent. Each share stands beside a 95 % upper bound (Clopper and Pearson's, one-sided).
Exits 0 where none was lost, 1 otherwise, 2 where the input is bad.
"""

from __future__ import annotations

import math
import sys
from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from typing import Annotated, Any

import numpy as np
import typer
from numpy.typing import NDArray
from rich.console import Console
from rich.table import Table
from scipy.stats import beta

from uas_coverage_env.entities.commands import COMMAND_DTYPE, KIND_NAMES
from uas_coverage_env.entities.outcome import CONTACT_NAMES
from uas_coverage_env.entities.state import FLYING
from uas_coverage_env.features import constant_wind
from uas_coverage_env.files.strict_toml import InputError
from uas_coverage_env.scenario import Scenario, generate_scenario, with_disturbances
from uas_coverage_env.scenario.levels import DISTURBANCE_LEVELS
from uas_coverage_env.simulation import World
from uas_coverage_env.vehicle.layout import DOD

FIRST_SEED = 50_000
_VELOCITY = KIND_NAMES.index("velocity")
_FULL_MPS = 12.0
_CHARGE_S = (60.0, 240.0)
_HOVER_S = 1100.0
"""A full battery hovers about so long [s]; the shipped vehicles differ by less than a tenth."""

Vector = NDArray[np.float64]
Rng = np.random.Generator


def _town(rng: Rng, seed: int, n_uas: int | None = None, **changes: Any) -> Scenario:
    n_uas = int(rng.integers(1, 5)) if n_uas is None else n_uas
    made = generate_scenario(
        seed, n_uas=n_uas, n_waypoints=int(rng.integers(4, 25)), n_obstacles=int(rng.integers(13))
    )
    return made.model_copy(update=changes)


def _hexacopters(rng: Rng, seed: int) -> Scenario:
    made = _town(rng, seed)
    uas = tuple(one.model_copy(update={"vehicle": "hexacopter"}) for one in made.uas)
    return made.model_copy(update={"uas": uas})


def _field(
    name: str,
    size_m: float,
    starts_m: list[tuple[float, float, float]],
    obstacles: list[dict[str, Any]],
    fence_m: list[tuple[float, float]] | None = None,
) -> Scenario:
    plan = fence_m or [(0.0, 0.0), (size_m, 0.0), (size_m, size_m), (0.0, size_m)]
    return Scenario.model_validate(
        {
            "schema": 1,
            "name": name,
            "dt_s": 1.0,
            "max_steps": 3000,
            "landing_distance_m": 2.0,
            "landing_speed_mps": 0.5,
            "uas_safe_distance_m": 5.0,
            "geofence": {
                "margin_m": 0.5,
                "vertices_m": [(*place, down_m) for down_m in (0.0, -50.0) for place in plan],
            },
            "obstacles": obstacles,
            "waypoints": [
                {"position_m": (size_m / 2.0, size_m / 2.0, -45.0), "radius_m": 4.0, "weight": 1.0}
            ],
            "uas": [
                {
                    "name": f"uas_{i + 1}",
                    "vehicle": "s500_v2",
                    "start_m": start_m,
                    "soc_0": 1.0,
                    "radius_m": 0.36,
                    "dod_max": 0.75,
                }
                for i, start_m in enumerate(starts_m)
            ],
        }
    )


def _starts(n_uas: int, size_m: float) -> list[tuple[float, float, float]]:
    return [(size_m / 2.0 + 12.0 * (i - (n_uas - 1) / 2.0), 12.0, -1.0) for i in range(n_uas)]


def _far(rng: Rng, seed: int) -> Scenario:
    size_m = float(rng.uniform(400.0, 800.0))
    return _field(f"far-{seed}", size_m, [(10.0, 10.0, -1.0)], [])


def _hexagon(rng: Rng, seed: int) -> Scenario:
    turns = np.arange(6) * np.pi / 3.0
    fence_m = [(120.0 + 115.0 * math.cos(a), 100.0 + 115.0 * math.sin(a)) for a in turns]
    return _field(f"hexagon-{seed}", 240.0, _starts(int(rng.integers(1, 4)), 240.0), [], fence_m)


def _ring(north_m: float, east_m: float, radius_m: float, down_m: float) -> list[Any]:
    turns = np.arange(7) * 2.0 * np.pi / 7.0
    return [
        (north_m + radius_m * math.cos(a), east_m + radius_m * math.sin(a), down_m) for a in turns
    ]


def _slab(rng: Rng, north_m: float, east_m: float) -> list[Any]:
    half_m, under_m, over_m = rng.uniform((3.0, 7.0, 1.0), (15.0, 25.0, 6.0))
    long_m = float(rng.uniform(1.0, 2.0)) * half_m
    return [
        (north_m + n * half_m, east_m + e * long_m, -(under_m + over))
        for n in (-1, 1)
        for e in (-1, 1)
        for over in (0.0, over_m)
    ]


def _mushroom(rng: Rng, north_m: float, east_m: float) -> list[Any]:
    top_m, wide_m = rng.uniform((12.0, 6.0), (42.0, 14.0))
    return _ring(north_m, east_m, 2.0, 0.0) + _ring(north_m, east_m, wide_m, -top_m)


def _rock(rng: Rng, north_m: float, east_m: float) -> list[Any]:
    lean_n, lean_e, top_m = rng.uniform((-12.0, -12.0, 8.0), (12.0, 12.0, 30.0))
    return _ring(north_m, east_m, 6.0, 0.0) + _ring(north_m + lean_n, east_m + lean_e, 5.0, -top_m)


def _scattered(
    rng: Rng, name: str, kinds: list[Callable[[Rng, float, float], list[Any]]], count: int
) -> Scenario:
    obstacles: list[dict[str, Any]] = []
    for number in range(count):
        shape = kinds[int(rng.integers(len(kinds)))]
        north_m, east_m = rng.uniform((25.0, 50.0), (175.0, 180.0))
        vertices_m = np.array(shape(rng, float(north_m), float(east_m))).round(2)
        if np.abs(vertices_m[:, :2] - 100.0).max() < 95.0:
            obstacles.append(
                {"name": f"o{number}", "safe_distance_m": 2.0, "vertices_m": vertices_m.tolist()}
            )
    middle_m = np.array((100.0, 100.0))
    # nothing above the waypoint, which only keeps the mission going
    free = [
        o
        for o in obstacles
        if np.linalg.norm(np.mean(o["vertices_m"], axis=0)[:2] - middle_m) > 35.0
    ]
    return _field(name, 200.0, _starts(int(rng.integers(1, 4)), 200.0), free)


def _overhangs(rng: Rng, seed: int) -> Scenario:
    count = int(rng.integers(1, 10))
    return _scattered(rng, f"overhangs-{seed}", [_slab, _mushroom, _rock], count)


def _block(rng: Rng, north_m: float, east_m: float) -> list[Any]:
    half_n, half_e, top_m = rng.uniform((0.5, 0.5, 5.0), (12.0, 12.0, 45.0))
    return [
        (north_m + n * half_n, east_m + e * half_e, down_m)
        for n in (-1, 1)
        for e in (-1, 1)
        for down_m in (0.0, -top_m)
    ]


def _clutter(rng: Rng, seed: int) -> Scenario:
    return _scattered(rng, f"clutter-{seed}", [_block], 20)


FAMILIES: Mapping[str, Callable[[Rng, int], Scenario]] = {
    "towns": _town,
    "crowd": lambda rng, seed: _town(rng, seed, n_uas=8),
    "hexacopters": _hexacopters,
    "short_steps": lambda rng, seed: _town(rng, seed, dt_s=0.5),
    "clutter": _clutter,
    "far": _far,
    "hexagon": _hexagon,
    "overhangs": _overhangs,
}


def mission(family: str, seed: int) -> Scenario:
    """The mission of a seed, its charge scarce."""
    rng = np.random.default_rng([seed, list(FAMILIES).index(family)])
    scenario = FAMILIES[family](rng, seed)
    across_m = float(np.ptp(scenario.fence.vertices_m[:, :2], axis=0).max())
    uas = []
    for one in scenario.uas:
        budget_s = float(rng.uniform(*_CHARGE_S)) + 0.1 * across_m
        soc_0 = min(1.0, round(1.0 - one.dod_max + budget_s / _HOVER_S, 3))
        uas.append(one.model_copy(update={"soc_0": soc_0}))
    return scenario.model_copy(update={"uas": tuple(uas), "max_steps": 3000})


Wish = tuple[float, float, float]
"""North and east [m/s], and an altitude [m]."""


def _drawn(rng: Rng, speed_mps: float) -> Wish:
    heading_rad = float(rng.uniform(0.0, 2.0 * np.pi))
    altitude_m = float(rng.choice([2.0, rng.uniform(2.0, 48.0), 48.0]))
    return speed_mps * math.cos(heading_rad), speed_mps * math.sin(heading_rad), altitude_m


def _jitter(rng: Rng, dt_s: float, away_m: Vector) -> Iterator[Wish]:
    while True:
        yield _drawn(rng, float(rng.uniform(0.0, _FULL_MPS)))


def _hold(rng: Rng, dt_s: float, away_m: Vector) -> Iterator[Wish]:
    while True:
        wish = _drawn(rng, float(rng.uniform(0.0, _FULL_MPS)))
        for _ in range(round(8.0 / dt_s)):
            yield wish


def _fast(rng: Rng, dt_s: float, away_m: Vector) -> Iterator[Wish]:
    while True:
        wish = _drawn(rng, _FULL_MPS)
        for _ in range(round(float(rng.uniform(5.0, 25.0)) / dt_s)):
            yield wish


def _away(rng: Rng, dt_s: float, away_m: Vector) -> Iterator[Wish]:
    altitude_m = _drawn(rng, 0.0)[2]
    heading_rad = float(rng.uniform(0.0, 2.0 * np.pi))
    while True:
        heading_rad += float(rng.normal(0.0, 0.1))
        distance_m = float(np.hypot(*away_m))
        if distance_m > 20.0:
            heading_rad = math.atan2(away_m[1], away_m[0])
        yield _FULL_MPS * math.cos(heading_rad), _FULL_MPS * math.sin(heading_rad), altitude_m


POLICIES = {"jitter": _jitter, "hold": _hold, "fast": _fast, "away": _away}


def fly(
    family: str, policy: str, seed: int, wind_mps: float = 0.0, level: str | None = None
) -> Counter[str]:
    """One mission, the wind from a drawn direction: what there is to count.

    Args:
        family: Of the mission.
        policy: Which commands.
        seed: Of everything.
        wind_mps: Of a constant wind [m/s].
        level: Of wind and wrong models, instead of that; None: no level.
    """
    from_deg = float(np.random.default_rng([seed, 2]).uniform(0.0, 360.0))
    world = World(
        with_disturbances(mission(family, seed), level, seed),
        return_mode=True,
        safety_filter=True,
        disturbances=(constant_wind(wind_mps, from_deg),) if wind_mps else None,
        seed=seed,
    )
    n_uas = len(world.names)
    commands = np.zeros(n_uas, COMMAND_DTYPE)
    status, x = world.state.uas["status"], world.state.x
    away_m = np.zeros((n_uas, 2))
    rng = np.random.default_rng([seed, list(POLICIES).index(policy), 1])
    wishes = [POLICIES[policy](rng, world.scenario.dt_s, away_m[i]) for i in range(n_uas)]
    tally = Counter(missions=1, flights=n_uas)
    while not world.done:
        away_m[:] = x[:, :2] - world.arena.uas["home_m"][:, :2]
        for i in range(n_uas):
            if status[i] == FLYING:
                commands[i] = (_VELOCITY, (*next(wishes[i]), 0.0), False)
        outcome = world.step(commands)
        tally["uas_steps"] += int(outcome["flew"].sum())
        tally["breaches"] += int(outcome["breaches"].sum())
        tally.update(CONTACT_NAMES[code] for code in outcome["contact"] if code)
        tally["charge left"] += sum(
            round(1e4 * (world.arena.uas["dod_max"][i] - x[i, DOD]))
            for i in np.flatnonzero(outcome["landed"])
        )
    tally["still flying"] = int((status == FLYING).sum())
    return tally


def upper_bound(hits: int, trials: int) -> float:
    """95 % upper bound of a share of which `hits` in `trials` were seen."""
    return 1.0 if hits >= trials else float(beta.ppf(0.95, hits + 1, trials - hits))


def _lost(tally: Counter[str]) -> int:
    return sum(tally[name] for name in CONTACT_NAMES) + tally["still flying"]


def _table(tallies: Mapping[tuple[str, str], Counter[str]]) -> Table:
    table = Table(title="UAS lost with return mode and safety filter on")
    for column in ("family", "policy", "missions", "UAS", "lost", "at most", "to what"):
        table.add_column(column)
    for column in ("mean charge left at home", "UAS samples", "in breach"):
        table.add_column(column)
    total = sum(tallies.values(), Counter[str]())
    for (family, policy), tally in [*tallies.items(), (("all", "all"), total)]:
        kinds = [name for name in (*CONTACT_NAMES, "still flying") if tally[name]]
        home = tally["flights"] - _lost(tally)
        table.add_row(
            family,
            policy,
            str(tally["missions"]),
            str(tally["flights"]),
            str(_lost(tally)),
            f"{upper_bound(_lost(tally), tally['flights']):.2%}",
            ", ".join(f"{kind} {tally[kind]}" for kind in kinds) or "nothing",
            f"{tally['charge left'] / max(home, 1) / 100.0:.2f} %",
            str(tally["uas_steps"]),
            str(tally["breaches"]),
        )
    return table


def chosen(names: str, allowed: Mapping[str, object], what: str) -> list[str]:
    """The names in a list with commas.

    Raises:
        InputError: One is not allowed.
    """
    found = [name.strip() for name in names.split(",") if name.strip()]
    for name in found:
        if name not in allowed:
            raise InputError(f"unknown {what} {name!r}; allowed: {', '.join(allowed)}")
    return found


def main(
    missions: Annotated[int, typer.Option(min=1, help="Of each family and policy.")] = 4,
    families: Annotated[str, typer.Option(help="Which families.")] = ",".join(FAMILIES),
    policies: Annotated[
        str, typer.Option("--policies", "--players", help="Which policies.")
    ] = ",".join(POLICIES),
    first_seed: Annotated[int, typer.Option(min=0, help="Of the missions.")] = FIRST_SEED,
    wind_mps: Annotated[float, typer.Option(min=0.0, help="Constant, unknown to all.")] = 0.0,
    level: Annotated[
        str, typer.Option(help=f"{', '.join(DISTURBANCE_LEVELS)}; instead of --wind-mps.")
    ] = "",
    verbose: Annotated[bool, typer.Option(help="Name the missions with losses.")] = False,
) -> None:
    """Fly random policies until all UAS are down, and print a table."""
    if level and wind_mps:
        raise InputError("--level brings its own wind; leave out --wind-mps")
    chosen(level, DISTURBANCE_LEVELS, "level")
    tallies: dict[tuple[str, str], Counter[str]] = {}
    for family in chosen(families, FAMILIES, "family"):
        for policy in chosen(policies, POLICIES, "policy"):
            tallies[family, policy] = Counter()
            for seed in range(first_seed, first_seed + missions):
                tally = fly(family, policy, seed, wind_mps, level or None)
                tallies[family, policy].update(tally)
                if verbose and _lost(tally):
                    sys.stderr.write(f"{family} {policy} {seed}: {dict(tally)}\n")
    console = Console()
    console.width = max(console.width, 130)
    console.print(_table(tallies))
    raise typer.Exit(int(any(_lost(tally) for tally in tallies.values())))


if __name__ == "__main__":
    app = typer.Typer(add_completion=False, pretty_exceptions_enable=False)
    app.command()(main)
    try:
        app()
    except InputError as error:
        sys.stderr.write(f"error: {error}\n")
        sys.exit(2)
