"""The forms in which learners' libraries want observations and infos."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from uas_coverage_env.env.episode.settings import MissionSettings
from uas_coverage_env.env.observation import ObservationBlock
from uas_coverage_env.env.observation.layout import observation_bounds


def observation_space(settings: MissionSettings, n_uas: int = 1) -> spaces.Space[Any]:
    """What is observed of some UAS, one after the other.

    Args:
        settings: Of the missions.
        n_uas: How many.

    Returns:
        A float32 `Box`; with `mask_in_observation` a `Dict` of it (`observation`) and an int8 `Box`
        (`action_mask`); with `images_apart` a `Dict` with a uint8 `Box` (n_uas · channels, rows,
        columns) for each picture, or that `Box` itself where there is nothing else.
    """
    blocks, images = settings.observation, _images_of(settings)
    rest = [block for block in blocks if block not in images]
    parts: dict[str, spaces.Space[Any]] = {}
    if rest:
        low, high = (np.tile(bounds, n_uas) for bounds in observation_bounds(rest))
        parts["observation"] = spaces.Box(low, high, dtype=np.float32)
    if settings.mask_in_observation:
        parts["action_mask"] = spaces.Box(0, 1, (n_uas * settings.kind.choices,), np.int8)
    for block in images:
        channels, *size = block.shape
        parts[block.name] = spaces.Box(0, 255, (n_uas * channels, *size), np.uint8)
    return spaces.Dict(parts) if len(parts) > 1 else next(iter(parts.values()))


def shown(
    settings: MissionSettings,
    rows: NDArray[np.float32],
    masks: NDArray[Any] | None = None,
    n_uas: int = 1,
) -> Any:
    """Observations of `observation_space`, from the rows of numbers that are computed.

    Args:
        settings: Of the missions.
        rows: (..., n_uas · V).
        masks: (..., n_uas · choices), with `mask_in_observation`.
        n_uas: How many UAS are in a row.

    Returns:
        The rows themselves where they are shown as they are.
    """
    if settings.rows_alone:
        return rows
    parts: dict[str, NDArray[Any]] = {}
    images, lanes = _images_of(settings), rows.shape[:-1]
    if not images:
        parts["observation"] = rows
    else:
        by_uas = rows.reshape(*lanes, n_uas, -1)
        rest, pictures, column = [], {}, 0
        for block in settings.observation:
            numbers = by_uas[..., column : column + block.size]
            column += block.size
            if block in images:
                channels, *size = block.shape
                image = np.rint(255.0 * numbers).astype(np.uint8)
                pictures[block.name] = image.reshape(*lanes, n_uas * channels, *size)
            else:
                rest.append(numbers)
        if rest:
            parts["observation"] = np.concatenate(rest, axis=-1).reshape(*lanes, -1)
        parts |= pictures
    if masks is not None:
        parts["action_mask"] = masks.astype(np.int8)
    return parts if len(parts) > 1 else next(iter(parts.values()))


def _images_of(settings: MissionSettings) -> list[ObservationBlock]:
    """The blocks that stand beside the observation."""
    return [block for block in settings.observation if settings.images_apart and block.shape]


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
