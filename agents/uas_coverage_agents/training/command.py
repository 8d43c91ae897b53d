"""`uas-coverage train`: train a policy, or go on with its training."""

import math
import re
import shutil
import sys
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.console import Console
from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeRemainingColumn
from rich.table import Table

from uas_coverage_agents.training.settings import LearnerSettings, learner_names, settings_of
from uas_coverage_env.cli.options import BackendOption, JobsOption
from uas_coverage_env.files.errors import PlannerError
from uas_coverage_env.files.output_dir import prepare_folder
from uas_coverage_env.files.strict_toml import InputError
from uas_coverage_env.leaderboard import PlannerSpec, Row
from uas_coverage_env.replay.figures.training import BASELINES
from uas_coverage_env.runner.store import STORE, opened
from uas_coverage_env.runner.workers import WorkerLostError, Workers

if TYPE_CHECKING:
    from uas_coverage_agents.policy import Policy
    from uas_coverage_agents.training.rounds import TrainingJob, TrainingProgress
    from uas_coverage_agents.training.score import Validation

NO_PLANNER = "none"

_LAST_SEED = 4_000_000  # times a thousand, it is one of Stable-Baselines3
_OURS = (
    *("checkpoint.safetensors", "tensorboard", "learning_curve.csv", "learning_curve.png"),
    *("policy", BASELINES),
)


def train(
    learner: Annotated[
        str,
        typer.Argument(
            metavar="LEARNER",
            help=f"One of {', '.join(learner_names())}; settings of your own (.toml); or "
            "MODULE:CLASS.",
        ),
    ],
    scenario: Annotated[
        str | None,
        typer.Option(help="A level, a family or a scenario; default: that of the settings."),
    ] = None,
    out: Annotated[
        Path | None, typer.Option(help="Directory; default: trainings/LEARNER-SEED.")
    ] = None,
    seed: Annotated[
        str,
        typer.Option(
            metavar="N|FIRST:END", help="Of the training; or of several, each in its own folder."
        ),
    ] = "0",
    steps: Annotated[
        int | None, typer.Option(min=1, help="Flown steps to learn from: total_timesteps.")
    ] = None,
    device: Annotated[
        str | None,
        typer.Option(metavar="cpu|cuda", help="Where environments, policy and learning lie."),
    ] = None,
    change: Annotated[
        list[str] | None,
        typer.Option("--set", metavar="KEY=VALUE", help="Change a setting; may be repeated."),
    ] = None,
    missions: Annotated[
        int, typer.Option(min=1, max=1000, help="Unseen missions that score the policy.")
    ] = 20,
    baselines: Annotated[
        str,
        typer.Option(
            metavar="NAME,...",
            help="Planners whose flights stand beside the learning curve; `none` for none.",
        ),
    ] = "nearest-waypoint,trajectory",
    backend: BackendOption = "process",
    jobs: JobsOption = None,
    overwrite: Annotated[
        bool, typer.Option("--overwrite", help="Delete the training in --out and restart.")
    ] = False,
) -> None:
    """Train a policy; repeated after an interruption, the command resumes.

    Leaves a checkpoint, tensorboard logs, a learning curve and, in the end, `policy/` in --out; fly
    it with `run SCENARIO --planner policy:OUT/policy`.
    """
    given = {"total_timesteps": steps, "device": device}
    changes = [*(change or ()), *(f"{k}={each}" for k, each in given.items() if each is not None)]
    settings = settings_of(learner, scenario=scenario, changes=changes)
    seeds, beside = _seeds(seed), _planners(baselines)
    _learn_extra()
    from uas_coverage_agents.training.rounds import TrainingJob, train, untrained
    from uas_coverage_agents.training.score import Validation

    name = re.sub(r"[^\w.-]", "-", Path(learner).name.removesuffix(".toml"))
    directory = out or Path("trainings") / f"{name}-{seed.replace(':', '-')}"
    every = {
        directory / f"seed-{each}" if len(seeds) > 1 else directory: TrainingJob(
            name, settings, each, missions
        )
        for each in seeds
    }
    first = next(iter(every.values()))
    untrained(first)  # refuses before anything is written
    screen = Console(highlight=False, soft_wrap=True)
    names = prepare_folder(directory) - {".lock"}
    if names and STORE not in names:
        raise InputError(
            f"{directory}: is not empty and holds no training that this version goes on with; "
            "give another --out"
        )
    try:
        with (
            Workers(jobs, backend) as workers,
            opened(
                directory, _record(name, settings, seed, missions), Row, overwrite=overwrite
            ) as store,
        ):
            if overwrite:
                _discard([directory, *every])
            elif names:
                screen.print(f"{directory}: going on with the training there", markup=False)
            validation = Validation(workers, store)
            _fly_baselines(beside, first, directory, screen, validation)
            with _shown(screen, sum(job.settings.rounds for job in every.values())) as told:
                policies = train(every, validation, told)
    except KeyboardInterrupt:
        screen.print("the same command goes on from the last checkpoint")
        raise
    except (WorkerLostError, PlannerError) as error:
        sys.stderr.write(f"error: {error}; the same command goes on\n")
        raise typer.Exit(1) from None
    _report(screen, policies)


