"""The training loop: rounds of learning, each tried on unseen missions; the same for all learners.

A round is a job: a function of the settings, a seed and what was learned before. It begins with a
fresh learner, new missions and random numbers of its own, so that one that was killed is done again
to the same weights, here or on another machine.
"""

import platform
import time
from collections import deque
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray

from uas_coverage_agents.policy import Policy, load_policy, save_policy
from uas_coverage_agents.policy.description import Training
from uas_coverage_agents.training import curve
from uas_coverage_agents.training.checkpoint import Checkpoint, TrainingState, checkpoint_in
from uas_coverage_agents.training.curve import CurvePoint
from uas_coverage_agents.training.learner import (
    SEEDS_APART,
    Arrays,
    Learner,
    Told,
)
from uas_coverage_agents.training.missions import Missions
from uas_coverage_agents.training.score import (
    PolicySpec,
    Validation,
    measured,
    point_of,
    score_of,
)
from uas_coverage_agents.training.settings import LearnerSettings, class_named, hashes_of_own
from uas_coverage_env.leaderboard import Row
from uas_coverage_env.leaderboard.flying import fly
from uas_coverage_env.leaderboard.sweep import source_of
from uas_coverage_env.runner.jobs import Job

POLICY, TENSORBOARD = "policy", "tensorboard"

CURVE_MISSIONS = 12
"""Missions of the learning curve, or fewer."""


@dataclass(frozen=True)
class TrainingJob:
    """One training that is asked for.

    Attributes:
        name: Of the learner.
        settings: The learner.
        seed: Of network, sampling and missions.
        missions: On which the finished policy is scored; the curve is flown on some of them.
        where: Level, family or scenario; that of the settings.
        modules: Hashes of one's own code, as it is when the job is made.
    """

    name: str
    settings: LearnerSettings
    seed: int = 0
    missions: int = 20
    where: Missions = field(init=False, compare=False)
    modules: dict[str, str] = field(init=False, compare=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "where", Missions.of(self.settings))
        object.__setattr__(self, "modules", hashes_of_own(self.settings))

    def plain(self) -> dict[str, Any]:
        """What has to be the same for a training to go on: the code of one's own modules, too."""
        settings = self.settings.model_dump(mode="json")
        plain = {"settings": settings, "seed": self.seed, "missions": self.missions}
        return {**plain, "modules": self.modules} if self.modules else plain


@dataclass(frozen=True, eq=False)
class Round:
    """What a round comes to.

    Attributes:
        arrays: What was learned so far.
        points: Of the learning curve; before the first round, too. Times are those of the round.
        rows: The flights of these.
        told: What the learner tells of itself: steps, and numbers by name.
        process_s: Processor time of learning [s].
        wall_s: [s].
    """

    arrays: Arrays
    points: tuple[CurvePoint, ...]
    rows: tuple[Row, ...]
    told: tuple[tuple[int, dict[str, float]], ...]
    process_s: float
    wall_s: float


@dataclass(frozen=True)
class TrainingProgress:
    """Where a training stands.

    Attributes:
        job: Which.
        rounds: Done.
        steps: Flown steps learned from.
        point: The latest of the learning curve.
    """

    job: TrainingJob
    rounds: int
    steps: int
    point: CurvePoint


def untrained(job: TrainingJob) -> Learner:
    """The learner that a training begins with.

    Raises:
        InputError: It cannot be made with its settings.
    """
    return _learner(job, 0, None)


def one_round(job: TrainingJob, number: int, arrays: Mapping[str, NDArray[Any]] | None) -> Round:
    """Learn for a round and try what was learned.

    One thread, so that a seed gives the same weights again on the same machine.

    Raises:
        InputError: The settings do not fit the learner, or the arrays are another one's.
        PlannerError: The policy cannot fly a mission.
    """
    torch.set_num_threads(1)
    points, rows, told = [], [], Told()
    learner = _learner(job, number, arrays)
    if number == 0:
        _try(job, learner, (0.0, 0.0), points, rows)
        learner = _learner(job, number, arrays)  # what flies draws random numbers, too
    began = time.process_time(), time.monotonic()
    learner.learn(number, told)
    took = time.process_time() - began[0], time.monotonic() - began[1]
    _try(job, learner, took, points, rows)
    state = learner.state_dict()
    return Round(state, tuple(points), tuple(rows), tuple(told.rows), *took)


def train(
    jobs: Mapping[Path, TrainingJob],
    validation: Validation | None = None,
    on_progress: Callable[[TrainingProgress], object] = lambda _: None,
) -> dict[Path, Policy]:
    """Train, or go on with what the directories hold; rounds of several trainings side by side.

    Leaves in each directory `checkpoint.safetensors`, `tensorboard/`, `learning_curve.csv` and
    `.png`, and in the end `policy/`.

    Args:
        jobs: Directory -> training.
        validation: Who works, and who keeps the flights; None: this process, and they are not kept.
        on_progress: Told after each round.

    Returns:
        Directory -> the policy there.

    Raises:
        InputError: A directory holds another training, or the settings do not fit the learner.
        PlannerError: A policy cannot fly a mission.
    """
    validation = validation or Validation()
    done = {place: checkpoint_in(place, job.plain()) for place, job in jobs.items()}
    queue = _Queue(jobs, done)
    for one, result in validation.workers.run(queue):
        place = Path(one.key)
        job = jobs[place]
        before = done[place]
        checkpoint = _after(job, before, result)
        validation.keep(result.rows)
        checkpoint.write(place)
        _log(place / TENSORBOARD, result.told)
        curve.write(checkpoint.state.curve, place)
        done[place] = checkpoint
        queue.add(place, checkpoint)
        last = checkpoint.state.curve[-1]
        on_progress(TrainingProgress(job, checkpoint.state.rounds, last.steps, last))
    return {place: _published(place, jobs[place], done[place], validation) for place in jobs}


