"""Whether flights are the same to the last bit: one hash each, kept in a file and compared.

    python benchmarks/flight_hashes.py --out before.json
    python benchmarks/flight_hashes.py --against before.json

Flown are ten missions of shipped scenarios and families, each with another planner, dynamics, wind
or assistant; 200 missions of all families, short and by `nearest-waypoint`, with filter and return
mode; and a batch of the environment under random actions. A hash is of states, inputs, battery,
modes, coverage, contacts and rewards. It depends on the processor and on numba, so both
files are of one machine: make the first one with the code as it was, in its own environment.

Prints what differs, with the reason where there is one (`REASONS`, by release); exits 1 where there
is none, 2 where the input is bad. Takes a minute of processor time
where the kernels are compiled; `--quick` leaves out the planners that search.
"""

from __future__ import annotations

import hashlib
import json
import platform
import sys
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer
from rich.console import Console
from rich.progress import track

from uas_coverage_env import Scenario, load_planner, load_scenario, rollout
from uas_coverage_env.env import CoverageBatch
from uas_coverage_env.files.strict_toml import InputError
from uas_coverage_env.flight import Flight
from uas_coverage_env.scenario import with_disturbances

SERIES = (
    "generated", "generated-light", "open-field", "streets", "courtyards", "walls", "river",
    "irregular", "traffic", "low-charge",
)  # fmt: skip
SEEDS = range(5_000, 5_020)
_DRAWN_STEPS = 60
_BATCH, _BATCH_STEPS = 64, 100

REASONS = {
    "0.4: the true vehicle is a record, flown by the one LPV model (1e-10 m)": lambda s, d: (
        s.uncertainty is not None and d == "lpv"
    ),
    "0.4: yaw by course goes beside the nonlinear plant": lambda s, d: (
        d == "nonlinear" and any(uas.heading == "course" for uas in s.uas)
    ),
}
"""Why flights of a scenario and a dynamics are not the same as before, to the bit."""

_REPEATABLE = {"horizon": 10, "threads": 1}


@dataclass(frozen=True)
class Case:
    """A flight: scenario and planner, and what `rollout` is given."""

    scenario: str
    planner: str
    options: Mapping[str, Any] = field(default_factory=dict)
    settings: Mapping[str, Any] = field(default_factory=dict)
    level: str | None = None
    searches: bool = False
    """Its planner takes more than a few seconds."""

    @property
    def name(self) -> str:
        """What it is called in tables and files."""
        more = (self.level, *(f"{key}={value}" for key, value in self.settings.items()))
        return " ".join(filter(None, (self.scenario, self.planner, *more)))

    def flown(self) -> Scenario:
        """The scenario at its level."""
        scenario = load_scenario(self.scenario)
        return scenario if self.level is None else with_disturbances(scenario, self.level, seed=0)

    def fly(self) -> Flight:
        """The flight."""
        planner = load_planner(self.planner, self.options)
        return rollout(self.flown(), planner, **self.settings)


CASES = (
    Case("village", "nearest-waypoint"),
    Case("corridor", "lawnmower", settings={"safety_filter": True}),
    Case("mixed_fleet", "lawnmower"),
    Case("gasche2025", "nearest-waypoint", level="light"),
    Case("village", "nearest-waypoint", settings={"dynamics": "nonlinear"}, level="moderate"),
    Case("open_field", "random-walk", settings={"safety_filter": True, "return_mode": True}),
    Case("village", "learned-velocity"),
    Case("village", "trajectory", searches=True),
    Case("village", "tour", searches=True),
    Case("open_field", "milp-mpc", _REPEATABLE, {"max_steps": 20}, searches=True),
)


def hash_of(flight: Flight) -> str:
    """Of all that was flown."""
    found = hashlib.sha256()
    for series in (flight.x, flight.u, flight.soc, flight.voltage_V, flight.current_A, flight.mode,
                   flight.covered, flight.reward_terms):  # fmt: skip
        found.update(np.ascontiguousarray(series).tobytes())
    found.update(repr(flight.violations).encode())
    return found.hexdigest()[:16]


def drawn() -> Iterator[tuple[str, Scenario]]:
    """The missions of the families, by name."""
    for name in (f"{series}:{seed}" for series in SERIES for seed in SEEDS):
        yield name, load_scenario(name)


def hash_of_batch() -> str:
    """Observations and rewards of the environment under random velocities."""
    batch = CoverageBatch(_BATCH, "village", safety_filter=True, return_mode=True)
    batch.reset(0)
    random, found = np.random.default_rng(0), hashlib.sha256()
    for _ in range(_BATCH_STEPS):
        actions = random.uniform(-1.0, 1.0, batch.learners.asked.shape)
        batch.step(actions.astype(np.float32))
        found.update(batch.observation.tobytes() + batch.learners.amounts.tobytes())
    return found.hexdigest()[:16]


def main(
    out: Annotated[Path | None, typer.Option(help="Where to keep the hashes.")] = None,
    against: Annotated[Path | None, typer.Option(help="Hashes to compare with.")] = None,
    quick: Annotated[bool, typer.Option(help="Without the planners that search.")] = False,
) -> None:
    """Hash the flights."""
    console = Console(soft_wrap=True)
    before = None if against is None else _read(against)
    found = {"batch village": hash_of_batch()}
    for case in track([c for c in CASES if not (quick and c.searches)], "missions"):
        found[case.name] = hash_of(case.fly())
    for name, scenario in track(list(drawn()), "drawn missions"):
        planner = load_planner("nearest-waypoint")
        found[name] = hash_of(
            rollout(scenario, planner, max_steps=_DRAWN_STEPS, safety_filter=True, return_mode=True)
        )
    if out is not None:
        text = {"processor": platform.processor() or platform.machine(), "hashes": found}
        out.write_text(json.dumps(text, indent=1) + "\n", encoding="utf-8")
    console.print(f"{len(found)} hashes")
    if before is not None:
        common = found.keys() & before.keys()
        different = sorted(name for name in common if found[name] != before[name])
        console.print(f"{len(common) - len(different)} of {len(common)} are the same to the bit")
        reasons = {name: _reason(name) for name in different}
        for name, reason in reasons.items():
            console.print(f"  differs: {name}: {reason or 'for no reason that is known'}")
        raise typer.Exit(0 if common and all(reasons.values()) else 1)


def _reason(name: str) -> str | None:
    cases = {case.name: case for case in CASES}
    if name in cases:
        scenario = cases[name].flown()
        dynamics = cases[name].settings.get("dynamics", "lpv")
    else:
        scenario = load_scenario("village" if name.startswith("batch") else name)
        dynamics = "lpv"
    return next((why for why, applies in REASONS.items() if applies(scenario, dynamics)), None)


def _read(path: Path) -> dict[str, str]:
    try:
        return dict(json.loads(path.read_text(encoding="utf-8"))["hashes"])
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise InputError(f"{path}: holds no hashes ({error}); write it with --out") from None


if __name__ == "__main__":
    try:
        typer.run(main)
    except InputError as error:
        print(f"error: {error}", file=sys.stderr)
        sys.exit(2)
