"""Learning to command velocities: one network for every UAS, by PPO or SAC."""

import warnings
from collections.abc import Iterator
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from stable_baselines3 import PPO, SAC
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.buffers import ReplayBuffer, RolloutBuffer
from stable_baselines3.common.type_aliases import RolloutBufferSamples
from stable_baselines3.common.vec_env import VecEnv, VecEnvWrapper
from stable_baselines3.common.vec_env.base_vec_env import VecEnvStepReturn

from uas_coverage_agents.policy.description import Observation
from uas_coverage_agents.policy.mlp import Mlp
from uas_coverage_agents.policy.networks import Network
from uas_coverage_agents.training.attention import AttentionPolicy
from uas_coverage_agents.training.config import SacSettings, TrainingConfig
from uas_coverage_agents.training.moving_obstacles import some_with_moving_obstacles
from uas_coverage_agents.training.scenarios import training_scenarios
from uas_coverage_agents.training.vec_env import CoverageVecEnv
from uas_coverage_agents.velocity.policy_runner import OUTPUTS, attention_network, observation
from uas_coverage_agents.velocity.settings import VelocitySettings
from uas_coverage_env.env import OBSERVATION_SIZE, observation_columns
from uas_coverage_env.env.observation.scales import NEARBY_M

_FLYING = int(observation_columns("own", "flying")[0, 0])
_RETURNING = int(observation_columns("own", "returning")[0, 0])
_NEAREST_VALID = int(observation_columns("waypoints", "valid")[0, 0])
_NEAREST_CLOSENESS = int(observation_columns("waypoints", "closeness")[0, 0])

_PITCH_M = 68.0
"""About as far apart as neighbouring waypoints of generated towns are [m]."""


class VelocityVecEnv(VecEnvWrapper):
    """The lanes of UAS as a learner should see them.

    A UAS decides while it flies and return mode has not taken it over. The lane of one that does
    not decide shows zeros and pays nothing, and the takeover ends its episode: what the autopilot
    does is neither its merit nor its fault. The end of the time is part of the mission and ends the
    episode as well.

    Added to the reward is a potential that changes no optimal policy (Ng, Harada, Russell 1999):
    gamma · potential' - potential, the potential being minus the distance to the nearest open
    waypoint, zero where the episode has ended.

    Args:
        lanes: Of the environment.
        nearing: Weight of the potential per 68 m.
        gamma: Discount.
    """

    def __init__(self, lanes: VecEnv, nearing: float, gamma: float) -> None:
        super().__init__(lanes)
        self._nearing, self._gamma = nearing, gamma
        self._decides = np.zeros(self.num_envs, dtype=np.bool_)
        self._potential = np.zeros(self.num_envs)

    def reset(self) -> NDArray[np.float32]:
        """Begin a mission in every lane."""
        return self._seen(np.asarray(self.venv.reset()))

    def step_wait(self) -> VecEnvStepReturn:
        """Fly one step."""
        view, rewards, ended, infos = self.venv.step_wait()
        decided, potential = self._decides, self._potential
        view = self._seen(np.asarray(view))
        ended = ended | (decided & ~self._decides)
        ahead = np.where(ended, 0.0, self._gamma * self._potential)
        rewards = np.where(decided, rewards + ahead - potential, 0.0)
        for lane in np.flatnonzero(ended):
            infos[lane]["TimeLimit.truncated"] = False
        return view, rewards.astype(np.float32), ended, infos

    def state_dict(self) -> dict[str, NDArray[np.generic]]:
        """See `Lanes`; what is kept here follows from it."""
        lanes: Any = self.venv
        return lanes.state_dict()

    def load_state_dict(self, state: dict[str, NDArray[np.generic]]) -> None:
        """See `Lanes`."""
        lanes: Any = self.venv
        self._seen(lanes.load_state_dict(state))

    def _seen(self, view: NDArray[np.float32]) -> NDArray[np.float32]:
        """Note which UAS decide now and their distances; return the view without the others."""
        self._decides = (view[:, _FLYING] > 0.0) & (view[:, _RETURNING] == 0.0)
        closeness = np.maximum(view[:, _NEAREST_CLOSENESS], 1e-3)
        distance_m = np.where(view[:, _NEAREST_VALID] > 0.0, NEARBY_M * (1 / closeness - 1), 0.0)
        self._potential = np.where(self._decides, -self._nearing * distance_m / _PITCH_M, 0.0)
        return np.where(self._decides[:, None], view, np.float32(0.0))


