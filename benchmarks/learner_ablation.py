"""What `ppo-waypoint` and `ppo-velocity` reach, and what each part of them is worth: one table.

    python benchmarks/learner_ablation.py --out ablation                     # of ppo-waypoint
    python benchmarks/learner_ablation.py --out ablation --only shipped --seeds 5 --share 1
    python benchmarks/learner_ablation.py --learner ppo-velocity --out ablation --publish

Each variant is trained as `uas-coverage train` does (resumable, rounds; `--share` of its steps),
and its policy flies the missions of a split in one batch. Needs the extra `learn`.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from learners import put
from uas_coverage_agents.policy import load_policy
from uas_coverage_agents.policy.environment import action_of, keywords_of
from uas_coverage_agents.training.rounds import POLICY, TrainingJob, TrainingProgress, train
from uas_coverage_agents.training.score import Validation
from uas_coverage_agents.training.settings import LearnerSettings, settings_of

from uas_coverage_env.files.strict_toml import InputError
from uas_coverage_env.runner.workers import Workers
from uas_coverage_env.tasks import score
from uas_coverage_env.tasks.scoring import MissionScore, scored
from uas_coverage_env.tasks.task import LEARNERS_CHOICE, level_name

PAGE = Path(__file__).parents[1] / "docs" / "reference_learners.md"
HEAD = (
    "variant", "decisions", "processor time, s", "trainings", "score [95 %]", "covered, %",
    "home, %", "lost, %",
)  # fmt: skip


@dataclass(frozen=True)
class Variant:
    """What is other than in the shipped settings.

    Attributes:
        meaning: In words.
        weights: Of the reward, in all phases.
        learning: Keys of `[learning]`.
        environment: Keys of `[environment]`.
        phase: Keys of each phase.
    """

    meaning: str
    weights: Mapping[str, float] = field(default_factory=dict)
    learning: Mapping[str, Any] = field(default_factory=dict)
    environment: Mapping[str, Any] = field(default_factory=dict)
    phase: Mapping[str, Any] = field(default_factory=dict)

    def of(self, settings: LearnerSettings, share: float) -> LearnerSettings:
        """The settings with it, for a share of the steps: phases begin as much earlier."""
        data = settings.model_dump(exclude_unset=True)
        data["total_timesteps"] = round(share * data["total_timesteps"])
        data["environment"] |= self.environment
        learning = data["learning"] | self.learning
        learning["phases"] = [
            {
                **phase,
                **self.phase,
                "begins": round(share * phase.get("begins", 0)),
                "reward_weights": phase["reward_weights"] | self.weights,
            }
            for phase in learning["phases"]
        ]
        return LearnerSettings.model_validate(data | {"learning": learning})


VARIANTS = {
    "ppo-waypoint": {
        "shipped": Variant("as it is shipped"),
        "no-potentials": Variant(
            "no potential to waypoints or home", {"to_waypoint": 0.0, "to_home": 0.0}
        ),
        "no-left-open": Variant("landing does not cost what is left open", {"left_open": 0.0}),
        "rewards-alone": Variant("neither", {"to_waypoint": 0.0, "to_home": 0.0, "left_open": 0.0}),
        "losses-dear": Variant("a loss costs 10 from the first step on", {"violation": 10.0}),
        "losses-cheap": Variant("a loss costs 4 to the end", {"violation": 4.0}),
        "no-scorer": Variant("choices are outputs, no scorer", learning={"width": 0}),
        "v0": Variant(
            "environment v0: no hold, no climb, no ways, no terms of v1",
            environment={"version": "v0"},
            phase={"reward_weights": {"home": 10.0, "violation": 4.0, "energy": 0.1}},
        ),
    },
    "ppo-velocity": {
        "shipped": Variant("as it is shipped"),
        "same-noise": Variant("noise 0.3 throughout", phase={"noise": (0.3, 0.3)}),
        "no-potentials": Variant(
            "no potential to waypoints or home", {"to_waypoint": 0.0, "to_home": 0.0}
        ),
    },
}


def main() -> int:
    """Train, score, print; the exit code."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--learner", default="ppo-waypoint", choices=VARIANTS)
    parser.add_argument("--only", default="", help="variants, with commas between them")
    parser.add_argument("--seeds", type=int, default=1, help="trainings of each variant")
    parser.add_argument("--share", type=float, default=0.25, help="of the steps of the settings")
    parser.add_argument("--split", default="validation", choices=("validation", "test"))
    parser.add_argument("--jobs", type=int, default=1, help="trainings side by side")
    parser.add_argument("--out", type=Path, default=Path("ablation"))
    parser.add_argument("--publish", action="store_true", help=f"write {PAGE.name}")
    given = parser.parse_args()
    variants = VARIANTS[given.learner]
    names = [name for name in given.only.split(",") if name] or list(variants)
    if given.seeds < 1 or not 0.0 < given.share <= 10.0 or not set(names) <= set(variants):
        parser.error(
            f"--seeds: 1 or more; --share: above 0, at most 10; --only: of {', '.join(variants)}"
        )
    try:
        rows = [row_of(given, name, variants[name]) for name in names]
    except InputError as error:
        sys.stderr.write(f"error: {error}\n")
        return 2
    rule = ("---", *["---:"] * (len(HEAD) - 1))
    table = "\n".join(f"| {' | '.join(row)} |" for row in (HEAD, rule, *rows))
    text = f"`{command(given, names)}`\n\n{table}"
    sys.stdout.write(f"{text}\n")
    if given.publish:
        kind = "scores" if names == ["shipped"] else "ablation"
        put(f"{given.learner} {kind}", text, PAGE)
    return 0


