"""`trajectory` beside other planners: steps, energy, harm, and processor time.

    python benchmarks/trajectory.py                           village, ten seeds; dev; beside tour
    python benchmarks/trajectory.py --towns 7000:7100 --rows flights.jsonl
    python benchmarks/trajectory.py --village 0:3 --towns 2000:2005 --planners trajectory,tour
    python benchmarks/trajectory.py --option milp-mpc-guided:deterministic=true \
        --planners trajectory,milp-mpc-guided

Times are processor seconds of one process, so that they mean much the same on a busy machine:
before take-off, and per decision. With --rows each flight is kept in a file, one line of JSON each,
and not flown again when the benchmark is called again: for long runs, and runs cut short. Rows
belong to one state of the code; take a new file for another.
"""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer
from rich.console import Console
from rich.table import Table

from uas_coverage_env import (
    MissionBrief,
    Scenario,
    SwarmState,
    load_planner,
    load_scenario,
    rollout,
)
from uas_coverage_env.files.strict_toml import InputError
from uas_coverage_env.flight import Planner
from uas_coverage_env.flight.metrics import accomplished, energy_Wh
from uas_coverage_env.leaderboard import seed_range
from uas_coverage_env.scenario import sample_scenario
from uas_coverage_env.world import Command

console = Console(width=150)


@dataclass(frozen=True)
class Row:
    """One flight.

    Attributes:
        scenario: Its name.
        seed: Of the planner.
        planner: Its name.
        options: Text of its options.
        steps: Until it ended.
        energy_Wh: Of all UAS.
        covered: Share of the waypoints.
        accomplished: See `docs/rules.md`.
        violations: How many.
        breaches: How many.
        fallbacks: Decisions flown on a fallback.
        first_s: Processor time before take-off, the first decision included.
        decision_ms: Median, 95th percentile and largest of the other decisions.
    """

    scenario: str
    seed: int
    planner: str
    options: str
    steps: int
    energy_Wh: float  # noqa: N815
    covered: float
    accomplished: bool
    violations: int
    breaches: int
    fallbacks: int
    first_s: float
    decision_ms: tuple[float, float, float]

    @property
    def key(self) -> tuple[str, int, str, str]:
        """What flight it is."""
        return self.scenario, self.seed, self.planner, self.options


class Timed:
    """A planner, and the processor time that it takes."""

    def __init__(self, planner: Planner) -> None:
        self._planner = planner
        self.reset_s, self.decisions_s, self.fallbacks = 0.0, [], 0
        for name in ("assistants", "options"):
            if hasattr(planner, name):
                setattr(self, name, getattr(planner, name))

    def warm_up(self, brief: MissionBrief) -> None:
        """Compile, which is not timed."""
        if hasattr(self._planner, "warm_up"):
            self._planner.warm_up(brief)

    def reset(self, brief: MissionBrief, seed: int) -> None:
        """See `Planner`."""
        began = time.process_time()
        self._planner.reset(brief, seed)
        self.reset_s = time.process_time() - began

    def act(self, swarm: SwarmState) -> Mapping[str, Command]:
        """See `Planner`."""
        began = time.process_time()
        commands = self._planner.act(swarm)
        self.decisions_s.append(time.process_time() - began)
        self.last_decision = getattr(self._planner, "last_decision", None)
        self.fallbacks += bool(self.last_decision and self.last_decision.fallback)
        return commands


def fly(scenario: Scenario, seed: int, name: str, options: Mapping[str, Any]) -> Row:
    """Fly one mission."""
    planner = Timed(load_planner(name, options))
    flight = rollout(scenario, planner, seed=seed)
    later_ms = 1e3 * np.array(planner.decisions_s[1:] or [0.0])
    return Row(
        scenario.name,
        seed,
        name,
        _text(options),
        flight.steps,
        float(energy_Wh(flight).sum()),
        float(flight.covered[-1]) / len(scenario.waypoints),
        accomplished(flight),
        len(flight.violations),
        int(flight.breaches),
        planner.fallbacks,
        planner.reset_s + planner.decisions_s[0],
        (float(np.median(later_ms)), float(np.percentile(later_ms, 95)), float(later_ms.max())),
    )


def _text(options: Mapping[str, Any]) -> str:
    return ",".join(f"{name}={value}" for name, value in sorted(options.items()))


def _kept(path: Path | None) -> dict[tuple[str, int, str, str], Row]:
    if path is None or not path.exists():
        return {}
    try:
        rows = [Row(**json.loads(line)) for line in path.read_text().splitlines()]
    except (ValueError, TypeError) as error:
        raise InputError(f"{path}: not the rows of this benchmark; name another file") from error
    return {row.key: row for row in rows}


