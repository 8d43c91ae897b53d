"""Learners with the interface of Stable-Baselines3: its classes, sb3-contrib's, and one's own."""

import warnings
from collections.abc import Mapping
from typing import Any

import numpy as np
from gymnasium.spaces import flatdim
from numpy.typing import NDArray
from stable_baselines3.common.env_util import make_vec_env
from stable_baselines3.common.logger import KVWriter, Logger
from stable_baselines3.common.vec_env import VecEnv

from uas_coverage_agents.policy.environment import observed, plain
from uas_coverage_agents.policy.library import Library
from uas_coverage_agents.training.central_critic import CentralCriticPolicy
from uas_coverage_agents.training.learner import Arrays, Learned, Told
from uas_coverage_agents.training.missions import Missions
from uas_coverage_agents.training.model_arrays import learned, take_over
from uas_coverage_agents.training.rollouts import FlownSteps, flown_buffer_of
from uas_coverage_agents.training.settings import (
    LearnerSettings,
    check_on_processor,
    named_objects,
    takes,
)
from uas_coverage_agents.training.vec_env import CoverageVecEnv
from uas_coverage_env.env import CoverageSwarmEnv, full_state
from uas_coverage_env.env.episode.settings import MissionSettings
from uas_coverage_env.files.strict_toml import InputError
from uas_coverage_env.plugins.users_code import described
from uas_coverage_env.scenario import MissionSource


class LibraryLearner:
    """See `Learner`; the library's `learn` does the work of a round.

    Args:
        settings: Of the training.
        missions: Where it learns.
        seed: Of network and sampling.
        algorithm: The class that learns.
    """

    def __init__(
        self, settings: LearnerSettings, missions: Missions, seed: int, algorithm: type
    ) -> None:
        check_on_processor(settings)
        self._settings, self._seed = settings, seed
        source = missions.source()
        self._room, self._chosen = source.room, missions.settings()
        self.keywords = keywords_of(settings, self._chosen, self._room)
        self.env = env_of(settings, source, self.keywords, settings.num_envs)
        self.model = model_of(settings, algorithm, self.env, seed, self._room)

    @property
    def steps(self) -> int:
        """Flown steps learned from: decisions of all agents together."""
        return int(self.model.num_timesteps)

    def learn(self, number: int, told: Told) -> None:
        """As many steps as are a round's share of the whole."""
        settings, model = self._settings, self.model
        self.env.seed(self._seed)
        wanted = settings.total_timesteps * (number + 1) // settings.rounds - self.steps
        if wanted > 0:
            if hasattr(model, "set_logger"):
                model.set_logger(Logger(None, [_Writer(told)]))
            # of UAS that fly, steps count, and those that wait do not
            counts = isinstance(self.env, CoverageVecEnv) and takes(model.learn, "callback")
            more = {"callback": FlownSteps()} if counts else {}
            model.learn(wanted, reset_num_timesteps=False, **more)
        self.env.close()

    def state_dict(self) -> Arrays:
        """Weights, optimisers, counters, and what is in a replay buffer."""
        return learned(self.model)

    def load_state_dict(self, state: Mapping[str, NDArray[Any]]) -> None:
        """See `Learner`."""
        take_over(state, self.model)

    def learned(self) -> Learned:
        """The policy, which flies by the library that it was made with."""
        tensors = weights_of(self.model)
        observation = observed(self.keywords)
        network = Library(
            inputs=observation.size,
            tensors={name: tensor.shape for name, tensor in tensors.items()},
            room=tuple(self._room),
            environment=plain(self._chosen),
        )
        return Learned("environment", network, observation, tensors)


def keywords_of(
    settings: LearnerSettings, chosen: Mapping[str, Any], room: tuple[int, int, int]
) -> dict[str, Any]:
    """Keyword arguments of the environments, with what a central critic sees beside.

    Args:
        settings: Of the training.
        chosen: Keyword arguments, without it.
        room: The most UAS, waypoints and moving obstacles.
    """
    if settings.critic == "own":
        return dict(chosen)
    rules = MissionSettings.of(chosen)
    return {**chosen, "observation": (*rules.observation, *full_state(*room))}


def env_of(
    settings: LearnerSettings, source: MissionSource, keywords: Mapping[str, Any], num_envs: int
) -> VecEnv:
    """Environments, as the agents of the training see them."""
    if settings.agent == "each":
        return CoverageVecEnv(num_envs, source, **keywords)
    return make_vec_env(lambda: CoverageSwarmEnv(source, **keywords), num_envs)


def model_of(
    settings: LearnerSettings,
    algorithm: Any,
    env: VecEnv,
    seed: int,
    room: tuple[int, int, int],
    **more: Any,
) -> Any:
    """A model that has learned nothing.

    Args:
        settings: Of the training.
        algorithm: The class.
        env: Where it is to learn.
        seed: Of network and sampling.
        room: The most UAS, waypoints and moving obstacles.
        **more: Arguments instead of those of the settings.

    Raises:
        InputError: The class does not take what the settings say.
    """
    given = {**named_objects(settings.learning), **more}
    aliases = getattr(algorithm, "policy_aliases", None) or {"MlpPolicy": None}
    policy = named_objects(settings.policy or next(iter(aliases)))
    if settings.critic == "full":
        if settings.policy not in (None, "MlpPolicy"):
            raise InputError(
                f'critic = "full" is for policy = "MlpPolicy", not {settings.policy!r}'
            )
        policy = CentralCriticPolicy
        seen = flatdim(env.observation_space) - sum(block.size for block in full_state(*room))
        given["policy_kwargs"] = {**given.get("policy_kwargs", {}), "actor_size": seen}
    if isinstance(env, CoverageVecEnv) and takes(algorithm.__init__, "rollout_buffer_class"):
        masked = takes(algorithm.predict, "action_masks")
        own = flown_buffer_of(env.observation_space, masked)
        given = {"rollout_buffer_class": own, **given}
    try:
        with warnings.catch_warnings():
            # of mini-batches that do not divide a rollout, also where nothing is to be learned
            warnings.filterwarnings("ignore", message="You have specified a mini-batch size")
            return algorithm(policy, env, seed=seed, device="cpu", **given)
    except InputError:
        raise
    except Exception as error:  # whatever a library or a user's class raises is one line
        raise InputError(
            f"{settings.algorithm} cannot be made for the action {env.action_space}; see "
            f"[learning] and environment.action: {described(error)}"
        ) from error


def weights_of(model: Any) -> dict[str, NDArray[Any]]:
    """What a model needs to predict, by name; float32, as a policy keeps it."""
    if hasattr(model, "get_parameters"):
        found = {k: v.detach().cpu().numpy() for k, v in model.policy.state_dict().items()}
    else:
        found = model.state_dict()
    return {name: np.asarray(array, np.float32) for name, array in found.items()}


class _Writer(KVWriter):
    """Passes on what a library logs."""

    def __init__(self, told: Told) -> None:
        self._told = told

    def write(self, key_values: dict[str, Any], key_excluded: Any, step: int = 0) -> None:
        """See the base."""
        kinds = int, float, np.number
        numbers = {k: float(v) for k, v in key_values.items() if isinstance(v, kinds)}
        self._told.add(step, **numbers)

    def close(self) -> None:
        """Nothing is open."""
