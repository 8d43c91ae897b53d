"""What the shipped policy `learned-velocity` costs and how it flies: trains, scores, draws.

    python benchmarks/learners.py --seeds 3
    python benchmarks/learners.py --publish      # and ship the policy of seed 0

`uas-coverage train learned-velocity` with each seed (a finished training is not repeated, a killed
one goes on), then 100 unseen towns with and without the safety filter, beside nearest-waypoint on
the same towns; fills what stands between the marks of agents/README.md.
"""

from __future__ import annotations

import argparse
import os
import platform
import shutil
import subprocess
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from marks import ROOT, filled
from numpy.typing import NDArray
from uas_coverage_agents.policy import Policy, load_policy
from uas_coverage_agents.training import curve
from uas_coverage_agents.training.rounds import TrainingJob, policy_of, untrained
from uas_coverage_agents.training.scenarios import VALIDATION, town
from uas_coverage_agents.training.score import MEASURES, Validation, fly, interval
from uas_coverage_agents.training.settings import settings_of

from uas_coverage_env import Scenario
from uas_coverage_env.leaderboard import PlannerSpec
from uas_coverage_env.runner.workers import Workers

README = ROOT / "agents" / "README.md"
PICTURES = ROOT / "docs" / "pictures"
LEARNER, NAME = "learned-velocity", "route-velocity"
SHIPPED = ROOT / "agents" / "uas_coverage_agents" / "shipped" / LEARNER
COVERAGE, HOME, VIOLATIONS, ENERGY, STEPS, FILTERED, _ = range(len(MEASURES))
MEASURED = (
    "covered, %", "all home, %", "violations per mission", "filter changed, % of commands",
    "energy, Wh", "steps", "Δ energy, %", "Δ steps, %",
)  # fmt: skip


def main(argv: Sequence[str] | None = None) -> int:
    """Train, fly and publish; the exit code."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--seeds", type=int, default=3, help="how many; 3 are published")
    parser.add_argument("--missions", type=int, default=100, help="towns that are flown")
    parser.add_argument("--trainings", type=Path, default=Path("trainings"), help="where they lie")
    parser.add_argument("--publish", action="store_true", help="ship the policy of seed 0")
    arguments = parser.parse_args(argv)
    if arguments.seeds < 1 or not 1 <= arguments.missions <= 100:
        parser.error("--seeds: 1 or more; --missions: 1 to 100")
    towns = [town(VALIDATION, number) for number in range(arguments.missions)]
    directories = [trained(seed, arguments.trainings) for seed in range(arguments.seeds)]
    text = report(directories, towns, flown_by("nearest-waypoint", towns))
    sys.stdout.write(f"{text}\n")
    put(NAME, text)
    if arguments.publish:
        shutil.copytree(directories[0] / "policy", SHIPPED, dirs_exist_ok=True)
    return 0


def trained(seed: int, folder: Path) -> Path:
    """Train, or find what was trained before."""
    directory = folder / f"{LEARNER}-{seed}"
    if not (directory / "policy" / "policy.json").exists():
        script = "import sys; from uas_coverage_env.cli import main; sys.exit(main())"
        words = ["-c", script, "train", LEARNER, "--seed", str(seed), "--out", str(directory)]
        subprocess.run([sys.executable, *words], check=True)
    return directory


def untrained_policy() -> Policy:
    """What a training begins with; where it is trained does not matter."""
    job = TrainingJob(LEARNER, settings_of(LEARNER))
    return policy_of(job, untrained(job), 0.0, 0.0)


def flown_by(
    name: str, towns: Sequence[Scenario], options: Mapping[str, str] | None = None
) -> NDArray[np.float64]:
    """(missions, measures) of a planner, flown by as many processes as there are cores."""
    with Workers(None) as workers:
        return Validation(workers).fly(PlannerSpec.named(name, name, options), towns)


def report(
    directories: Sequence[Path], towns: Sequence[Scenario], reference: NDArray[np.float64]
) -> str:
    """The section of the page, and its picture."""
    policies = [load_policy(directory / "policy") for directory in directories]
    folder = Path(os.path.relpath(PICTURES, README.parent)).as_posix()
    lines = [
        f"`python benchmarks/learners.py --seeds {len(directories)} --missions {len(towns)}`; "
        f"{machine()}.",
        "",
        f"![Learning curves]({folder}/learning-{NAME}.png)",
        "",
        table_head(),
        table_row("`nearest-waypoint`", None, reference, None),
        table_row("before training", None, fly(untrained_policy(), towns), reference),
    ]
    for policy in policies:
        name = f"seed {policy.description.training.seed}"
        if policy is policies[0]:
            name += f" = `{LEARNER}`"
        lines.append(table_row(name, policy, fly(policy, towns), reference))
    for words, return_mode in (("filter off", True), ("filter and return mode off", False)):
        for policy in policies:
            name = f"seed {policy.description.training.seed}, {words}"
            bare = fly(policy, towns, safety_filter=False, return_mode=return_mode)
            lines.append(table_row(name, None, bare, None))
    runs = {f"seed {k}": curve.read(directory) for k, directory in enumerate(directories)}
    PICTURES.mkdir(parents=True, exist_ok=True)
    curve.draw(runs).savefig(PICTURES / f"learning-{NAME}.png", dpi=110)
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


def machine() -> str:
    """Where this was measured, in words."""
    return f"{platform.machine()} virtual machine with {os.cpu_count()} cores"


def put(name: str, text: str, page: Path | None = None) -> None:
    """Fill what stands between the marks of a study on a page, by default the README.

    Raises:
        ValueError: There are no such marks.
    """
    page = page or README
    page.write_text(filled(page.read_text("utf-8"), text, name), encoding="utf-8")


if __name__ == "__main__":
    sys.exit(main())