class _Queue(Iterator[Job | None]):
    """The next round of each training, as soon as the one before is done."""

    def __init__(
        self, jobs: Mapping[Path, TrainingJob], done: Mapping[Path, Checkpoint | None]
    ) -> None:
        self._jobs, self._under_way = jobs, 0
        self._waiting: deque[Job] = deque()
        for place, checkpoint in done.items():
            self._put(place, checkpoint)

    def add(self, place: Path, checkpoint: Checkpoint) -> None:
        """A round is done."""
        self._under_way -= 1
        self._put(place, checkpoint)

    def __next__(self) -> Job | None:
        if not self._waiting:
            if self._under_way:
                return None
            raise StopIteration
        self._under_way += 1
        return self._waiting.popleft()

    def _put(self, place: Path, checkpoint: Checkpoint | None) -> None:
        job, rounds = self._jobs[place], checkpoint.state.rounds if checkpoint else 0
        if rounds < job.settings.rounds:
            arrays = dict(checkpoint.arrays) if checkpoint else None
            self._waiting.append(Job(str(place), one_round, (job, rounds, arrays)))


def learner_of(settings: LearnerSettings, missions: Missions, seed: int) -> Learner:
    """A learner that has learned nothing.

    Raises:
        InputError: The class cannot be loaded or made; one line.
    """
    found = class_named(settings.algorithm)
    if hasattr(found, "learned"):
        return found(settings, missions, seed)
    from uas_coverage_agents.training.library import LibraryLearner

    return LibraryLearner(settings, missions, seed, found)


def policy_of(job: TrainingJob, learner: Learner, process_s: float, wall_s: float) -> Policy:
    """What a learner would fly like now."""
    training = Training(
        algorithm=job.name,
        settings=job.settings.model_dump(mode="json"),
        seed=job.seed,
        steps=learner.steps,
        process_s=round(process_s, 1),
        wall_s=round(wall_s, 1),
        machine=f"{platform.machine()}, {platform.system()}",
    )
    return learner.learned().policy(job.where.family, training)


def _learner(job: TrainingJob, number: int, arrays: Mapping[str, NDArray[Any]] | None) -> Learner:
    learner = learner_of(job.settings, job.where, SEEDS_APART * job.seed + number)
    if arrays is not None:
        learner.load_state_dict(dict(arrays))
    return learner


def _try(
    job: TrainingJob,
    learner: Learner,
    took: tuple[float, float],
    points: list[CurvePoint],
    rows: list[Row],
) -> None:
    """Fly validation missions with what is known."""
    spec = PolicySpec.of(policy_of(job, learner, *took), job.seed)
    entries = job.where.entries(spec, min(job.missions, CURVE_MISSIONS))
    source = source_of(entries)
    flown = [fly(entry, source).row for entry in entries]
    results = np.array([measured(row) for row in flown], float)
    points.append(point_of(results, learner.steps, *took))
    rows += flown


def _after(job: TrainingJob, before: Checkpoint | None, result: Round) -> Checkpoint:
    """The checkpoint after a round; times of all rounds are summed up."""
    process_s = before.state.process_s if before else 0.0
    wall_s = before.state.wall_s if before else 0.0
    points = [
        point.model_copy(
            update={"process_s": process_s + point.process_s, "wall_s": wall_s + point.wall_s}
        )
        for point in result.points
    ]
    state = TrainingState(
        order=job.plain(),
        rounds=before.state.rounds + 1 if before else 1,
        process_s=process_s + result.process_s,
        wall_s=wall_s + result.wall_s,
        curve=(*(before.state.curve if before else ()), *points),
    )
    return Checkpoint(state, result.arrays)


def _log(directory: Path, told: tuple[tuple[int, dict[str, float]], ...]) -> None:
    """Write what a learner tells, where TensorBoard is installed."""
    try:
        from torch.utils.tensorboard import SummaryWriter
    except ImportError:
        return
    with SummaryWriter(str(directory)) as writer:
        for steps, numbers in told:
            for name, number in numbers.items():
                writer.add_scalar(name, number, steps)


def _published(
    place: Path, job: TrainingJob, checkpoint: Checkpoint | None, validation: Validation
) -> Policy:
    """Score a policy on unseen missions and write it; gives what was written."""
    assert checkpoint is not None
    state = checkpoint.state
    learner = _learner(job, state.rounds, checkpoint.arrays)
    policy = policy_of(job, learner, state.process_s, state.wall_s)
    entries = job.where.entries(PolicySpec.of(policy, job.seed), job.missions)
    scored = score_of(validation.flown(entries), f"{job.where.name}, validation")
    described = policy.description.model_copy(update={"score": scored})
    save_policy(place / POLICY, described, policy.tensors)
    return load_policy(place / POLICY)