def _options(texts: list[str]) -> dict[str, dict[str, str]]:
    result: dict[str, dict[str, str]] = {}
    for text in texts:
        planner, colon, setting = text.partition(":")
        name, equals, value = setting.partition("=")
        if not (colon and equals):
            raise InputError(f"--option {text!r}: should be PLANNER:NAME=VALUE")
        result.setdefault(planner, {})[name] = value
    return result


def show(title: str, rows: list[Row], planners: list[str]) -> None:
    """Print each flight, the median of each planner, and paired differences to the first."""
    table = Table(
        *("scenario", "seed", "planner", "steps", "Wh", "covered", "home", "harm", "fallbacks"),
        *("first s", "p50 ms", "p95 ms", "max ms"),
        title=title,
    )
    for row in rows:
        table.add_row(row.scenario, str(row.seed), row.planner, *_cells(row))
    console.print(table)
    first = {(r.scenario, r.seed): r for r in rows if r.planner == planners[0]}
    for planner in planners:
        own = [row for row in rows if row.planner == planner]
        steps, energy = np.array([(r.steps, r.energy_Wh) for r in own]).T
        text = (
            f"{planner}: accomplished {sum(r.accomplished for r in own)}/{len(own)}, "
            f"violations {sum(r.violations for r in own)}, "
            f"breaches {sum(r.breaches for r in own)}, "
            f"median {np.median(steps):.0f} steps and {np.median(energy):.2f} Wh, "
            f"first plan {np.median([r.first_s for r in own]):.2f} s, "
            f"decisions {np.median([r.decision_ms[0] for r in own]):.1f} ms"
        )
        both = [(r, first[r.scenario, r.seed]) for r in own if (r.scenario, r.seed) in first]
        if planner != planners[0] and both:
            less = [100.0 * (1.0 - one.energy_Wh / other.energy_Wh) for other, one in both]
            fewer = [100.0 * (1.0 - one.steps / other.steps) for other, one in both]
            text += (
                f"; {planners[0]} takes {_with_error(less)} % less energy "
                f"and {_with_error(fewer)} % fewer steps"
            )
        console.print(text, highlight=False)


def _with_error(values: list[float]) -> str:
    """Mean, and the standard error of the mean."""
    error = np.std(values, ddof=1) / np.sqrt(len(values)) if len(values) > 1 else np.nan
    return f"{np.mean(values):.1f} ± {error:.1f}"


def _cells(row: Row) -> list[str]:
    return [
        str(row.steps),
        f"{row.energy_Wh:.2f}",
        f"{row.covered:.0%}",
        "yes" if row.accomplished else "no",
        f"{row.violations}, {row.breaches}",
        str(row.fallbacks),
        f"{row.first_s:.2f}",
        *(f"{value:.1f}" for value in row.decision_ms),
    ]


def main(
    village: Annotated[str, typer.Option(help="FIRST:END of seeds; empty: none.")] = "0:10",
    towns: Annotated[
        str, typer.Option(help="FIRST:END of generated towns; empty: none.")
    ] = "2000:2020",
    planners: Annotated[str, typer.Option(help="Names, separated by commas.")] = "trajectory,tour",
    option: Annotated[list[str] | None, typer.Option(help="PLANNER:NAME=VALUE.")] = None,
    rows: Annotated[Path | None, typer.Option(help="Where flights are kept.")] = None,
) -> None:
    """Fly, and print tables."""
    names, options, kept = planners.split(","), _options(option or []), _kept(rows)
    jobs: dict[str, list[tuple[Scenario, int]]] = {}
    if village:
        scenario = load_scenario("village")
        jobs["village"] = [(scenario, seed) for seed in seed_range("--village", village)]
    if towns:
        jobs["towns"] = [(sample_scenario(seed), 0) for seed in seed_range("--towns", towns)]
    for title, missions in jobs.items():
        flown = []
        for scenario, seed in missions:
            for name in names:
                chosen = options.get(name, {})
                row = kept.get((scenario.name, seed, name, _text(chosen)))
                if row is None:
                    with console.status(f"{scenario.name}, seed {seed}, {name}"):
                        row = fly(scenario, seed, name, chosen)
                    if rows is not None:
                        with rows.open("a") as file:
                            file.write(json.dumps(asdict(row)) + "\n")
                flown.append(row)
        show(title, flown, names)


if __name__ == "__main__":
    app = typer.Typer(add_completion=False, pretty_exceptions_enable=False)
    app.command()(main)
    try:
        app()
    except InputError as error:
        sys.stderr.write(f"error: {error}\n")
        sys.exit(2)