def _learn_extra() -> None:
    """Refuse in a line where the extra `learn` is not installed."""
    try:
        from uas_coverage_agents.training import rounds  # noqa: F401
    except ModuleNotFoundError as error:
        if (error.name or "").startswith("uas_coverage"):
            raise  # ours is always there
        raise InputError(
            f"training needs the package {error.name}, which is not installed: "
            f"python -m pip install 'uas-coverage-env[learn]'"
        ) from error


def _record(name: str, settings: LearnerSettings, seed: str, missions: int) -> dict[str, Any]:
    """What has to be the same for a training to go on."""
    plain = settings.model_dump(mode="json")
    return {"command": "train", "name": name, "seed": seed, "missions": missions} | plain


def _seeds(text: str) -> list[int]:
    first, colon, end = text.partition(":")
    if first.isdecimal() and (end.isdecimal() or not colon):
        seeds = list(range(int(first), int(end))) if colon else [int(first)]
        if seeds and seeds[-1] <= _LAST_SEED:
            return seeds
    raise InputError(
        f"--seed {text[:40]!r}: give a whole number from 0 to {_LAST_SEED}, or several as FIRST:END"
    )


def _planners(names: str) -> dict[str, PlannerSpec]:
    """The planners of `--baselines`."""
    if names == NO_PLANNER:
        return {}
    planners = [name.strip() for name in names.split(",")]
    return {name: PlannerSpec.named(name, name) for name in planners}


def _fly_baselines(
    planners: Mapping[str, PlannerSpec],
    job: "TrainingJob",
    directory: Path,
    screen: Console,
    validation: "Validation",
) -> None:
    """Fly what was not flown before: each leaves a learning curve of one row."""
    from uas_coverage_agents.training import curve
    from uas_coverage_agents.training.rounds import CURVE_MISSIONS
    from uas_coverage_agents.training.score import point_of

    for name, spec in planners.items():
        folder = directory / BASELINES / re.sub(r"[/:\\]", "-", name)
        if (folder / curve.TABLE).exists():
            continue
        entries = job.where.entries(spec, min(job.missions, CURVE_MISSIONS))
        screen.print(f"flying the {len(entries)} missions of the learning curve with {name}")
        try:
            flown = validation.flown(entries)
        except (InputError, PlannerError) as error:
            screen.print(f"no baseline {name}: {error}", markup=False)
            continue
        folder.mkdir(parents=True, exist_ok=True)
        curve.write_table([point_of(flown, 0, 0.0, 0.0)], folder)


def _discard(directories: Sequence[Path]) -> None:
    """Remove what a training has left, and nothing else."""
    for path in (directory / name for directory in directories for name in _OURS):
        if path.is_dir() and not path.is_symlink():
            shutil.rmtree(path)
        else:
            path.unlink(missing_ok=True)


@contextmanager
def _shown(screen: Console, rounds: int) -> Iterator[Callable[["TrainingProgress"], object]]:
    """Show how it goes: a bar that moves on a terminal, a line for each round elsewhere."""
    began = time.monotonic()
    done: dict[int, int] = {}

    def line(progress: "TrainingProgress") -> str:
        point, job = progress.point, progress.job
        which = f"seed {job.seed}, " if len(done) > 1 else ""
        return (
            f"{which}round {progress.rounds} of {job.settings.rounds}: "
            f"{progress.steps:,} flown steps; covers {point.coverage:.1%}, "
            f"all home {point.all_home:.0%}, "
            f"{point.energy_Wh:.1f} Wh in {point.flight_steps:.0f} steps"
        )

    if not screen.is_terminal:

        def say(progress: "TrainingProgress") -> None:
            done[progress.job.seed] = progress.rounds
            now = sum(done.values())
            minutes = math.ceil((time.monotonic() - began) / 60.0)
            screen.print(f"{line(progress)}; {now}/{rounds}, {minutes} min", markup=False)

        yield say
        return
    columns = (
        *(BarColumn(), TaskProgressColumn(), TimeRemainingColumn()),
        TextColumn("{task.description}"),
    )
    with Progress(*columns, console=screen) as bar:
        task = bar.add_task("learning", total=rounds)

        def move(progress: "TrainingProgress") -> None:
            done[progress.job.seed] = progress.rounds
            bar.update(task, completed=sum(done.values()), description=line(progress))

        yield move


def _report(screen: Console, policies: Mapping[Path, "Policy"]) -> None:
    for place, policy in policies.items():
        score, training = policy.description.score, policy.description.training
        if score is not None:
            table = Table("unseen missions", "mean", "95 % interval", box=None)
            for name, measure in score.measures.items():
                interval = f"{measure.low:.3f} .. {measure.high:.3f}"
                table.add_row(name, f"{measure.mean:.3f}", interval)
            screen.print(table)
        screen.print(
            f"{training.steps} flown steps, {training.process_s:.0f} s of processor time, "
            f"{training.wall_s:.0f} s by the clock; "
            f"fly it with --planner policy:{place / 'policy'}",
            markup=False,
        )
