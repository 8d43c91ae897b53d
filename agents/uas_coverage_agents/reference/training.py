"""Trains a reference learner on a level in rounds, each of which ends with a checkpoint.

A round begins with a fresh model that takes over what was learned, new missions and random numbers
of its own: a training that was killed goes on to the same weights as one that was not.
"""

import json
import time
from collections.abc import Callable
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Any

import torch
from numpy.typing import NDArray
from safetensors import SafetensorError, safe_open
from safetensors import numpy as safetensors
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.env_util import make_vec_env
from stable_baselines3.common.vec_env import VecEnv

from uas_coverage_agents.reference.central_critic import CentralCriticPolicy
from uas_coverage_agents.reference.policy import ReferencePolicy
from uas_coverage_agents.reference.settings import Reference
from uas_coverage_agents.training.model_arrays import learned, take_over
from uas_coverage_agents.training.vec_env import CoverageVecEnv
from uas_coverage_env.env import full_state
from uas_coverage_env.env.observation.named import OBSERVATIONS
from uas_coverage_env.files.plain_files import write_atomically
from uas_coverage_env.files.strict_toml import InputError
from uas_coverage_env.tasks import level_named, swarm_env

STATE = "state.safetensors"

_SEEDS_APART = 1000  # of the rounds of one training and those of the next


@dataclass(frozen=True)
class Trained:
    """What a training has come to.

    Attributes:
        policy: Flies what was learned.
        steps: Learned from, of all agents together.
        process_s: Processor time of the rounds [s].
    """

    policy: ReferencePolicy
    steps: int
    process_s: float


def train_reference(
    reference: Reference,
    level: str,
    seed: int,
    directory: Path,
    on_round: Callable[[int, int, float], object] = lambda *_: None,
) -> Trained:
    """Train, or go on with a training.

    Args:
        reference: The learner.
        level: Name of a level; it learns on the training split.
        seed: Of network, sampling and missions.
        directory: Gets the state of the training.
        on_round: Told after each round: its number, steps so far, processor time so far [s].

    Raises:
        InputError: The directory holds another training, or a damaged one.
        ValueError: Unknown level, or a setting that is the level's affair.
    """
    torch.set_num_threads(1)
    task = level_named(level)
    order = {"reference": reference.model_dump(mode="json"), "level": level, "seed": seed}
    arrays, done, process_s = _checkpoint(directory / STATE, order)
    lanes = lanes_of(reference, level)
    model = _model(reference, lanes, _seed(seed, done), level)
    if arrays is not None:
        take_over(arrays, model)
    while done < reference.rounds:
        began = time.process_time()
        lanes.seed(_seed(seed, done))
        wanted = reference.steps * (done + 1) // reference.rounds - model.num_timesteps
        if wanted > 0:
            model.learn(wanted, reset_num_timesteps=False)
        done += 1
        process_s += time.process_time() - began
        arrays = learned(model)
        told = json.dumps({"order": order, "rounds": done, "process_s": process_s})
        directory.mkdir(parents=True, exist_ok=True)
        write_atomically(directory / STATE, safetensors.save(arrays, {"training": told}))
        on_round(done, model.num_timesteps, process_s)
        model = _model(reference, lanes, _seed(seed, done), level)
        take_over(arrays, model)
    lanes.close()
    room = task.missions().room
    swarm_of = room.n_uas if reference.agent == "swarm" else None
    policy = ReferencePolicy(model, task.settings(**chosen_of(reference, level)), swarm_of)
    return Trained(policy, model.num_timesteps, process_s)


def chosen_of(reference: Reference, level: str) -> dict[str, Any]:
    """What a learner chooses of a level, as keyword arguments of its environments."""
    observation = OBSERVATIONS[reference.environment.observation]
    if reference.critic == "full":
        observation = (*observation, *full_state(*level_named(level).missions().room))
    chosen: dict[str, Any] = {"observation": observation}
    if reference.environment.action is not None:
        chosen["action"] = reference.environment.action
    return chosen


def lanes_of(reference: Reference, level: str) -> VecEnv:
    """Where it learns."""
    task, chosen = level_named(level), chosen_of(reference, level)
    if reference.agent == "each":
        settings = task.settings(**chosen)
        return CoverageVecEnv(reference.missions, task.missions(), **settings)
    return make_vec_env(lambda: swarm_env(level, **chosen), reference.missions)


def _model(reference: Reference, lanes: VecEnv, seed: int, level: str) -> BaseAlgorithm:
    library = import_module(reference.library)
    more: dict[str, Any] = {}
    policy: Any = reference.policy
    if reference.critic == "full":
        policy = CentralCriticPolicy
        blocks = OBSERVATIONS[reference.environment.observation]
        more["policy_kwargs"] = {"actor_size": sum(block.size for block in blocks)}
    learner = getattr(library, reference.algorithm)
    try:
        return learner(policy, lanes, seed=seed, device="cpu", **more, **reference.learning)
    except TypeError as error:
        reason = " ".join(str(error).split())
        raise InputError(f"[learning] of {reference.algorithm}: {reason}") from error


def _seed(seed: int, done: int) -> int:
    return _SEEDS_APART * seed + done


def _checkpoint(
    path: Path, order: dict[str, Any]
) -> tuple[dict[str, NDArray[Any]] | None, int, float]:
    """What the checkpoint holds: arrays, rounds done, processor time; nothing where none was."""
    if not path.exists():
        return None, 0, 0.0
    try:
        with safe_open(path, framework="np") as file:
            told = json.loads(file.metadata()["training"])
            arrays = {name: file.get_tensor(name) for name in file.keys()}  # noqa: SIM118
        there, rounds, process_s = told["order"], int(told["rounds"]), float(told["process_s"])
    except (OSError, SafetensorError, KeyError, ValueError, TypeError) as error:
        reason = " ".join(str(error).split())[:200]
        raise InputError(f"{path}: cannot be read ({reason}); remove it to begin anew") from error
    if there != order:
        raise InputError(f"{path.parent}: holds a training with other settings; give another --out")
    return arrays, rounds, process_s
