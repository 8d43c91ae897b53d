"""What the numbers of an observation mean: the table that spaces and documentation come from."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.env.observation.block import Group
from uas_coverage_env.env.observation.home import HOME
from uas_coverage_env.env.observation.moving_obstacles import MOVING_OBSTACLES
from uas_coverage_env.env.observation.others import OTHERS
from uas_coverage_env.env.observation.own import OWN
from uas_coverage_env.env.observation.remaining import REMAINING
from uas_coverage_env.env.observation.surroundings import SURROUNDINGS
from uas_coverage_env.env.observation.waypoints import WAYPOINTS
from uas_coverage_env.env.observation.ways import WAYS

OBSERVATION = (OWN, HOME, REMAINING, SURROUNDINGS, WAYPOINTS, OTHERS, MOVING_OBSTACLES)
"""The blocks of an observation of `uas_coverage_v0`, in their order."""

OBSERVATION_V1 = (*OBSERVATION, WAYS)
"""Those of `uas_coverage_v1`: the same, and behind them the ways to the waypoints."""

OBSERVATION_SIZE = sum(block.size for block in OBSERVATION)
"""Numbers in the observation of one UAS, the same in every scenario."""


def observation_bounds(
    blocks: Sequence[Group] = OBSERVATION,
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """The smallest and the largest value of every number of an observation.

    Args:
        blocks: What it is made of.

    Returns:
        (low, high), each (size,).
    """
    rows = [
        (feature.low, feature.high)
        for group in blocks
        for _ in range(group.repeats)
        for feature in group.features
        for _ in range(feature.size)
    ]
    low, high = np.array(rows, dtype=np.float32).T
    return np.ascontiguousarray(low), np.ascontiguousarray(high)


def observation_columns(
    group_name: str, feature_name: str, blocks: Sequence[Group] = OBSERVATION
) -> NDArray[np.int64]:
    """Where a feature is in an observation.

    Args:
        group_name: Name of a block.
        feature_name: As in that block.
        blocks: What the observation is made of.

    Returns:
        (repeats, size) indices.

    Raises:
        ValueError: There is no such feature.
    """
    start = 0
    for group in blocks:
        width = group.width
        for feature in group.features:
            if group.name == group_name and feature.name == feature_name:
                rows = start + width * np.arange(group.repeats)
                return rows[:, None] + np.arange(feature.size)
            start += feature.size
        start += width * (group.repeats - 1)
    known = ", ".join(f"{g.name}.{f.name}" for g in blocks for f in g.features)
    raise ValueError(f"there is no feature {group_name}.{feature_name}; there are {known}")


def layout_table(blocks: Sequence[Group] = OBSERVATION) -> str:
    """An observation as a Markdown table, one row per feature, with ranges of indices."""
    lines = ["| index | feature | min | max | meaning |", "|---|---|---|---|---|"]
    start = 0
    for group in blocks:
        width = group.width
        for feature in group.features:
            index = str(start) if feature.size == 1 else f"{start}-{start + feature.size - 1}"
            if group.repeats > 1:
                index += f" + {width} k, k < {group.repeats}"
            bounds = f"{feature.low:g} | {feature.high:g}"
            lines.append(
                f"| {index} | {group.name}.{feature.name} | {bounds} | {feature.meaning} |"
            )
            start += feature.size
        start += width * (group.repeats - 1)
    return "\n".join(lines)
