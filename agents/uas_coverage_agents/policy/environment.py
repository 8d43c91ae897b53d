"""Flies what acts in the environments and is run in NumPy."""

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydantic import JsonValue

from uas_coverage_agents.policy.actor import Actor
from uas_coverage_agents.policy.description import Observation
from uas_coverage_agents.policy.directory import Policy
from uas_coverage_env.env.episode.settings import MissionSettings
from uas_coverage_env.env.observation.scales import SCALES
from uas_coverage_env.env.versions import version_named
from uas_coverage_env.flight import Assistants, as_planner
from uas_coverage_env.mission import MissionBrief
from uas_coverage_env.tasks.in_batch import BatchedPolicy
from uas_coverage_env.world import Command, SwarmState


def observed(keywords: Mapping[str, Any]) -> Observation:
    """What a policy of these environments reads of one UAS."""
    settings = MissionSettings.of(keywords)
    return Observation.of(f"uas_coverage_{settings.version.name}", settings.observation, SCALES)


def plain(keywords: Mapping[str, Any]) -> dict[str, JsonValue]:
    """Keyword arguments of environments as they are written into a file."""
    version = {"version": keywords["version"].name} if "version" in keywords else {}
    return {**keywords, **version}


def as_given(written: Mapping[str, JsonValue]) -> dict[str, Any]:
    """Keyword arguments of environments from what `plain` made of them."""
    version = {"version": version_named(str(written["version"]))} if "version" in written else {}
    return {**written, **version}


def keywords_of(policy: Policy) -> dict[str, Any]:
    """Keyword arguments of the environments that a policy flies in, as `action_of` needs them.

    Raises:
        ValueError: It flies in none by itself, or its observation is not that of this version.
    """
    network = policy.description.network
    if not isinstance(network, Actor):
        raise ValueError(f"network.kind is {network.kind!r}, not 'actor'")
    keywords = as_given(network.environment)
    settings = MissionSettings.of(keywords)
    if settings.chooses:
        keywords["mask_in_observation"] = True
    if not policy.description.observation.has_the_numbers_of(observed(keywords)):
        raise ValueError("its observation is not that of this version; train it anew")
    wanted = settings.kind.choices or settings.kind.size
    chooses = network.candidates is not None and network.pointing is None
    if network.outputs != wanted or (chooses and not settings.chooses):
        raise ValueError(f"network: {network.outputs} outputs for action {settings.kind.name!r}")
    return keywords


def action_of(policy: Policy) -> Callable[[Any], Any]:
    """The policy as a function from observations (..., V) to actions.

    With choices it takes a mapping of `observation` and `action_mask`, as `mask_in_observation`
    makes it; what is masked is never chosen. Where choices are drawn, what is drawn depends on what
    is observed alone: a row is answered the same by itself and among others.

    Args:
        policy: Of an `Actor`.

    Raises:
        ValueError: See `keywords_of`.
    """
    network = policy.description.network
    temperature = getattr(network, "temperature", 0.0)

    def drawn(scores: Any, observation: Any) -> Any:
        if temperature == 0.0:
            return scores
        chance = _drawn_by(observation, scores.shape[-1])
        return scores - temperature * np.log(-np.log(chance))  # Gumbel's distribution

    def actions(seen: Any) -> Any:
        found = policy.forward(seen)
        if getattr(network, "pointing", None):
            which = drawn(found[..., 0], seen).argmax(axis=-1)
            found = np.take_along_axis(found, which[..., None, None], -2)[..., 0, 1:]
        return np.clip(found, -1.0, 1.0).astype(np.float32)

    def choices(seen: Any) -> Any:
        observation = seen["observation"]
        scores = drawn(policy.forward(observation), observation)
        return np.where(seen["action_mask"], scores, -np.inf).argmax(axis=-1)

    return choices if keywords_of(policy).get("mask_in_observation") else actions


def _drawn_by(observed: NDArray[np.float32], n: int) -> NDArray[np.float64]:
    """(..., n) numbers between 0 and 1, as if drawn at random, for each row (..., V)."""
    bits = np.asarray(observed, np.float32, order="C").view(np.uint32).astype(np.uint64)
    odd = np.random.default_rng(0).integers(2**63, size=bits.shape[-1], dtype=np.uint64) * 2 + 1
    mixed = (bits * odd).sum(axis=-1, dtype=np.uint64)[..., np.newaxis]
    mixed = mixed + np.arange(n, dtype=np.uint64) * np.uint64(0x9E3779B97F4A7C15)
    # the finaliser of SplitMix64 (Steele, Lea, Flood 2014)
    mixed = (mixed ^ (mixed >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    mixed = (mixed ^ (mixed >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    mixed ^= mixed >> np.uint64(31)
    return ((mixed >> np.uint64(11)).astype(np.float64) + 0.5) * 2.0**-53


class ActorRunner:
    """Every UAS by itself, as it was learned.

    Args:
        policy: Of the interface "environment".
        assistants: Those that fly along; they change nothing here.

    Raises:
        ValueError: It cannot be flown; says why.
    """

    def __init__(self, policy: Policy, assistants: Assistants) -> None:
        self._act, self._keywords = action_of(policy), keywords_of(policy)
        self._planner = as_planner(self._act, **self._keywords)
        self.assistants = self._planner.assistants

    @property
    def in_batch(self) -> BatchedPolicy:
        """The same for the rows of many missions."""
        return BatchedPolicy.of(self._act, self._keywords)

    def warm_up(self, brief: MissionBrief) -> None:
        """Compile what it sees and does."""
        self._planner.warm_up(brief)

    def reset(self, brief: MissionBrief, seed: int) -> None:
        """Begin a mission."""
        self._planner.reset(brief, seed)

    def act(self, swarm: SwarmState) -> Mapping[str, Command]:
        """Ask the network for each UAS that flies."""
        return self._planner.act(swarm)
