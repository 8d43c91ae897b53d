"""Pictures per second of `render`, and what keeping the background is worth, in one run.

    python benchmarks/rendering.py
    python benchmarks/rendering.py --steps 50 --envs 4

Missions are flown by the waypoint action (always to the nearest open waypoint, assisted) and
rendered after every step; only `render` is timed, in processor time. Every tenth step the naive
version takes its turn: `uas_coverage_env.draw.picture`, which draws terrain, buildings and fence
anew. It draws the first mission at the same size, and is charged as often as there are missions in
the picture. The figure that matplotlib draws of the same map is timed once per scenario.
"""

import math
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Annotated, Any

import gymnasium as gym
import numpy as np
import typer
from rich.console import Console
from rich.table import Table

import uas_coverage_env  # noqa: F401  it registers the ids
from uas_coverage_env.draw import picture
from uas_coverage_env.flight import load_planner, rollout
from uas_coverage_env.replay.figures import map_figure, png_of
from uas_coverage_env.scenario import Scenario, load_scenario, sample_scenario

GENERATED_SEED = 1000
TURNS = 10
"""For so many pictures of ours the naive version draws one."""

MATPLOTLIB_STEPS = 60
_FLYING = {"action": "waypoint", "return_mode": True, "safety_filter": True}

console = Console(width=160)


@dataclass
class Speed:
    """Processor time of `render` and of its naive version.

    Attributes:
        what: What was rendered.
        size: Of what `render` gives.
        ours_s: For one call of `render`; medians.
        naive_s: The same with everything drawn anew.
    """

    what: str
    size: str
    ours_s: float
    naive_s: float


def timed(draw: Callable[[], Any]) -> tuple[float, Any]:
    """Processor time of a call [s], and what it gave."""
    began = time.process_time()
    result = draw()
    return time.process_time() - began, result


def many(scenario: Scenario, num_envs: int, **settings: Any) -> Any:
    """So many missions in one scenario."""
    return gym.make_vec(
        "UASCoverage-v0",
        num_envs=num_envs,
        vectorization_mode="vector_entry_point",
        scenario=scenario,
        **_FLYING,
        **settings,
    )


def measured(what: str, scenario: Scenario, env: Any, states: Any, steps: int) -> Speed:
    """Fly and render.

    Args:
        what: What it is called.
        scenario: What is flown.
        env: Whose `render` is timed.
        states: The environment that tells the states: itself, or a batch of one mission that flies
            the same.
        steps: How many to fly.
    """
    env.reset(seed=0)
    if states is not env:
        states.reset(seed=0)
    actions = np.zeros(env.action_space.shape, dtype=int)
    paths: list[list[np.ndarray]] = [[] for _ in range(states.num_envs)]
    ours_s: list[float] = []
    naive_s: list[float] = []
    shape = ""
    for step in range(steps + 1):
        swarms = states.call("swarm_state")
        for path, swarm in zip(paths, swarms, strict=True):
            if swarm.step == 0:
                path.clear()
            path.append(swarm.x[:, :3].copy())
        duration_s, frames = timed(env.render)
        if step:  # the first call draws the background
            ours_s.append(duration_s)
        if step % TURNS == 0:
            size_px, shown, shape = _layout(frames, states.num_envs)
            of_one = partial(_anew, scenario, swarms[0], paths[0], size_px)
            naive_s.append(shown * timed(of_one)[0])
        env.step(actions)
        if states is not env:
            states.step(actions[None])
    return Speed(what, shape, float(np.median(ours_s)), float(np.median(naive_s)))


def _anew(scenario: Scenario, swarm: Any, path: list[np.ndarray], size_px: int) -> Any:
    return picture(scenario, swarm, paths_m=np.array(path), size_px=size_px)


def _layout(frames: Any, num_envs: int) -> tuple[int, int, str]:
    """Side of one mission's picture, how many are shown, and the size of all in words."""
    if isinstance(frames, tuple):
        return frames[0].shape[0], len(frames), f"{len(frames)} of {frames[0].shape[0]}²"
    if num_envs == 1:
        return frames.shape[0], 1, f"{frames.shape[0]}²"
    shown = min(num_envs, 16)
    size_px = frames.shape[1] // math.ceil(math.sqrt(shown))
    return size_px, shown, f"{frames.shape[1]} x {frames.shape[0]}, {shown} tiles of {size_px}²"


def matplotlib_s(scenario: Scenario) -> float:
    """Processor time of the figure of a flight in this scenario."""
    flight = rollout(scenario, load_planner("nearest-waypoint"), max_steps=MATPLOTLIB_STEPS)
    png_of(map_figure(flight))
    return timed(lambda: png_of(map_figure(flight)))[0]


def main(
    steps: Annotated[int, typer.Option(min=1, help="How many are rendered.")] = 200,
    envs: Annotated[str, typer.Option(help="Sizes of the batches.")] = "4,16,64",
) -> None:
    """Measure, and print a table."""
    try:
        batches = [int(part) for part in envs.split(",") if part]
    except ValueError:
        batches = [0]
    if min(batches, default=1) < 1:
        sys.stderr.write(f"error: --envs {envs!r}: should be whole numbers, as in 4,16\n")
        raise typer.Exit(2)
    village = load_scenario("village")
    town = sample_scenario(GENERATED_SEED)
    speeds = []
    for scenario in (village, town):
        env = gym.make(
            "UASCoverage-v0",
            scenario=scenario,
            render_mode="rgb_array",
            **_FLYING,
        ).unwrapped
        what = f"one environment, {scenario.name}"
        speeds.append(measured(what, scenario, env, many(scenario, 1), steps))
    for num_envs in batches:
        for mode in ("rgb_array_tiled", "rgb_array"):
            env = many(village, num_envs, render_mode=mode)
            what = f"{num_envs} environments, {mode}"
            speeds.append(measured(what, village, env, env, max(1, steps // num_envs)))
    table = Table(
        "rendered", "picture", "per second", "naive, per second", "times as fast", box=None
    )
    for speed in speeds:
        table.add_row(
            speed.what,
            speed.size,
            f"{1 / speed.ours_s:.0f}",
            f"{1 / speed.naive_s:.1f}",
            f"{speed.naive_s / speed.ours_s:.1f}",
        )
    console.print(table)
    for scenario in (village, town):
        console.print(f"matplotlib's figure of {scenario.name}: {1 / matplotlib_s(scenario):.1f}/s")


if __name__ == "__main__":
    typer.run(main)