class DecidingRollouts(RolloutBuffer):
    """The samples of a rollout without those in which nothing was decided."""

    def get(self, batch_size: int | None = None) -> Iterator[RolloutBufferSamples]:  # pyrefly: ignore[bad-override]
        """Batches of samples in random order; a small rest is left out."""
        if not self.generator_ready:
            names = ("observations", "actions", "values", "log_probs", "advantages", "returns")
            for name in names:
                setattr(self, name, self.swap_and_flatten(getattr(self, name)))
            self.generator_ready = True
        decided = np.flatnonzero(self.observations[:, _FLYING] > 0.0)
        samples = np.random.permutation(decided)  # noqa: NPY002  # as the base class draws
        size = batch_size or len(samples)
        for start in range(0, max(1, len(samples) - size // 2), size):
            yield self._get_samples(samples[start : start + size])


class DecidingMemory(ReplayBuffer):
    """What SAC remembers: the samples of all lanes one after the other, if something was decided.

    In half of the samples of towns of one to four UAS, nothing is. Learned from, they would take
    half of every batch, and hold the entropy of them all at its target with actions that have no
    effect, at the cost of that of the others.

    Args:
        size: How many samples are remembered; the oldest make room.
        args: As of the base.
        n_envs: Number of lanes.
        kwargs: As of the base.
    """

    def __init__(self, size: int, *args: Any, n_envs: int, **kwargs: Any) -> None:
        super().__init__(size, *args, n_envs=1, **kwargs)

    def add(
        self,
        obs: NDArray[Any],
        next_obs: NDArray[Any],
        action: NDArray[Any],
        reward: NDArray[Any],
        done: NDArray[Any],
        infos: list[dict[str, Any]],
    ) -> None:
        """Remember a step of all lanes."""
        for i in np.flatnonzero(obs[:, _FLYING] > 0.0):
            super().add(obs[i], next_obs[i], action[i], reward[i], done[i], [infos[i]])


class SettlingPPO(PPO):
    """PPO that explores less and less: the deviation of the actions falls as the learning rate.

    What flies in the end is the mean action. Where the deviation stays large, as it does when it is
    learned, noise is what gets a UAS out of a circle round a waypoint, and nothing is learned about
    it: such policies flew circles until the battery was empty.
    """

    first_deviation: float

    def train(self) -> None:
        """Learn from a rollout."""
        super().train()
        policy: Any = self.policy
        share = policy.optimizer.param_groups[0]["lr"] / self.learning_rate
        with torch.no_grad():
            policy.log_std.fill_(float(np.log(self.first_deviation * share)))


class VelocityLearner:
    """See `Learner`."""

    def lanes(self, config: TrainingConfig, seed: int) -> VecEnv:
        """The environment to learn in."""
        settings = _settings(config)
        lanes = CoverageVecEnv(
            config.num_envs,
            some_with_moving_obstacles(
                training_scenarios(config.scenarios, seed), settings.moving_share, seed
            ),
            return_mode=settings.return_mode,
            safety_filter=settings.safety_filter,
            reward_weights=settings.rewards,
        )
        lanes.seed(seed)
        return VelocityVecEnv(lanes, settings.nearing, config.learning.gamma)

    def model(self, config: TrainingConfig, lanes: VecEnv, seed: int) -> BaseAlgorithm:
        """The untrained model."""
        settings, learning = _settings(config), config.learning
        activation = {"tanh": torch.nn.Tanh, "relu": torch.nn.ReLU}[settings.activation]
        network: dict[str, Any] = {"net_arch": list(settings.hidden), "activation_fn": activation}
        if isinstance(learning, SacSettings):
            return SAC(
                "MlpPolicy",
                lanes,
                learning_rate=learning.learning_rate,
                replay_buffer_class=DecidingMemory,
                buffer_size=learning.buffer_size,
                learning_starts=learning.first_samples,
                batch_size=learning.batch_size,
                gradient_steps=learning.updates_per_step,
                gamma=learning.gamma,
                ent_coef=f"auto_{learning.first_entropy}",
                policy_kwargs=network,
                device="cpu",
                seed=seed,
            )
        kind: Any = "MlpPolicy"
        if settings.network == "attention":
            kind, network = (
                AttentionPolicy,
                {"network": attention_network(settings.hidden[0], settings.keys)},
            )
        with warnings.catch_warnings():
            # of a rest that is no whole batch: `DecidingRollouts` leaves it out
            warnings.filterwarnings("ignore", message="You have specified a mini-batch size")
            model = SettlingPPO(
                kind,
                lanes,
                **learning.keywords,
                rollout_buffer_class=DecidingRollouts,
                policy_kwargs={**network, "log_std_init": float(np.log(settings.first_deviation))},
                device="cpu",
                seed=seed,
            )
        model.first_deviation = settings.first_deviation
        policy: Any = model.policy
        policy.log_std.requires_grad_(False)
        return model

    def export(self, model: BaseAlgorithm) -> tuple[Network, dict[str, NDArray[np.float32]]]:
        """The network that gives the mean action, and its weights."""
        if isinstance(model.policy, AttentionPolicy):
            return model.policy.network, model.policy.tensors()
        parts = _actor(model)
        modules = [part for part in parts if isinstance(part, torch.nn.Linear)]
        tensors = {}
        for k, module in enumerate(modules):
            tensors[f"layers.{k}.weight"] = module.weight.detach().numpy().copy()
            tensors[f"layers.{k}.bias"] = module.bias.detach().numpy().copy()
        relu = any(isinstance(part, torch.nn.ReLU) for part in parts)
        network = Mlp(
            inputs=OBSERVATION_SIZE,
            hidden=tuple(module.out_features for module in modules[:-1]),
            outputs=OUTPUTS,
            activation="relu" if relu else "tanh",
            squash=isinstance(model, SAC),
        )
        return network, tensors

    def observation(self, config: TrainingConfig) -> Observation:
        """What that network reads."""
        return observation()


def _settings(config: TrainingConfig) -> VelocitySettings:
    if not isinstance(config.policy, VelocitySettings):
        raise TypeError(f"the learner of velocities cannot train {config.policy.interface}s")
    return config.policy


def _actor(model: BaseAlgorithm) -> list[torch.nn.Module]:
    """The layers from observation to mean action, in order."""
    policy: Any = model.policy
    if isinstance(model, SAC):
        return [*policy.actor.latent_pi, policy.actor.mu]
    return [*policy.mlp_extractor.policy_net, policy.action_net]
