"""A model in training, and the policy that it is at the moment."""

import io
import pickle
import platform
import warnings
import zipfile
from dataclasses import dataclass, field
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

import numpy as np
import torch
from numpy.typing import NDArray
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.vec_env import VecEnv

from uas_coverage_agents.policy import Policy, PolicyDescription, load_policy, save_policy
from uas_coverage_agents.policy.description import Training
from uas_coverage_agents.training.config import TrainingConfig
from uas_coverage_agents.training.learner import Learner
from uas_coverage_agents.training.learners import learner_of
from uas_coverage_agents.training.scenarios import validation_scenarios
from uas_coverage_agents.training.score import Validation, fly, score_of
from uas_coverage_env.files.strict_toml import InputError
from uas_coverage_env.scenario import Scenario

_PACKAGES = ("uas-coverage-env", "numpy", "torch", "stable-baselines3", "sb3-contrib")
_ZIPPED = "policy.pth"
_LARGEST_ZIPPED = 2**26


@dataclass(frozen=True)
class TrainingJob:
    """One training that was asked for.

    Attributes:
        name: Of the configuration.
        config: The configuration.
        seed: Of network, random numbers and scenarios.
        minutes: Ends after so many instead of after `config.steps`; None: after the steps.
        missions: On which the finished policy is scored.
        checkpoint_s: Seconds between two checkpoints.
    """

    name: str
    config: TrainingConfig
    seed: int
    minutes: float | None = None
    missions: int = 100
    checkpoint_s: float = 60.0


@dataclass
class TrainingRun:
    """Everything that a training works on.

    Attributes:
        job: What was asked for.
        learner: How policies of this interface are trained.
        lanes: Where it learns.
        model: What it has learned.
        validation: Flies its missions.
        process_s: Processor time so far, in all sessions [s].
        wall_s: Time so far, in all sessions [s].
    """

    job: TrainingJob
    learner: Learner
    lanes: VecEnv
    model: BaseAlgorithm
    validation: Validation = field(default_factory=Validation)
    process_s: float = 0.0
    wall_s: float = 0.0

    @classmethod
    def untrained(cls, job: TrainingJob, validation: Validation | None = None) -> "TrainingRun":
        """A fresh one.

        One thread, so that a seed gives the same weights again on the same machine.
        """
        torch.set_num_threads(1)
        learner = learner_of(job.config)
        lanes = learner.lanes(job.config, job.seed)
        model = learner.model(job.config, lanes, job.seed)
        return cls(job, learner, lanes, model, validation or Validation())

    def policy(self) -> Policy:
        """What it would fly like now."""
        network, tensors = self.learner.export(self.model)
        config = self.job.config
        description = PolicyDescription(
            interface=config.policy.interface,
            network=network,
            observation=self.learner.observation(config),
            scenarios=config.scenarios.family,
            training=Training(
                algorithm=self.job.name,
                settings=config.model_dump(mode="json"),
                seed=self.job.seed,
                steps=self.model.num_timesteps,
                process_s=round(self.process_s, 1),
                wall_s=round(self.wall_s, 1),
                machine=f"{platform.machine()}, {platform.system()}",
            ),
            versions={name: _version(name) for name in _PACKAGES},
        )
        return Policy(description, {k: v.astype(np.float64) for k, v in tensors.items()})

    def flights(self, scenarios: list[Scenario]) -> NDArray[np.float64]:
        """How it flies these now, with the assistants that it learns with; see `fly`."""
        settings = self.job.config.policy
        return fly(
            self.policy(),
            scenarios,
            safety_filter=settings.safety_filter,
            return_mode=settings.return_mode,
            validation=self.validation,
        )

    def publish(self, directory: Path) -> Policy:
        """Score it on unseen scenarios and write it; gives what was written."""
        family = self.job.config.scenarios.family
        scenarios = validation_scenarios(family, self.job.missions)
        scored = score_of(self.flights(scenarios), f"{family.name}, validation")
        policy = self.policy()
        described = policy.description.model_copy(update={"score": scored})
        save_policy(directory, described, policy.tensors)
        return load_policy(directory)

    def read_zip(self, path: Path) -> None:
        """Take over the weights of a model that Stable-Baselines3 has saved.

        Of the zip, only the tensors of the policy are read, by torch's reader that executes
        nothing; the network is that of the configuration.

        Raises:
            InputError: The file is no such zip, or holds another network.
        """
        try:
            with zipfile.ZipFile(path) as archive:
                if archive.getinfo(_ZIPPED).file_size > _LARGEST_ZIPPED:
                    raise ValueError(f"{_ZIPPED} is larger than {_LARGEST_ZIPPED} bytes")
                content = io.BytesIO(archive.read(_ZIPPED))
            with warnings.catch_warnings():
                # what torch finds strange about a strange file; it is refused in a line below
                warnings.simplefilter("ignore")
                weights = torch.load(content, map_location="cpu", weights_only=True)
            self.model.policy.load_state_dict(weights)
        except (
            *(OSError, KeyError, ValueError, RuntimeError, AttributeError, TypeError),
            *(EOFError, zipfile.BadZipFile, pickle.UnpicklingError),
        ) as error:
            reason = " ".join(str(error).split())[:300]
            raise InputError(f"{path}: no model of this configuration ({reason})") from error


def _version(package: str) -> str:
    try:
        return version(package)
    except PackageNotFoundError:
        return "not installed"
