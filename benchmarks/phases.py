"""A mission flown with what moves elsewhere on its way: another seed and another phase each time.

    python benchmarks/phases.py indoor trajectory tour

In phase k of n the first moving obstacle has begun k/n of its round (until its third velocity)
before the mission. Flight k has phase k and seed k; with `--grid` each seed is flown in each phase.
The safety filter is on where a planner takes it. Printed are sums, and medians with their ranges.
"""

from typing import Annotated

import numpy as np
import typer
from rich.console import Console
from rich.progress import track
from rich.table import Table

from uas_coverage_env import Scenario, load_planner, load_scenario, rollout
from uas_coverage_env.scenario import MovingObstacle


def at_phase(scenario: Scenario, share: float) -> Scenario:
    """The scenario with its first moving obstacle by a share (0 to 1) of its round further on."""
    first, *others = scenario.moving_obstacles
    begins_s = np.array([part.from_s for part in first.schedule])
    velocity_mps = np.array([part.velocity_mps for part in first.schedule])
    shift_s = share * float(begins_s[2])
    gone_s = np.clip(shift_s - begins_s, 0.0, np.append(np.diff(begins_s), np.inf))
    now = int(np.searchsorted(begins_s, shift_s, side="right")) - 1
    known = first.model_dump() | {
        "start_m": tuple(np.array(first.start_m) + gone_s @ velocity_mps),
        "schedule": [
            {"from_s": max(begin_s - shift_s, 0.0), "velocity_mps": tuple(velocity)}
            for begin_s, velocity in zip(begins_s[now:], velocity_mps[now:], strict=True)
        ],
    }
    moved = MovingObstacle.model_validate(known)
    return scenario.model_copy(update={"moving_obstacles": (moved, *others)})


def main(
    scenario: Annotated[str, typer.Argument(help="Something moves in it.")],
    planners: Annotated[list[str], typer.Argument(help="Planners.")],
    phases: Annotated[int, typer.Option(min=1, help="Of what moves.")] = 10,
    seeds: Annotated[int, typer.Option(min=1, help="Of the planner.")] = 10,
    grid: Annotated[bool, typer.Option(help="Fly each seed in each phase.")] = False,
) -> None:
    """Fly the mission."""
    mission = load_scenario(scenario)
    if not mission.moving_obstacles or len(mission.moving_obstacles[0].schedule) < 3:
        raise typer.BadParameter(f"{scenario}: nothing moves with a schedule of three velocities")
    pairs = [(k % phases, k % seeds) for k in range(max(phases, seeds))]
    if grid:
        pairs = [(phase, seed) for phase in range(phases) for seed in range(seeds)]
    table = Table("planner", "accomplished", "contacts, limits", "breaches", "fallbacks", "steps",
                  "Wh", "least charge, %", "longest decision, s")  # fmt: skip
    for name in planners:
        counts, measured = [], []
        for phase, seed in track(pairs, name):
            planner = load_planner(name)
            takes_filter = True if hasattr(planner, "assistants") else None
            flight = rollout(
                at_phase(mission, phase / phases), planner, seed, safety_filter=takes_filter
            )
            f = flight.figures
            counts.append((f["accomplished"], len(f["violations"]), f["breaches"], f["fallbacks"]))
            longest_s = f["decision_processor_s"]["max"]
            measured.append((f["steps"], f["energy_Wh"], 100 * f["min_soc_share"], longest_s))
        accomplished, *sums = map(sum, zip(*counts, strict=True))
        spread = [
            f"{np.median(c):.3g} ({min(c):.3g} to {max(c):.3g})"
            for c in zip(*measured, strict=True)
        ]
        table.add_row(name, f"{accomplished} of {len(pairs)}", *map(str, sums), *spread)
    Console(width=220).print(table)


if __name__ == "__main__":
    typer.run(main)
