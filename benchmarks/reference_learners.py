"""What learners reach on the levels, and what each part of one is worth: trains, scores, publishes.

    python benchmarks/reference_learners.py --seeds 5 --publish "reference learners: {}"
    python benchmarks/reference_learners.py --levels hard --learners ppo-waypoint --seeds 5
    python benchmarks/reference_learners.py --levels hard --learners ppo-waypoint --variants all \
        --share 0.25 --split validation --publish "{} ppo-waypoint ablation"

Learners are those of `uas-coverage train`, or a .toml of your own; variants are settings that
depart from theirs (`VARIANTS`). Trainings that are finished are not repeated, others go on; their
policies fly the missions of a split side by side where they can. Needs the extra `learn`.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator, Mapping
from pathlib import Path

from learners import put
from uas_coverage_agents.training.rounds import POLICY, TrainingJob, TrainingProgress, train
from uas_coverage_agents.training.score import Validation
from uas_coverage_agents.training.settings import FOLDER, LearnerSettings, settings_of

from uas_coverage_env.env.versions import V0
from uas_coverage_env.files.strict_toml import InputError
from uas_coverage_env.runner.workers import Workers
from uas_coverage_env.tasks import LEVELS, level_named, score
from uas_coverage_env.tasks.scoring import MissionScore, batched, scored
from uas_coverage_env.tasks.table import shown
from uas_coverage_env.tasks.task import level_name

DOCS = Path(__file__).parents[1] / "docs"
REFERENCE = sorted(
    path.stem
    for path in FOLDER.glob("*.toml")
    if not path.stem.endswith(("-route", "-velocity", "-waypoint"))
)
HEAD = (
    "learner", "flown steps", "processor time, s", "trainings", "score [95 %]", "covered, %",
    "home, %", "energy, %", "return", "missions",
)  # fmt: skip

Row = tuple[str, LearnerSettings]
"""Its meaning, and what is trained."""

_PAYS = "learning.phases.*.reward_weights"
_POTENTIALS = (f"{_PAYS}.to_waypoint=0.0", f"{_PAYS}.to_home=0.0")

VARIANTS: Mapping[str, Mapping[str, tuple[str, ...]]] = {
    "ppo-waypoint": {
        "no-potentials": ("no potential to waypoints or home", *_POTENTIALS),
        "no-left-open": ("landing does not cost what is left open", f"{_PAYS}.left_open=0.0"),
        "losses-cheap": ("a loss costs 10", f"{_PAYS}.violation=10.0"),
        "losses-dear": ("a loss costs 20", f"{_PAYS}.violation=20.0"),
        "patient": ("a second costs 0.01, so that hovering is cheap", f"{_PAYS}.time=0.01"),
        "no-scorer": ("choices are outputs, no scorer", "learning.width=0"),
        "v0": (
            "environment v0: no hold, no climb, no ways, no terms of v1",
            'environment.version="v0"',
            f"{_PAYS}={{home=10.0, violation=14.0, energy=0.1, time=0.03}}",
        ),
    },
    "ppo-velocity": {
        "same-noise": ("noise 0.3 throughout", "learning.phases.*.noise=[0.3, 0.3]"),
        "no-potentials": ("no potential to waypoints or home", *_POTENTIALS),
        "no-scorer": ("velocities are outputs, no scorer", "learning.width=0"),
    },
}
"""Learner -> variant -> its meaning, and what is other than shipped, as `--set` takes it."""


def main() -> int:
    """Train, score, publish; the exit code."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--levels", default="easy", help=f"of {', '.join(LEVELS)}")
    parser.add_argument("--learners", default=",".join(REFERENCE))
    parser.add_argument("--variants", default="", help="with commas between them, or all")
    parser.add_argument("--seeds", type=int, default=1, help="trainings of each row")
    parser.add_argument("--share", type=float, default=1.0, help="of the steps of the settings")
    parser.add_argument("--missions", type=int, default=50, help="on which each is scored")
    parser.add_argument("--split", default="test", choices=("validation", "test"))
    parser.add_argument("--jobs", type=int, default=1, help="trainings side by side")
    parser.add_argument("--out", type=Path, default=Path("reference"))
    parser.add_argument("--publish", default="", help="mark on a page of docs; {} is the level")
    given = parser.parse_args()
    if given.seeds < 1 or not 0.0 < given.share <= 100.0 or not 1 <= given.missions <= 50:
        parser.error("--seeds: 1 or more; --share: above 0, at most 100; --missions: 1 to 50")
    try:
        wanted = {level: dict(rows_of(level, given)) for level in given.levels.split(",")}
        pages = {level: page_of(given.publish.format(level)) for level in wanted}
        usual = {action.dest: action.default for action in parser._actions}
        for level, rows in wanted.items():
            text = f"`{command({**vars(given), 'levels': level}, usual)}`\n\n"
            text += "\n".join(f"| {' | '.join(line)} |" for line in table(level, rows, given))
            sys.stdout.write(f"{text}\n")
            if page := pages[level]:
                put(given.publish.format(level), text, page)
    except InputError as error:
        sys.stderr.write(f"error: {error}\n")
        return 2
    return 0


