"""Flies what a library has learned, as the library predicts it, without noise."""

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
import torch
from stable_baselines3.common.base_class import BaseAlgorithm

from uas_coverage_agents.policy import Policy
from uas_coverage_agents.policy.environment import as_given
from uas_coverage_agents.policy.library import Library
from uas_coverage_agents.training.library import env_of, keywords_of, model_of, observed
from uas_coverage_agents.training.settings import (
    LearnerSettings,
    authors_own,
    class_named,
    takes,
)
from uas_coverage_env.env.episode.settings import MissionSettings
from uas_coverage_env.files.strict_toml import parse
from uas_coverage_env.flight import Assistants, as_planner
from uas_coverage_env.mission import MissionBrief
from uas_coverage_env.scenario import MissionSource, load_scenario
from uas_coverage_env.scenario.room import Room
from uas_coverage_env.tasks.in_batch import BatchedPolicy
from uas_coverage_env.world import Command, SwarmState


class EnvironmentRunner:
    """The actions of an environment, for the whole swarm or one UAS after the other.

    Args:
        policy: Of the interface "environment".
        assistants: Those that fly along; they change nothing here.
        trust: Whether classes of the author's own may be imported.

    Raises:
        InputError: Its class cannot be loaded or made.
        ValueError: It cannot be flown; says why.
    """

    def __init__(self, policy: Policy, assistants: Assistants, *, trust: bool = False) -> None:
        network, training = policy.description.network, policy.description.training
        if not isinstance(network, Library):
            raise ValueError(f"network.kind is {network.kind!r}, not 'library'")
        settings = parse(training.settings, LearnerSettings, "training.settings")
        own = authors_own(settings)
        if own and not trust:
            raise ValueError(
                f"it flies by {own[0]}, a class of its author's own, which would be imported; "
                f"add --option trust=true if you trust it"
            )
        room = Room(*network.room)
        keywords = keywords_of(settings, as_given(network.environment), room)
        if not policy.description.observation.has_the_numbers_of(observed(keywords)):
            raise ValueError("its observation is not that of this version; train it anew")
        self.model = _model(policy, settings, keywords, room)
        self._masked = takes(self.model.predict, "action_masks")
        self._memories: dict[str, Any] = {}
        self._asked: Iterator[str] = iter(())
        self._each = settings.agent == "each"
        self._swarm_of = None if self._each else room.n_uas
        self._keywords = {**keywords, "mask_in_observation": self._masked}
        self._planner = as_planner(self._action, swarm_of=self._swarm_of, **self._keywords)
        self.assistants = self._planner.assistants

    @property
    def in_batch(self) -> BatchedPolicy | None:
        """The same for many rows, where it is a library's class that remembers nothing."""
        remembers = hasattr(getattr(self.model, "policy", None), "lstm_actor")
        if not isinstance(self.model, BaseAlgorithm) or remembers:
            return None
        return BatchedPolicy.of(self._actions, self._keywords, self._swarm_of)

    def warm_up(self, brief: MissionBrief) -> None:
        """Compile what it sees and does."""
        self._planner.warm_up(brief)

    def reset(self, brief: MissionBrief, seed: int) -> None:
        """Begin a mission, with nothing in mind; nothing is drawn."""
        self._memories.clear()
        self._planner.reset(brief, seed)

    def act(self, swarm: SwarmState) -> Mapping[str, Command]:
        """Ask the model."""
        active = [name for name in swarm.names if name in swarm.active]
        self._asked = iter(active if self._each else [""])
        return self._planner.act(swarm)

    def _action(self, seen: Any) -> Any:
        asked, more = next(self._asked), {}
        if self._masked:
            more["action_masks"] = seen["action_mask"]
            seen = seen["observation"]
        action, self._memories[asked] = self.model.predict(
            seen,
            state=self._memories.get(asked),
            episode_start=np.array([asked not in self._memories]),
            deterministic=True,
            **more,
        )
        return action

    def _actions(self, seen: Any) -> Any:
        """Of many rows."""
        more = {}
        if self._masked:
            more["action_masks"] = seen["action_mask"]
            seen = seen["observation"]
        return self.model.predict(seen, deterministic=True, **more)[0]


def _model(
    policy: Policy, settings: LearnerSettings, keywords: Mapping[str, Any], room: Room
) -> Any:
    """The model, made as it was for learning, with the weights of the policy."""
    algorithm = class_named(settings.algorithm)
    if MissionSettings.of(keywords).observation_size != policy.description.network.inputs:
        raise ValueError(f"network.inputs is {policy.description.network.inputs}")
    field = load_scenario("open_field")  # spaces depend on the room alone
    scenario = field.model_copy(update={"uas": field.uas[:1], "waypoints": field.waypoints[:1]})
    source = MissionSource(lambda _: scenario, **room._asdict())
    env = env_of(settings, source, keywords, 1)
    small = {"buffer_size": 1} if takes(algorithm.__init__, "buffer_size") else {}
    model = model_of(settings, algorithm, env, 0, room, **small)
    env.close()
    try:
        if hasattr(model, "get_parameters"):
            tensors = {k: torch.from_numpy(v.copy()) for k, v in policy.tensors.items()}
            model.policy.load_state_dict(tensors)
        else:
            model.load_state_dict(dict(policy.tensors))
    except (RuntimeError, KeyError, ValueError, TypeError) as error:
        reason = " ".join(str(error).split())[:300]
        raise ValueError(f"its weights are not those of {settings.algorithm} ({reason})") from error
    return model
