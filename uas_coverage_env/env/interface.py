"""The forms in which learners' libraries want observations and infos."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from uas_coverage_env.env.observation import observation_bounds
from uas_coverage_env.env.settings import MissionSettings
from uas_coverage_env.world import ABSENT


def observation_space(settings: MissionSettings, n_uas: int = 1) -> spaces.Space[Any]:
    """What is observed of some UAS, one after the other.

    Args:
        settings: Of the missions.
        n_uas: How many.

    Returns:
        A float32 `Box`; with `mask_in_observation` a `Dict` of it (`observation`) and an int8 `Box`
        (`action_mask`).
    """
    low, high = (np.tile(bounds, n_uas) for bounds in observation_bounds(settings.observation))
    seen = spaces.Box(low, high, dtype=np.float32)
    if not settings.mask_in_observation:
        return seen
    mask = spaces.Box(0, 1, (n_uas * settings.kind.choices,), np.int8)
    return spaces.Dict({"observation": seen, "action_mask": mask})


def with_mask(observation: NDArray[np.float32], mask: NDArray[Any]) -> dict[str, NDArray[Any]]:
    """An observation of such a `Dict`."""
    return {"observation": observation, "action_mask": mask.astype(np.int8)}


def flat(infos: Mapping[str, Any], parent: str = "") -> dict[str, Any]:
    """Infos without sub-dictionaries: `reward_terms_home` for `["reward_terms"]["home"]`."""
    told: dict[str, Any] = {}
    for name, value in infos.items():
        if isinstance(value, Mapping):
            told |= flat(value, f"{parent}{name}_")
        else:
            told[parent + name] = value
    return told


def absent(info: Mapping[str, Any]) -> dict[str, Any]:
    """An info of the same kinds and shapes, of a UAS that the mission does not have."""
    return {**_zero(info), "status": ABSENT, "contact_with": -1}


def _zero(info: Mapping[str, Any]) -> dict[str, Any]:
    return {
        name: _zero(value)
        if isinstance(value, Mapping)
        else np.zeros_like(value)
        if isinstance(value, np.ndarray)
        else type(value)()
        for name, value in info.items()
    }


class LastKnown(dict[str, Any]):
    """What a step tells the agents that acted; asked for another agent, what it was told last.

    TorchRL looks for the mask of every possible agent, of those too that have ended.

    Args:
        told: By agent.
        before: What the step before told, and those before it.
    """

    def __init__(self, told: Mapping[str, Any], before: Mapping[str, Any]) -> None:
        super().__init__(told)
        self._last = {**getattr(before, "_last", before), **told}

    def __missing__(self, agent: str) -> Any:
        return self._last[agent]