def rows_of(level: str, given: argparse.Namespace) -> Iterator[tuple[str, Row]]:
    """Name -> meaning and settings, of what is trained on a level."""
    if level not in LEVELS:
        raise InputError(f"--levels {level}: is none of {', '.join(LEVELS)}")
    for learner in given.learners.split(","):
        stem, known = Path(learner).stem, VARIANTS.get(Path(learner).stem, {})
        shipped = settings_of(learner, scenario=level)
        steps = f"total_timesteps={max(1, round(given.share * shipped.total_timesteps))}"
        yield stem, (shipped.summary, settings_of(learner, scenario=level, changes=[steps]))
        named = known if given.variants == "all" else filter(None, given.variants.split(","))
        for name in named:
            if name not in known:
                raise InputError(f"--variants {name}: {stem} has {', '.join(known) or 'none'}")
            meaning, *changes = known[name]
            settings = settings_of(learner, scenario=level, changes=[steps, *changes])
            yield f"{stem}-{name}", (meaning, settings)


def page_of(mark: str) -> Path | None:
    """The page of docs that has a mark; None: it is empty."""
    if not mark:
        return None
    for page in sorted(DOCS.glob("*.md")):
        if f"<!-- {mark} -->" in page.read_text("utf-8"):
            return page
    raise InputError(f"--publish: no page of docs has <!-- {mark} -->")


def table(level: str, rows: Mapping[str, Row], given: argparse.Namespace) -> list[tuple[str, ...]]:
    """The lines of a table; steps and processor time are those of one training."""

    def told(progress: TrainingProgress) -> None:
        which = f"{level}, {progress.job.name}, seed {progress.job.seed}"
        sys.stderr.write(f"{which}: round {progress.rounds}, {progress.steps} flown steps\n")

    lines: list[tuple[str, ...]] = [HEAD, ("---", *["---:"] * (len(HEAD) - 1))]
    for name, (meaning, settings) in rows.items():
        tried = max(1, round(20 * min(given.share, 1.0)))  # missions of its own score
        jobs = {
            given.out / level / f"{name}-{seed}": TrainingJob(name, settings, seed, tried)
            for seed in range(given.seeds)
        }
        with Workers(given.jobs) as workers:
            policies = train(jobs, Validation(workers), told)
        trained = [policy.description.training for policy in policies.values()]
        flown = level_name(level, settings.environment.version or V0.name)
        missions = [each for place in policies for each in missions_of(place, flown, given)]
        found = scored(flown, missions)
        home = sum(each.home for each in missions) / sum(each.n_uas for each in missions)
        lines.append(
            (
                f"`{name}`: {meaning}",
                f"{sum(each.steps for each in trained) / len(trained):,.0f}".replace(",", " "),
                f"{sum(each.process_s for each in trained) / len(trained):.0f}",
                f"{len(trained)}",
                shown(found.score),
                f"{100.0 * found.mean('coverage'):.1f}",
                f"{100.0 * home:.1f}",
                f"{100.0 * found.mean('energy_share'):.1f}",
                f"{found.mean('episode_return'):.1f}",
                f"{len(missions)}",
            )
        )
    return lines


def missions_of(place: Path, level: str, given: argparse.Namespace) -> tuple[MissionScore, ...]:
    """The missions of a level as the policy of a training flies them."""
    planner = f"policy:{place / POLICY}"
    batch = given.missions if batched(planner, level_named(level)) else None
    return score(planner, level, missions=given.missions, split=given.split, batch=batch).missions


def command(given: Mapping[str, object], usual: Mapping[str, object]) -> str:
    """The line that makes the table of a level again."""
    words = ["python benchmarks/reference_learners.py"]
    for name, value in given.items():
        if name not in ("jobs", "publish", "out") and value != usual[name]:
            words.append(f"--{name} {value}")
    return " ".join([*words, f"--out {Path(str(given['out'])).name}"])


if __name__ == "__main__":
    sys.exit(main())
