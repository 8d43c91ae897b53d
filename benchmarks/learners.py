"""What the shipped policies cost and how they fly: trains, scores and draws what is published.

    python benchmarks/learners.py                # everything, an hour
    python benchmarks/learners.py ppo --seeds 3  # one learner
    python benchmarks/learners.py --publish      # and ship the policy of seed 0

Trains each learner with each seed (a finished training is not repeated, a killed one of
`uas-coverage train` goes on), flies 100 unseen towns with and without the safety filter, beside
nearest-waypoint on the same towns, and fills what stands between the marks: of agents/README.md for
the shipped policies, of docs/learners.md for the others.
"""

from __future__ import annotations

import argparse
import os
import platform
import shutil
import subprocess
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from uas_coverage_agents.policy import Policy, load_policy
from uas_coverage_agents.training import curve, velocity_learning
from uas_coverage_agents.training.checkpoint import CurvePoint
from uas_coverage_agents.training.config import load_config
from uas_coverage_agents.training.scenarios import VALIDATION, town
from uas_coverage_agents.training.score import MEASURES, Validation, fly, interval
from uas_coverage_agents.training.training_run import TrainingJob, TrainingRun

from uas_coverage_env import Scenario
from uas_coverage_env.leaderboard import PlannerSpec
from uas_coverage_env.runner.workers import Workers

ROOT = Path(__file__).parents[1]
README = ROOT / "agents" / "README.md"
LEARNERS = ROOT / "docs" / "learners.md"
PICTURES = ROOT / "docs" / "pictures"
SHIPPED = ROOT / "agents" / "uas_coverage_agents" / "shipped"
COVERAGE, HOME, VIOLATIONS, ENERGY, STEPS, FILTERED, _ = range(len(MEASURES))
MEASURED = (
    "covered, %", "all home, %", "violations per mission", "filter changed, % of commands",
    "energy, Wh", "steps", "Δ energy, %", "Δ steps, %",
)  # fmt: skip


@dataclass(frozen=True)
class Study:
    """What is trained and published.

    Attributes:
        config: Name of the configuration, and of its place on the page.
        shipped: Name of the planner that flies the policy of seed 0; empty: none.
        assisted: Whether filter and return mode fly along.
        module: That trains, where it is not `uas-coverage train`.
        alone: Whether it is also flown without filter and return mode.
    """

    config: str
    shipped: str = ""
    assisted: bool = True
    module: str = ""
    alone: bool = False

    @property
    def command(self) -> str:
        """What trains it, without the seed."""
        train = f"uas-coverage train {self.config}"
        return f"python -m {self.module} OUT" if self.module else train

    @property
    def page(self) -> Path:
        """Where it is published."""
        return README if self.shipped else LEARNERS


STUDIES = (
    Study("maskable-ppo", "learned-waypoint"),
    Study("route-velocity", "learned-velocity", module=velocity_learning.__name__, alone=True),
    Study("ppo"),
    Study("sac"),
    Study("ppo-end-to-end", assisted=False),
)


