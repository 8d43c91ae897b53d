"""`uas-coverage train`: train a policy, or go on with its training."""

import math
import shutil
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.console import Console
from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn
from rich.table import Table

from uas_coverage_agents.training.published import published_names
from uas_coverage_env.cli.options import BackendOption, JobsOption
from uas_coverage_env.files.output_dir import prepare_folder
from uas_coverage_env.files.strict_toml import InputError
from uas_coverage_env.runner.store import STORE, opened
from uas_coverage_env.runner.workers import WorkerLostError, Workers

if TYPE_CHECKING:
    from uas_coverage_agents.policy import Policy
    from uas_coverage_agents.training.loop import TrainingJob, TrainingProgress

_LAST_SEED = 2**32 - 1  # of Stable-Baselines3
_SECONDS_BETWEEN_LINES = 10.0
_OURS = (
    *("checkpoints", "tensorboard", "learning_curve.csv", "learning_curve.png", "policy"),
    "baselines",
)


def train(
    algorithm: Annotated[
        str,
        typer.Argument(
            metavar="LEARNER",
            help=f"One of {', '.join(published_names())}, or a configuration of your own (.toml).",
        ),
    ],
    scenario: Annotated[
        str | None,
        typer.Option(help="`generated`, or a scenario; default: from the configuration."),
    ] = None,
    out: Annotated[
        Path | None, typer.Option(help="Directory; default: trainings/LEARNER-SEED.")
    ] = None,
    seed: Annotated[
        int, typer.Option(min=0, max=_LAST_SEED, help="Seed of network, sampling and scenarios.")
    ] = 0,
    steps: Annotated[
        int | None, typer.Option(min=1, help="Environment steps to train on; repeatable.")
    ] = None,
    minutes: Annotated[
        float | None, typer.Option(min=0.01, help="Train for this time instead of --steps.")
    ] = None,
    change: Annotated[
        list[str] | None,
        typer.Option("--set", metavar="KEY=VALUE", help="Change a setting; may be repeated."),
    ] = None,
    missions: Annotated[
        int, typer.Option(min=1, max=100, help="Unseen missions that score the policy.")
    ] = 100,
    checkpoint_s: Annotated[
        float, typer.Option(min=0.0, help="Seconds between two checkpoints.")
    ] = 60.0,
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
    zip_file: Annotated[
        Path | None,
        typer.Option("--from", help="Do not train: turn this Stable-Baselines3 zip into a policy."),
    ] = None,
    trust_pickle: Annotated[
        bool, typer.Option("--trust-pickle", help="For --from: you trust the author of the zip.")
    ] = False,
) -> None:
    """Train a policy; repeated after an interruption, the command resumes.

    Leaves checkpoints, tensorboard logs, a learning curve and, in the end, `policy/` in --out; fly
    it with `run SCENARIO --planner policy:OUT/policy`.
    """
    if steps is not None and minutes is not None:
        raise InputError("--steps and --minutes: give one of them")
    if minutes is not None and math.isinf(minutes):
        raise InputError("--minutes inf: would never end; give a number")
    changes = [*(change or ()), *([f"steps={steps}"] if steps is not None else ())]
    from uas_coverage_agents.training.config import load_config  # this module is loaded for a list

    config = load_config(algorithm, scenario=scenario, changes=changes)
    if zip_file is not None and not trust_pickle:
        raise InputError(
            f"{zip_file}: a Stable-Baselines3 zip holds pickles, which can execute anything; "
            f"add --trust-pickle if you trust its author"
        )
    loop = _learn_extra()
    from uas_coverage_agents.training.baselines import fly_baselines, planners_of
    from uas_coverage_agents.training.score import Validation
    from uas_coverage_env.leaderboard import Row

    beside = planners_of(baselines)
    name = Path(algorithm).stem
    job = loop.TrainingJob(name, config, seed, minutes, missions, checkpoint_s)
    directory = out or Path("trainings") / f"{name}-{seed}"
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
            opened(directory, _record(job), Row, overwrite=overwrite) as store,
            _shown(screen) as on_progress,
        ):
            if overwrite:
                _discard(directory)
            elif names:
                screen.print(f"{directory}: going on with the training there", markup=False)
            validation = Validation(workers, store)
            if zip_file is not None:
                policy = loop.import_zip(job, zip_file, directory, validation)
            else:
                missions_flown = loop.curve_scenarios(job)
                fly_baselines(beside, missions_flown, directory, screen.print, validation)
                policy = loop.train(job, directory, on_progress, validation)
    except KeyboardInterrupt:
        screen.print("the same command goes on from the last checkpoint")
        raise
    except WorkerLostError as error:
        sys.stderr.write(f"error: {error}; the same command goes on\n")
        raise typer.Exit(1) from None
    _report(screen, policy, directory)


