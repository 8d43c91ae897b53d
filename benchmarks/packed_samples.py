"""What rows without a decision cost a learner: PPO and MaskablePPO with and without them.

    python benchmarks/packed_samples.py --level hard --seeds 2 --seconds 60

Prints the table of docs/batched.md: the same processor time, learning included, and validation
missions at the end. Needs the extra `learn`.
"""

from __future__ import annotations

import argparse
import sys
import time
from typing import Any

import torch
from sb3_contrib import MaskablePPO
from sb3_contrib.common.maskable.buffers import MaskableRolloutBuffer
from stable_baselines3 import PPO
from stable_baselines3.common.buffers import RolloutBuffer
from uas_coverage_agents.training.rollouts import (
    FlownMaskableRolloutBuffer,
    FlownRolloutBuffer,
    FlownSteps,
)
from uas_coverage_agents.training.vec_env import CoverageVecEnv

from uas_coverage_env.tasks import level_named, score

LEARNERS: dict[str, tuple[Any, str, dict[str, Any]]] = {
    "PPO, velocity": (
        PPO,
        "velocity",
        {"decisions": FlownRolloutBuffer, "every row": RolloutBuffer},
    ),
    "MaskablePPO, waypoint": (
        MaskablePPO,
        "waypoint",
        {"decisions": FlownMaskableRolloutBuffer, "every row": MaskableRolloutBuffer},
    ),
}
N_MISSIONS = 100
"""To learn from, of the training split."""

HEAD = (
    "learner", "seed", "learned from", "rows without a decision, %", "flown steps", "covered, %",
    "home", "score",
)  # fmt: skip


class Counted(FlownSteps):
    """Counts rows, too."""

    rows = 0

    def _on_step(self) -> bool:
        self.rows += self.training_env.num_envs
        return super()._on_step()


def main() -> None:
    """Train, score and print."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--level", default="hard")
    parser.add_argument("--seeds", type=int, default=2)
    parser.add_argument("--seconds", type=float, default=60.0, help="of processor time each")
    parser.add_argument("--missions", type=int, default=50, help="of the validation split")
    given = parser.parse_args()
    torch.set_num_threads(1)
    for cells in (HEAD, ("---", "---:", "---", *["---:"] * 5)):
        sys.stdout.write(f"| {' | '.join(cells)} |\n")
    for name in LEARNERS:
        for seed in range(given.seeds):
            for which in LEARNERS[name][2]:
                cells = trained(name, which, seed, given)
                sys.stdout.write(f"| {' | '.join(cells)} |\n")
                sys.stdout.flush()


def trained(name: str, which: str, seed: int, given: argparse.Namespace) -> tuple[str, ...]:
    """A row of the table."""
    learner, action, buffers = LEARNERS[name]
    task = level_named(given.level)
    missions = list(task.scenarios("training", N_MISSIONS).values())
    env = CoverageVecEnv(16, missions, **task.settings(action=action))
    buffer = buffers[which]
    model = learner(
        "MlpPolicy", env, n_steps=128, batch_size=256, seed=seed, rollout_buffer_class=buffer,
        device="cpu",
    )  # fmt: skip
    counted = Counted()
    model.learn(1, callback=counted)  # compiles
    began_s = time.process_time()
    while time.process_time() - began_s < given.seconds:
        model.learn(1, callback=counted, reset_num_timesteps=False)

    def policy(seen: Any) -> Any:
        if action == "velocity":
            return model.predict(seen, deterministic=True)[0]
        masks = seen["action_mask"]
        return model.predict(seen["observation"], action_masks=masks, deterministic=True)[0]

    chosen = {"action": action, "mask_in_observation": action == "waypoint"}
    n = given.missions
    found = score(policy, given.level, missions=n, split="validation", batch=n, **chosen)
    home, fleet = (sum(getattr(m, f) for m in found.missions) for f in ("home", "n_uas"))
    waits = 1.0 - model.num_timesteps / counted.rows
    cells = name, f"{seed}", which, f"{100.0 * waits:.0f}", f"{model.num_timesteps:,}"
    covered, value = 100.0 * found.mean("coverage"), found.score.value
    return *cells, f"{covered:.0f}", f"{home} of {fleet}", "-" if value is None else f"{value:.2f}"


if __name__ == "__main__":
    main()
