"""Reference learners on the levels: trains and scores them, writes docs/level_scores.md.

    python benchmarks/reference_learners.py --out reference             # the budgets of their files
    python benchmarks/reference_learners.py --out reference --share 0.1 # a tenth of the steps
    python benchmarks/reference_learners.py --out reference --publish   # and the table

Learners are the files of `agents/uas_coverage_agents/reference/learners`, or a .toml of your own.
Whatever is finished is not repeated: a kill costs the round of a training that is under way, and
the mission that is flown. Needs the extra `learn`.
"""

from __future__ import annotations

import argparse
import sys
from dataclasses import dataclass
from pathlib import Path

from uas_coverage_agents.reference.policy import ReferencePolicy
from uas_coverage_agents.reference.settings import Reference, reference_named, reference_names

from uas_coverage_env.files.strict_toml import InputError
from uas_coverage_env.leaderboard import Row
from uas_coverage_env.leaderboard.flying import flown
from uas_coverage_env.runner.store import opened
from uas_coverage_env.tasks import LEVELS, Score
from uas_coverage_env.tasks.scoring import DESCRIPTION, MissionScore, entry_of, scored, spec_of

PAGE = Path(__file__).parents[1] / "docs" / "level_scores.md"
FIRST, LAST = "<!-- reference learners: {} -->\n", "<!-- end of reference learners: {} -->"
HEAD = (
    "learner", "steps", "processor time, s", "trainings", "score [95 %]", "covered, %",
    "lost or not home", "energy, %", "return", "missions",
)  # fmt: skip


@dataclass(frozen=True)
class Result:
    """A learner on a level: all of its trainings."""

    name: str
    reference: Reference
    steps: int
    process_s: float
    trainings: int
    score: Score


def main() -> int:
    """Train, score, publish; the exit code."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--levels", default="easy", help=f"of {', '.join(LEVELS)}")
    parser.add_argument("--learners", default=",".join(reference_names()))
    parser.add_argument("--seeds", type=int, default=1, help="trainings of each learner")
    parser.add_argument("--share", type=float, default=1.0, help="of the steps of their files")
    parser.add_argument("--missions", type=int, default=20, help="test missions of each training")
    parser.add_argument("--out", type=Path, default=Path("reference"))
    parser.add_argument("--publish", action="store_true", help="write docs/level_scores.md")
    given = parser.parse_args()
    if given.seeds < 1 or not 0.0 < given.share <= 100.0 or not 1 <= given.missions <= 50:
        parser.error("--seeds: 1 or more; --share: above 0, at most 100; --missions: 1 to 50")
    levels, parts = given.levels.split(","), {}
    try:
        learners = {Path(n).stem: reference_named(n) for n in given.learners.split(",")}
        for level in levels:
            if level not in LEVELS:
                raise InputError(f"--levels {level}: is none of {', '.join(LEVELS)}")
            results = [
                result_of(name, shortened(each, given.share), level, given)
                for name, each in learners.items()
            ]
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


def publish(level: str, text: str) -> None:
    """Write the table of a level into the page."""
    first, last = FIRST.format(level), LAST.format(level)
    before, there, rest = PAGE.read_text("utf-8").partition(first)
    _, end, after = rest.partition(last)
    if not there or not end:
        raise SystemExit(f"{PAGE}: has no {first.strip()} ... {last}")
    PAGE.write_text(before + first + text + last + after, encoding="utf-8")


def shortened(reference: Reference, share: float) -> Reference:
    """The same with a part of the budget."""
    steps = max(1, round(share * reference.steps))
    return reference.model_copy(update={"steps": steps})


def result_of(name: str, reference: Reference, level: str, given: argparse.Namespace) -> Result:
    """Train and score what was not before."""
    from uas_coverage_agents.reference.training import train_reference

    steps, process_s, missions = 0, 0.0, []
    for seed in range(given.seeds):
        directory = given.out / level / f"{name}-{seed}"

        def told(done: int, steps: int, seconds: float, at: Path = directory) -> None:
            sys.stderr.write(f"{at}: round {done}, {steps} steps, {seconds:.0f} s\n")

        trained = train_reference(reference, level, seed, directory, told)
        steps, process_s = steps + trained.steps, process_s + trained.process_s
        missions += score_of(trained.policy, level, given.missions, directory)
    mean_steps = round(steps / given.seeds)
    mean_s = process_s / given.seeds
    return Result(name, reference, mean_steps, mean_s, given.seeds, scored(level, missions))


def score_of(
    policy: ReferencePolicy, level: str, missions: int, directory: Path
) -> list[MissionScore]:
    """The first test missions of a level; those that the folder holds are not flown again."""
    task = LEVELS[level]
    spec = spec_of(policy, task)
    with opened(directory / "flights", DESCRIPTION, Row) as store:
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
                f"`{one.name}`: {one.reference.summary}",
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
        "levels": "easy", "learners": ",".join(reference_names()), "seeds": 1, "share": 1.0,
        "missions": 20,
    }  # fmt: skip
    parts += [f"--{name} {asked[name]}" for name in usual if asked[name] != usual[name]]
    return " ".join([*parts, "--out reference --publish"])


if __name__ == "__main__":
    sys.exit(main())