def row_of(given: argparse.Namespace, name: str, variant: Variant) -> tuple[str, ...]:
    """Train a variant, or go on, and score all of its trainings."""
    settings = variant.of(settings_of(given.learner), given.share)
    folder = given.out / f"{given.learner}-{given.share:g}"
    jobs = {
        folder / f"{name}-{seed}": TrainingJob(name, settings, seed, missions=1)
        for seed in range(given.seeds)
    }

    def told(progress: TrainingProgress) -> None:
        which = f"{name}-{progress.job.seed}"
        sys.stderr.write(f"{which}: round {progress.rounds}, {progress.steps} decisions\n")

    with Workers(given.jobs) as workers:
        policies = train(jobs, Validation(workers), told)
    trained = [policy.description.training for policy in policies.values()]
    missions = [each for place in jobs for each in missions_of(place / POLICY, given.split)]
    found = scored(settings.scenario, missions)
    assert found.score.value is not None
    n_uas = sum(each.n_uas for each in missions)
    interval = f" [{found.score.low:.2f}, {found.score.high:.2f}]"
    return (
        f"`{name}`: {variant.meaning}",
        f"{sum(each.steps for each in trained) / len(trained) / 1e6:.2f} M",
        f"{sum(each.process_s for each in trained) / len(trained):.0f}",
        str(len(trained)),
        f"{found.score.value:.2f}{interval}",
        f"{100.0 * found.mean('coverage'):.0f}",
        f"{100.0 * sum(each.home for each in missions) / n_uas:.0f}",
        f"{100.0 * sum(each.lost for each in missions) / n_uas:.0f}",
    )


def missions_of(place: Path, split: str) -> list[MissionScore]:
    """The missions of a split as a policy flies them, in one batch."""
    policy = load_policy(place)
    keywords = keywords_of(policy)
    version = keywords.get("version")
    level = policy.description.scenarios.name
    chosen = {k: v for k, v in keywords.items() if k in LEARNERS_CHOICE and k != "reward_weights"}
    named = level if version is None else level_name(level, version.name)
    found = score(action_of(policy), named, missions=50, split=split, batch=50, **chosen)
    return list(found.missions)


def command(given: argparse.Namespace, names: list[str]) -> str:
    """The line that makes the table again."""
    words = ["python benchmarks/learner_ablation.py", f"--learner {given.learner}"]
    if given.only:
        words.append(f"--only {','.join(names)}")
    words += [f"--seeds {given.seeds}", f"--share {given.share:g}", f"--split {given.split}"]
    return " ".join([*words, f"--out {given.out.name}"])


if __name__ == "__main__":
    sys.exit(main())
