"""The training loop: learn, fly for the curve, checkpoint, go on; the same for all learners."""

import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.logger import configure

from uas_coverage_agents.policy import Policy
from uas_coverage_agents.training import curve
from uas_coverage_agents.training.checkpoint import (
    Checkpoint,
    CurvePoint,
    TrainingState,
    newest_checkpoint,
    write_checkpoint,
)
from uas_coverage_agents.training.model_arrays import from_arrays, to_arrays
from uas_coverage_agents.training.scenarios import validation_scenarios
from uas_coverage_agents.training.score import MEASURES, Validation
from uas_coverage_agents.training.training_run import TrainingJob, TrainingRun
from uas_coverage_env.scenario import Scenario

CHECKPOINTS = "checkpoints"
POLICY = "policy"

_CURVE_POINTS = 10
_CURVE_MISSIONS = 12
_NO_END = 2**62


@dataclass(frozen=True)
class TrainingProgress:
    """Where a training stands.

    Attributes:
        share: Of the whole, 0 to 1.
        steps: Steps learned from.
        point: The latest point of the learning curve.
    """

    share: float
    steps: int
    point: CurvePoint | None


def train(
    job: TrainingJob,
    directory: Path,
    on_progress: Callable[[TrainingProgress], object] = lambda _: None,
    validation: Validation | None = None,
) -> Policy:
    """Train a policy, or go on with its training; leaves everything in the directory.

    `checkpoints/`, `tensorboard/`, `learning_curve.csv` and `.png`, and in the end `policy/`.

    Args:
        job: What to train.
        directory: Where; a checkpoint in it is gone on from.
        on_progress: Told now and then.
        validation: Flies its missions; None: one after the other, and keeps none of them.

    Raises:
        InputError: The checkpoints there cannot be read or are those of another network.
    """
    training_run = TrainingRun.untrained(job, validation)
    before = newest_checkpoint(directory / CHECKPOINTS)
    if before is not None:
        from_arrays(before.tensors, training_run.model, training_run.lanes)
    watch = _TrainingCallback(
        training_run, directory, before.state if before else None, on_progress
    )
    if before is None or not before.state.done:
        model = training_run.model
        model.lr_schedule = watch.learning_rate
        model.set_logger(configure(str(directory / "tensorboard"), ["tensorboard"]))
        end = job.config.steps if job.minutes is None else _NO_END
        model.learn(end - model.num_timesteps, callback=watch, reset_num_timesteps=False)
        watch.finish()
    training_run.lanes.close()
    return training_run.publish(directory / POLICY)


def import_zip(
    job: TrainingJob, zip_file: Path, directory: Path, validation: Validation | None = None
) -> Policy:
    """Turn a model that Stable-Baselines3 has saved into a policy, scored like a trained one.

    Raises:
        InputError: The file is no such zip, or holds another network.
    """
    training_run = TrainingRun.untrained(job, validation)
    training_run.read_zip(zip_file)
    return training_run.publish(directory / POLICY)


def curve_scenarios(job: TrainingJob) -> list[Scenario]:
    """The missions of the learning curve."""
    return validation_scenarios(job.config.scenarios.family, min(job.missions, _CURVE_MISSIONS))


class _TrainingCallback(BaseCallback):
    """Acts between two updates, the only moments at which a training can be checkpointed."""

    def __init__(
        self,
        training_run: TrainingRun,
        directory: Path,
        state: TrainingState | None,
        on_progress: Callable[[TrainingProgress], object],
    ) -> None:
        super().__init__()
        self._training_run, self._directory, self._on_progress = (
            training_run,
            directory,
            on_progress,
        )
        job = training_run.job
        self._points = list(state.curve) if state else []
        self._start_the_clock(state.process_s if state else 0.0, state.wall_s if state else 0.0)
        self._saved_at_s = time.monotonic()
        self._scenarios = curve_scenarios(job)
        self._share = 0.0
        self._look_at_the_clock()

    def learning_rate(self, _: float) -> float:
        """Falls linearly with what is done of the training."""
        learning = self._training_run.job.config.learning
        left = learning.final_share + (1.0 - learning.final_share) * (1.0 - self._share)
        return learning.learning_rate * left

    def finish(self) -> None:
        """The training is complete."""
        self._look_at_the_clock()
        self._share = 1.0
        self._fly()
        self._save(done=True)
        self._tell()

    def _on_rollout_start(self) -> None:
        if not self._points:  # compiling and flights of what has learned nothing are no training
            self._fly()
            self._start_the_clock(0.0, 0.0)
        self._look_at_the_clock()
        job = self._training_run.job
        if job.minutes is None:
            self._share = min(1.0, self.model.num_timesteps / job.config.steps)
        else:
            self._share = min(1.0, self._training_run.wall_s / (60.0 * job.minutes))
        if self._share * _CURVE_POINTS >= len(self._points):
            self._fly()
        if time.monotonic() - self._saved_at_s >= job.checkpoint_s:
            self._save(done=False)
        self._tell()

    def _on_step(self) -> bool:
        # the clock is looked at before a rollout, so that none is thrown away
        return self._training_run.job.minutes is None or self._share < 1.0

    def _start_the_clock(self, process_s: float, wall_s: float) -> None:
        self._process_before_s = process_s - time.process_time()
        self._wall_before_s = wall_s - time.monotonic()

    def _look_at_the_clock(self) -> None:
        self._training_run.process_s = self._process_before_s + time.process_time()
        self._training_run.wall_s = self._wall_before_s + time.monotonic()

    def _tell(self) -> None:
        point = self._points[-1] if self._points else None
        self._on_progress(TrainingProgress(self._share, self.model.num_timesteps, point))

    def _save(self, *, done: bool) -> None:
        """Write a checkpoint."""
        state = TrainingState(
            steps=self.model.num_timesteps,
            updates=self.model._n_updates,
            process_s=self._training_run.process_s,
            wall_s=self._training_run.wall_s,
            done=done,
            curve=tuple(self._points),
        )
        checkpoint = Checkpoint(state, to_arrays(self.model, self._training_run.lanes))
        write_checkpoint(self._directory / CHECKPOINTS, checkpoint)
        self._saved_at_s = time.monotonic()

    def _fly(self) -> None:
        """Fly validation missions for the learning curve; the training's generator is not used."""
        results = self._training_run.flights(self._scenarios)
        means = dict(zip(MEASURES, results.mean(axis=0).tolist(), strict=True))
        self._points.append(
            CurvePoint(
                steps=self.model.num_timesteps,
                process_s=self._training_run.process_s,
                wall_s=self._training_run.wall_s,
                **{name: mean for name, mean in means.items() if name in CurvePoint.model_fields},
            )
        )
        for name, mean in means.items():
            self.logger.record(f"validation/{name}", mean)
        curve.write(self._points, self._directory)
