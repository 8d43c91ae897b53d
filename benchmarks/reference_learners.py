"""Reference learners on the levels: trains and scores them, writes docs/level_scores.md.

    python benchmarks/reference_learners.py --out reference             # the budgets of their files
    python benchmarks/reference_learners.py --out reference --share 0.1 # a tenth of the steps
    python benchmarks/reference_learners.py --out reference --publish   # and the table

Learners are those of `uas-coverage train`, or a .toml of your own. Whatever is finished is not
repeated: a kill costs the rounds that are under way, and the missions that are flown. Needs the
extra `learn`.
"""

from __future__ import annotations

import argparse
import sys
from dataclasses import dataclass
from pathlib import Path

from uas_coverage_agents.training.settings import FOLDER, LearnerSettings, settings_of

from uas_coverage_env.files.strict_toml import InputError
from uas_coverage_env.leaderboard import Row
from uas_coverage_env.leaderboard.flying import flown
from uas_coverage_env.runner.store import opened
from uas_coverage_env.runner.workers import Workers
from uas_coverage_env.tasks import LEVELS, Score
from uas_coverage_env.tasks.scoring import DESCRIPTION, MissionScore, entry_of, scored, spec_of

PAGE = Path(__file__).parents[1] / "docs" / "level_scores.md"
FIRST, LAST = "<!-- reference learners: {} -->\n", "<!-- end of reference learners: {} -->"
REFERENCE = sorted(
    path.stem for path in FOLDER.glob("*.toml") if not path.stem.startswith(("learned-", "ppo-"))
)
HEAD = (
    "learner", "flown steps", "processor time, s", "trainings", "score [95 %]", "covered, %",
    "lost or not home", "energy, %", "return", "missions",
)  # fmt: skip


@dataclass(frozen=True)
class Result:
    """A learner on a level: all of its trainings."""

    name: str
    summary: str
    steps: int
    process_s: float
    trainings: int
    score: Score


def main() -> int:
    """Train, score, publish; the exit code."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--levels", default="easy", help=f"of {', '.join(LEVELS)}")
    parser.add_argument("--learners", default=",".join(REFERENCE))
    parser.add_argument("--seeds", type=int, default=1, help="trainings of each learner")
    parser.add_argument("--share", type=float, default=1.0, help="of the steps of their files")
    parser.add_argument("--missions", type=int, default=20, help="test missions of each training")
    parser.add_argument("--jobs", type=int, default=1, help="trainings side by side")
    parser.add_argument("--out", type=Path, default=Path("reference"))
    parser.add_argument("--publish", action="store_true", help="write docs/level_scores.md")
    given = parser.parse_args()
    if given.seeds < 1 or not 0.0 < given.share <= 100.0 or not 1 <= given.missions <= 50:
        parser.error("--seeds: 1 or more; --share: above 0, at most 100; --missions: 1 to 50")
    levels, parts = given.levels.split(","), {}
    try:
        for level in levels:
            if level not in LEVELS:
                raise InputError(f"--levels {level}: is none of {', '.join(LEVELS)}")
            learners = {Path(n).stem: settings(n, level, given) for n in given.learners.split(",")}
            results = [result_of(name, each, given) for name, each in learners.items()]
            run = command(given, level)
            parts[level] = f"\n`{LEVELS[level].id}`: `{run}`\n\n{table(results)}\n\n"
    except InputError as error:
        sys.stderr.write(f"error: {error}\n")
        return 2
    for level, text in parts.items():
        sys.stdout.write(text)
        if given.publish:
            publish(level, text)
    return 0


def settings(name: str, level: str, given: argparse.Namespace) -> LearnerSettings:
    """A learner on a level, with a part of its budget."""
    found = settings_of(name, scenario=level)
    steps = max(1, round(given.share * found.total_timesteps))
    return found.model_copy(update={"total_timesteps": steps})


def publish(level: str, text: str) -> None:
    """Write the table of a level into the page."""
    first, last = FIRST.format(level), LAST.format(level)
    before, there, rest = PAGE.read_text("utf-8").partition(first)
    _, end, after = rest.partition(last)
    if not there or not end:
        raise SystemExit(f"{PAGE}: has no {first.strip()} ... {last}")
    PAGE.write_text(before + first + text + last + after, encoding="utf-8")


def result_of(name: str, learner: LearnerSettings, given: argparse.Namespace) -> Result:
    """Train and score what was not before."""
    from uas_coverage_agents.training.rounds import POLICY, TrainingJob, TrainingProgress, train
    from uas_coverage_agents.training.score import Validation

    level = learner.scenario
    folder = given.out / level
    jobs = {
        folder / f"{name}-{seed}": TrainingJob(name, learner, seed) for seed in range(given.seeds)
    }

    def told(progress: TrainingProgress) -> None:
        which = f"{level}, {name}-{progress.job.seed}"
        sys.stderr.write(f"{which}: round {progress.rounds}, {progress.steps} flown steps\n")

    with Workers(given.jobs) as workers:
        policies = train(jobs, Validation(workers), told)
    trained = [policy.description.training for policy in policies.values()]
    missions = [one for place in jobs for one in score_of(place / POLICY, level, given.missions)]
    return Result(
        name,
        learner.summary,
        round(sum(each.steps for each in trained) / len(trained)),
        sum(each.process_s for each in trained) / len(trained),
        len(trained),
        scored(level, missions),
    )


def score_of(policy: Path, level: str, missions: int) -> list[MissionScore]:
    """The first test missions of a level; those that the folder holds are not flown again."""
    task = LEVELS[level]
    spec = spec_of(f"policy:{policy}", task)
    with opened(policy.parent / "flights", DESCRIPTION, Row) as store:
        kept, found = {row.key: row for row in store.rows()}, []
        for seed, scenario in task.scenarios("test", missions).items():
            entry = entry_of(spec, task, seed, scenario)
            row = kept.get(entry.key)
            if row is None:
                row = Row.of(entry, flown(entry), "")
                store.add(row)
            found.append(MissionScore.of(row))
    return found


def table(results: list[Result]) -> str:
    """A Markdown table; steps and processor time are those of one training."""
    lines = [HEAD, ("---", *["---:"] * (len(HEAD) - 1))]
    for one in results:
        found, flown = one.score.score, one.score
        value = "–" if found.value is None else f"{found.value:.2f}"
        if found.low is not None:
            value += f" [{found.low:.2f}, {found.high:.2f}]"
        n_uas = sum(mission.n_uas for mission in flown.missions)
        home = sum(mission.home for mission in flown.missions)
        lines.append(
            (
                f"`{one.name}`: {one.summary}",
                f"{one.steps:,}".replace(",", " "),
                f"{one.process_s:.0f}",
                str(one.trainings),
                value,
                f"{100.0 * flown.mean('coverage'):.1f}",
                f"{n_uas - home} of {n_uas}",
                f"{100.0 * flown.mean('energy_share'):.1f}",
                f"{flown.mean('episode_return'):.1f}",
                str(len(flown.missions)),
            )
        )
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


def command(given: argparse.Namespace, level: str) -> str:
    """The line that makes the table of a level again."""
    parts = ["python benchmarks/reference_learners.py"]
    asked = {**vars(given), "levels": level}
    usual = {
        "levels": "easy", "learners": ",".join(REFERENCE), "seeds": 1, "share": 1.0,
        "missions": 20,
    }  # fmt: skip
    parts += [f"--{name} {asked[name]}" for name in usual if asked[name] != usual[name]]
    return " ".join([*parts, "--out reference --publish"])


if __name__ == "__main__":
    sys.exit(main())
