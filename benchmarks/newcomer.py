"""What the fifteen lines of docs/levels.md learn: plain PPO on the level easy.

    python benchmarks/newcomer.py --out newcomer
    uas-coverage figure newcomer/* --kind training --out docs/pictures/newcomer.png --overwrite

Trains PPO of Stable-Baselines3 with its default hyperparameters, one torch thread, a training for
each seed, and evaluates it on missions of the validation split. Each training leaves a
`learning_curve.csv`; one that has left it is not repeated. Needs the extra `learn`.
"""

from __future__ import annotations

import argparse
import csv
import time
from pathlib import Path
from typing import Any

import gymnasium
import torch
from stable_baselines3 import PPO

import uas_coverage_env  # noqa: F401  # registers the environments
from uas_coverage_env.flight import Evaluation, evaluate
from uas_coverage_env.tasks import level_named, seeds_of

LEVEL, MISSIONS = "easy", 10
COLUMNS = ("steps", "seconds", "return", "coverage", "violations", "energy_Wh", "flight_steps")


def main() -> None:
    """Train and evaluate."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--steps", type=int, default=98_304)
    parser.add_argument("--every", type=int, default=8_192)
    parser.add_argument("--out", type=Path, default=Path("newcomer"))
    given = parser.parse_args()
    torch.set_num_threads(1)
    for planner in ("random-walk", "nearest-waypoint", "tour"):
        write(given.out / planner, [row(0, 0.0, flown(planner))])
    for seed in range(given.seeds):
        folder = given.out / f"seed-{seed}"
        if not (folder / "learning_curve.csv").exists():
            write(folder, trained(seed, given.steps, given.every))


def trained(seed: int, steps: int, every: int) -> list[dict[str, float]]:
    """The curve of a training; seconds are those of the processor, without evaluations."""
    env = gymnasium.make("UASCoverage/Easy-v0")
    model = PPO("MlpPolicy", env, seed=seed, device="cpu")
    seconds, rows = 0.0, []
    while True:
        rows.append(row(model.num_timesteps, seconds, flown(policy_of(model))))
        print(seed, {name: round(value, 2) for name, value in rows[-1].items()}, flush=True)
        if model.num_timesteps >= steps:
            return rows
        began = time.process_time()
        model.learn(every, reset_num_timesteps=False)
        seconds += time.process_time() - began


def policy_of(model: PPO) -> Any:
    """The policy that a model flies with in the end."""
    return lambda seen: model.predict(seen, deterministic=True)[0]


def flown(planner: Any) -> Evaluation:
    """Validation missions."""
    task = level_named(LEVEL)
    episodes = [
        episode
        for seed in seeds_of("validation")[:MISSIONS]
        for episode in evaluate(
            planner, task.scenario(seed), seeds=[seed], swarm_of=1, **task.settings()
        ).episodes
    ]
    return Evaluation(tuple(episodes))


def row(steps: int, seconds: float, flown: Evaluation) -> dict[str, float]:
    """A row of a learning curve."""
    values = (
        *(steps, seconds, flown.mean("episode_return"), flown.mean("coverage")),
        *(flown.mean("lost"), flown.mean("energy_Wh"), flown.mean("steps")),
    )
    return dict(zip(COLUMNS, values, strict=True))


def write(folder: Path, rows: list[dict[str, float]]) -> None:
    """Write a learning curve."""
    folder.mkdir(parents=True, exist_ok=True)
    with (folder / "learning_curve.csv").open("w", newline="", encoding="utf-8") as file:
        writer: Any = csv.DictWriter(file, COLUMNS, lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)


if __name__ == "__main__":
    main()