def _learn_extra() -> Any:
    """The module that needs the extra `learn`."""
    try:
        from uas_coverage_agents.training import loop
    except ModuleNotFoundError as error:
        if (error.name or "").startswith("uas_coverage"):
            raise  # ours is always there
        raise InputError(
            f"training needs the package {error.name}, which is not installed: "
            f"python -m pip install 'uas-coverage-env[learn]'"
        ) from error
    return loop


def _record(job: "TrainingJob") -> dict[str, Any]:
    """What has to be the same for a training to go on."""
    return {
        "command": "train",
        "name": job.name,
        "seed": job.seed,
        "minutes": job.minutes,
        "missions": job.missions,
        "config": job.config.model_dump(mode="json"),
    }


def _discard(directory: Path) -> None:
    """Remove what a training has left, and nothing else."""
    for name in _OURS:
        path = directory / name
        if path.is_dir() and not path.is_symlink():
            shutil.rmtree(path)
        else:
            path.unlink(missing_ok=True)


@contextmanager
def _shown(screen: Console) -> Iterator[Callable[["TrainingProgress"], object]]:
    """Show how it goes: a bar that moves on a terminal, a line now and then elsewhere."""
    screen.print("preparing scenarios")
    started: list[tuple[float, float]] = []
    said = [-_SECONDS_BETWEEN_LINES]

    def line(progress: "TrainingProgress") -> str:
        now = time.monotonic()
        if not started:
            started.append((now, progress.share))
        since, share = started[0]
        parts = [f"{progress.steps:,} steps"]
        if (point := progress.point) is not None:
            parts.append(
                f"covers {point.coverage:.1%}, all home {point.all_home:.0%}, "
                f"{point.energy_Wh:.1f} Wh in {point.flight_steps:.0f} steps"
            )
        if progress.share > share:
            left_s = (now - since) * (1.0 - progress.share) / (progress.share - share)
            parts.append(f"{left_s / 60:.1f} min left")
        return "; ".join(parts)

    if not screen.is_terminal:

        def say(progress: "TrainingProgress") -> None:
            text, now = line(progress), time.monotonic()
            if now - said[0] >= _SECONDS_BETWEEN_LINES or progress.share == 1.0:
                screen.print(f"{progress.share:.0%}  {text}", markup=False)
                said[0] = now

        yield say
        return
    from uas_coverage_env.cli.compilation import compilation_shown

    columns = (BarColumn(), TaskProgressColumn(), TextColumn("{task.description}"))
    bar = Progress(*columns, console=screen)
    task = bar.add_task("", total=1.0)
    with ExitStack() as ending:
        compiling = ending.enter_context(ExitStack())
        compiling.enter_context(compilation_shown())
        ending.callback(bar.stop)

        def move(progress: "TrainingProgress") -> None:
            if not bar.live.is_started:
                compiling.close()
                bar.start()
            bar.update(task, completed=progress.share, description=line(progress))

        yield move


def _report(screen: Console, policy: "Policy", directory: Path) -> None:
    score, training = policy.description.score, policy.description.training
    if score is not None:
        table = Table("unseen missions", "mean", "95 % interval", box=None)
        for name, measure in score.measures.items():
            table.add_row(name, f"{measure.mean:.3f}", f"{measure.low:.3f} .. {measure.high:.3f}")
        screen.print(table)
    screen.print(
        f"{training.steps} steps, {training.process_s:.0f} s of processor time, "
        f"{training.wall_s:.0f} s; fly it with --planner policy:{directory / 'policy'}",
        markup=False,
    )
