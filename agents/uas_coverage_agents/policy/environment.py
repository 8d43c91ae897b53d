"""Flies what acts in the environments and is run in NumPy."""

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from pydantic import JsonValue

from uas_coverage_agents.policy.actor import Actor
from uas_coverage_agents.policy.description import Observation
from uas_coverage_agents.policy.directory import Policy
from uas_coverage_env.env.episode.settings import MissionSettings
from uas_coverage_env.env.observation.scales import SCALES
from uas_coverage_env.env.versions import version_named
from uas_coverage_env.flight import Assistants, as_planner
from uas_coverage_env.mission import MissionBrief
from uas_coverage_env.world import Command, SwarmState


def observed(keywords: Mapping[str, Any]) -> Observation:
    """What a policy of these environments reads of one UAS."""
    settings = MissionSettings.of(keywords)
    return Observation.of(f"uas_coverage_{settings.version.name}", settings.observation, SCALES)


def plain(keywords: Mapping[str, Any]) -> dict[str, JsonValue]:
    """Keyword arguments of environments as they are written into a file."""
    version = {"version": keywords["version"].name} if "version" in keywords else {}
    return {**keywords, **version}


def keywords_of(policy: Policy) -> dict[str, Any]:
    """Keyword arguments of the environments that a policy flies in, as `action_of` needs them.

    Raises:
        ValueError: It flies in none by itself, or its observation is not that of this version.
    """
    network = policy.description.network
    if not isinstance(network, Actor):
        raise ValueError(f"network.kind is {network.kind!r}, not 'actor'")
    keywords: dict[str, Any] = dict(network.environment)
    if "version" in keywords:
        keywords["version"] = version_named(str(keywords["version"]))
    settings = MissionSettings.of(keywords)
    if settings.chooses:
        keywords["mask_in_observation"] = True
    if not policy.description.observation.has_the_numbers_of(observed(keywords)):
        raise ValueError("its observation is not that of this version; train it anew")
    wanted = settings.kind.choices or settings.kind.size
    if network.outputs != wanted or bool(network.candidates) and settings.chooses == bool(network.pointing):
        raise ValueError(f"network: {network.outputs} outputs for action {settings.kind.name!r}")
    return keywords


def action_of(policy: Policy, seed: int = 0) -> Callable[[Any], Any]:
    """The policy as a function from observations (..., V) to actions.

    With choices it takes a mapping of `observation` and `action_mask`, as `mask_in_observation`
    makes it; what is masked is never chosen.

    Args:
        policy: Of an `Actor`.
        seed: Of what it draws, where it draws choices.

    Raises:
        ValueError: See `keywords_of`.
    """
    rng = np.random.default_rng(seed)
    network = policy.description.network
    temperature = getattr(network, "temperature", 0.0)

    def actions(seen: Any) -> Any:
        found = policy.forward(seen)
        if getattr(network, "pointing", None):
            scores = found[..., 0]
            if temperature > 0.0:
                scores = scores + temperature * rng.gumbel(size=scores.shape)
            best = scores.argmax(-1)[..., None, None]
            found = np.take_along_axis(found, best, -2)[..., 0, 1:]
        return np.clip(found, -1.0, 1.0).astype(np.float32)

    def choices(seen: Any) -> Any:
        scores = policy.forward(seen["observation"])
        if temperature > 0.0:
            scores = scores + temperature * rng.gumbel(size=scores.shape)
        return np.where(seen["action_mask"], scores, -np.inf).argmax(axis=-1)

    return choices if keywords_of(policy).get("mask_in_observation") else actions


class ActorRunner:
    """Every UAS by itself, as it was learned.

    Args:
        policy: Of the interface "environment".
        assistants: Those that fly along; they change nothing here.

    Raises:
        ValueError: It cannot be flown; says why.
    """

    def __init__(self, policy: Policy, assistants: Assistants) -> None:
        self._policy, self._keywords = policy, keywords_of(policy)
        self._planner = as_planner(action_of(policy), **self._keywords)
        self.assistants = self._planner.assistants

    def warm_up(self, brief: MissionBrief) -> None:
        """Compile what it sees and does."""
        self._planner.warm_up(brief)

    def reset(self, brief: MissionBrief, seed: int) -> None:
        """Begin a mission; what is drawn depends on the seed alone."""
        self._planner = as_planner(action_of(self._policy, seed), **self._keywords)
        self._planner.reset(brief, seed)

    def act(self, swarm: SwarmState) -> Mapping[str, Command]:
        """Ask the network for each UAS that flies."""
        return self._planner.act(swarm)
