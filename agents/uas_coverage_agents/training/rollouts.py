"""What Stable-Baselines3 and sb3-contrib learn from: decisions alone.

Where a UAS has landed or is lost before its mission ends, `CoverageVecEnv` has rows without a
decision; on `hard` more than half of them. A buffer of this file keeps them out of the gradients,
and `FlownSteps` out of the count of steps:

    PPO("MlpPolicy", env, rollout_buffer_class=FlownRolloutBuffer).learn(10**6, FlownSteps())
"""

from collections.abc import Iterator
from typing import Any

import numpy as np
from gymnasium.spaces import Dict
from numpy.typing import NDArray
from sb3_contrib.common.maskable.buffers import MaskableDictRolloutBuffer, MaskableRolloutBuffer
from stable_baselines3.common.buffers import BaseBuffer, DictRolloutBuffer, RolloutBuffer
from stable_baselines3.common.callbacks import BaseCallback

from uas_coverage_agents.training.vec_env import CoverageVecEnv


class FlownSteps(BaseCallback):
    """Counts flown steps, decisions of a UAS, as `num_timesteps`, and tells buffers which they are.

    Without it every lane counts in every step. For `learn(total_timesteps, callback)` of any class
    of the library.

    Raises:
        ValueError: The environment is no `CoverageVecEnv`.
    """

    def _on_training_start(self) -> None:
        env = self.training_env.unwrapped
        if not isinstance(env, CoverageVecEnv):
            raise ValueError(f"{env!r} is no CoverageVecEnv")
        self._env = env

    def _on_step(self) -> bool:
        flew = self._env.flew
        self.model.num_timesteps += int(flew.sum()) - len(flew)
        self.num_timesteps = self.model.num_timesteps
        buffer = self.locals.get("rollout_buffer")
        if isinstance(buffer, _Flown):
            buffer.flew = flew
        return True


class _Flown(BaseBuffer):
    """A rollout buffer that keeps the rows that hold a decision; needs `FlownSteps`.

    Advantages are those of the library: the end of a UAS cuts them, so that they are the same with
    and without what is left out. Then the rows that hold a decision are all there is, as of one
    environment.
    """

    flew: NDArray[np.bool_] | None = None
    _whole: tuple[int, int] | None = None

    def reset(self) -> None:
        """Begin a rollout of all lanes."""
        self.buffer_size, self.n_envs = self._whole = self._whole or (self.buffer_size, self.n_envs)
        self._kept = np.zeros(self._whole, dtype=np.bool_)
        super().reset()

    def add(self, *args: Any, **kwargs: Any) -> None:
        """Take a step of all lanes."""
        if self.flew is None:
            raise ValueError("which UAS flew is not known; give learn(..., callback=FlownSteps())")
        self._kept[self.pos], self.flew = self.flew, None
        super().add(*args, **kwargs)

    def compute_returns_and_advantage(self, last_values: Any, dones: NDArray[Any]) -> None:
        """Compute them, and leave out what holds no decision."""
        super().compute_returns_and_advantage(last_values, dones)  # pyrefly: ignore[missing-attribute]
        if self._kept.sum() < 2:
            raise ValueError(f"{self._kept.sum()} decisions in a rollout; take more n_steps")
        for name, held in vars(self).items():
            if name != "_kept":
                setattr(self, name, self._packed(held))
        self.buffer_size, self.n_envs = int(self._kept.sum()), 1

    def _packed(self, held: Any) -> Any:
        if isinstance(held, dict):
            return {name: self._packed(each) for name, each in held.items()}
        if isinstance(held, np.ndarray) and held.shape[:2] == self._whole:
            return held[self._kept][:, np.newaxis]
        return held

    def get(self, batch_size: int | None = None) -> Iterator[Any]:
        """Batches; one of a single row, of which nothing can be normalised, is left out."""
        for batch in super().get(batch_size):  # pyrefly: ignore[missing-attribute]
            if batch_size == 1 or len(batch.old_values) > 1:
                yield batch


class FlownRolloutBuffer(_Flown, RolloutBuffer):
    """For PPO, A2C and TRPO."""


class FlownDictRolloutBuffer(_Flown, DictRolloutBuffer):
    """The same for observations that are dictionaries."""


class FlownMaskableRolloutBuffer(_Flown, MaskableRolloutBuffer):
    """For MaskablePPO."""


class FlownMaskableDictRolloutBuffer(_Flown, MaskableDictRolloutBuffer):
    """The same for observations that are dictionaries."""


def flown_buffer_of(observation_space: Any, masked: bool) -> type[BaseBuffer]:
    """The buffer of a learner.

    Args:
        observation_space: Of its environment.
        masked: Whether it is shown the masks of choices.
    """
    if isinstance(observation_space, Dict):
        return FlownMaskableDictRolloutBuffer if masked else FlownDictRolloutBuffer
    return FlownMaskableRolloutBuffer if masked else FlownRolloutBuffer