def main(argv: Sequence[str] | None = None) -> int:
    """Run the studies; the exit code."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    names = [study.config for study in STUDIES]
    parser.add_argument("studies", nargs="*", metavar="STUDY", help=f"of {', '.join(names)}")
    parser.add_argument("--seeds", type=int, default=3, help="how many; 3 are published")
    parser.add_argument("--missions", type=int, default=100, help="towns that are flown")
    parser.add_argument("--trainings", type=Path, default=Path("trainings"), help="where they lie")
    parser.add_argument("--publish", action="store_true", help="ship the policies of seed 0")
    arguments = parser.parse_args(argv)
    unknown = set(arguments.studies) - set(names)
    if unknown:
        parser.error(f"unknown study {min(unknown)}")
    if arguments.seeds < 1 or not 1 <= arguments.missions <= 100:
        parser.error("--seeds: 1 or more; --missions: 1 to 100")
    towns = [town(VALIDATION, number) for number in range(arguments.missions)]
    reference = nearest_waypoint(towns)
    for study in STUDIES:
        if arguments.studies and study.config not in arguments.studies:
            continue
        directories = [trained(study, seed, arguments.trainings) for seed in range(arguments.seeds)]
        text = report(study, directories, towns, reference)
        sys.stdout.write(f"{text}\n")
        put(study.config, text, study.page)
        if arguments.publish and study.shipped:
            shutil.copytree(directories[0] / "policy", SHIPPED / study.shipped, dirs_exist_ok=True)
    return 0


def trained(study: Study, seed: int, folder: Path) -> Path:
    """Train, or find what was trained before."""
    directory = folder / f"{study.config}-{seed}"
    if not (directory / "policy" / "policy.json").exists():
        script = "import sys; from uas_coverage_env.cli import main; sys.exit(main())"
        command = ["-c", script, "train", study.config, "--out", str(directory)]
        if study.module:
            command = ["-m", study.module, str(directory)]
        subprocess.run([sys.executable, *command, "--seed", str(seed)], check=True)
    return directory


def untrained(study: Study) -> Policy:
    """What a study begins with; where it is trained does not matter."""
    if study.module:
        return velocity_learning.VelocityTraining(seed=0).policy()
    config = load_config(study.config, changes=["scenarios.pool=1", "num_envs=1"])
    return TrainingRun.untrained(TrainingJob(study.config, config, seed=0)).policy()


def nearest_waypoint(towns: Sequence[Scenario]) -> NDArray[np.float64]:
    """(missions, measures) of the simplest planner."""
    return flown_by("nearest-waypoint", towns)


def flown_by(
    name: str, towns: Sequence[Scenario], options: Mapping[str, str] | None = None
) -> NDArray[np.float64]:
    """(missions, measures) of a planner, flown by as many processes as there are cores."""
    with Workers(None) as workers:
        return Validation(workers).fly(PlannerSpec.named(name, name, options), towns)


def report(
    study: Study,
    directories: Sequence[Path],
    towns: Sequence[Scenario],
    reference: NDArray[np.float64],
) -> str:
    """The section of a study, and its picture."""
    policies = [load_policy(directory / "policy") for directory in directories]
    start, *results = [
        fly(policy, towns, safety_filter=study.assisted, return_mode=study.assisted)
        for policy in (untrained(study), *policies)
    ]
    folder = Path(os.path.relpath(PICTURES, study.page.parent)).as_posix()
    lines = [
        f"`{study.command} --seed 0` and the other seeds, "
        f"scored by `python benchmarks/learners.py {study.config} "
        f"--seeds {len(directories)} --missions {len(towns)}`; {machine()}.",
        "",
        f"![Learning curves]({folder}/learning-{study.config}.png)",
        "",
        table_head(),
        table_row("`nearest-waypoint`", None, reference, None),
        table_row("before training", None, start, reference),
    ]
    for policy, result in zip(policies, results, strict=True):
        name = f"seed {policy.description.training.seed}"
        if study.shipped and policy is policies[0]:
            name += f" = `{study.shipped}`"
        lines.append(table_row(name, policy, result, reference))
    if study.assisted:
        for policy in policies:
            name = f"seed {policy.description.training.seed}, filter off"
            bare = fly(policy, towns, safety_filter=False, return_mode=True)
            lines.append(table_row(name, None, bare, None))
    if study.alone:
        for policy in policies:
            name = f"seed {policy.description.training.seed}, filter and return mode off"
            bare = fly(policy, towns, safety_filter=False, return_mode=False)
            lines.append(table_row(name, None, bare, None))
    runs = {f"seed {k}": curve_of(directory) for k, directory in enumerate(directories)}
    PICTURES.mkdir(parents=True, exist_ok=True)
    curve.draw(runs).savefig(PICTURES / f"learning-{study.config}.png", dpi=110)
    return "\n".join(lines)


def table_head() -> str:
    """The first two lines of a table."""
    names = ("policy", "training", *MEASURED)
    return f"| {' | '.join(names)} |\n|---|---|{'---:|' * (len(names) - 2)}"


def table_row(
    name: str,
    policy: Policy | None,
    result: NDArray[np.float64],
    reference: NDArray[np.float64] | None,
) -> str:
    """A policy with what its training took, or whatever else has flown."""
    training = "" if policy is None else training_of(policy)
    return f"| {' | '.join([name, training, *measured_cells(result, reference)])} |"


def measured_cells(result: NDArray[np.float64], reference: NDArray[np.float64] | None) -> list[str]:
    """Means with 95 % intervals, under `MEASURED`; differences are paired, town by town.

    A lost UAS saves energy: where there were violations, there is no difference.
    """
    cells = [
        shown(100 * result[:, COVERAGE], 2),
        shown(100 * result[:, HOME], 1),
        shown(result[:, VIOLATIONS], 2),
        shown(100 * result[:, FILTERED], 1),
        shown(result[:, ENERGY], 2),
        shown(result[:, STEPS], 1),
    ]
    for measure in (ENERGY, STEPS):
        if reference is None or result[:, VIOLATIONS].any():
            cells.append("")
        else:
            apart = (result - reference)[:, measure] / reference[:, measure].mean()
            cells.append(shown(100 * apart, 1))
    return cells


def shown(values: NDArray[np.float64], digits: int) -> str:
    """A mean and its interval, where there is one."""
    found = interval(values)
    if found.low == found.high:
        return f"{found.mean:.{digits}f}"
    return f"{found.mean:.{digits}f} [{found.low:.{digits}f}, {found.high:.{digits}f}]"


def training_of(policy: Policy) -> str:
    """What the training took."""
    training = policy.description.training
    return (
        f"{training.steps / 1e6:.2f} M steps, {training.process_s:.0f} s of one core "
        f"({training.wall_s:.0f} s)"
    )


def curve_of(directory: Path) -> list[CurvePoint]:
    """The learning curve of a training."""
    return curve.read(directory)


def machine() -> str:
    """Where this was measured, in words."""
    return f"{platform.machine()} virtual machine with {os.cpu_count()} cores"


def put(name: str, text: str, page: Path | None = None) -> None:
    """Fill what stands between the marks of a study on a page, by default the README.

    Raises:
        ValueError: There are no such marks.
    """
    page = page or README
    begin, end = f"<!-- {name} -->", f"<!-- end of {name} -->"
    before, found, rest = page.read_text(encoding="utf-8").partition(begin)
    _, ended, after = rest.partition(end)
    if not found or not ended:
        raise ValueError(f"{page} has no {begin} ... {end}")
    page.write_text(f"{before}{begin}\n\n{text}\n\n{end}{after}", encoding="utf-8")


if __name__ == "__main__":
    sys.exit(main())
