"""A trained model as a planner, to be scored like any other."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from sb3_contrib import MaskablePPO, RecurrentPPO
from stable_baselines3.common.base_class import BaseAlgorithm

from uas_coverage_env.flight import Assistants, as_planner
from uas_coverage_env.mission import MissionBrief
from uas_coverage_env.world import Command, SwarmState


class ReferencePolicy:
    """Flies what a model predicts, without its noise.

    Args:
        model: What has learned.
        settings: Of the environment that it learned in.
        swarm_of: The UAS that there is room for, where it flies the whole swarm; None: it is asked
            for each UAS.

    Attributes:
        model: As given.
        assistants: Those of the level.
    """

    def __init__(
        self, model: BaseAlgorithm, settings: Mapping[str, Any], swarm_of: int | None
    ) -> None:
        self.model: Any = model
        self._masked = isinstance(model, MaskablePPO)
        self._remembers = isinstance(model, RecurrentPPO)
        self._memory: Any = None
        seen = {**settings, "mask_in_observation": self._masked}
        self._planner = as_planner(self._action, swarm_of=swarm_of, **seen)
        self.assistants: Assistants = self._planner.assistants

    def warm_up(self, brief: MissionBrief) -> None:
        """Compile what it sees and does."""
        self._planner.warm_up(brief)

    def reset(self, brief: MissionBrief, seed: int) -> None:
        """Begin a mission, with nothing in mind."""
        self._memory = None
        self._planner.reset(brief, seed)

    def act(self, swarm: SwarmState) -> Mapping[str, Command]:
        """Ask the model."""
        return self._planner.act(swarm)

    def _action(self, seen: Any) -> Any:
        if self._masked:
            row, mask = seen["observation"], seen["action_mask"]
            return self.model.predict(row, action_masks=mask, deterministic=True)[0]
        if not self._remembers:
            return self.model.predict(seen, deterministic=True)[0]
        begins = np.array([self._memory is None])
        action, self._memory = self.model.predict(
            seen, state=self._memory, episode_start=begins, deterministic=True
        )
        return action
