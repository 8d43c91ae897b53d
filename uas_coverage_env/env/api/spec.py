"""What Gymnasium remembers of how an environment was made, such that it can be written as JSON."""

from collections.abc import Sequence
from copy import copy
from enum import Enum
from pathlib import Path
from typing import Any

from gymnasium.envs.registration import EnvSpec

from uas_coverage_env.scenario import Scenario


def plain_spec(spec: EnvSpec | None, max_steps: int | None) -> EnvSpec | None:
    """A spec with plain data in place of scenarios, paths and codes.

    Args:
        spec: As Gymnasium sets it.
        max_steps: The time limit of all missions; None where they have different ones.
    """
    if spec is None:
        return None
    plain = copy(spec)
    plain.kwargs = {name: _plain(value) for name, value in spec.kwargs.items()}
    if plain.max_episode_steps is None:
        plain.max_episode_steps = max_steps
    return plain


def _plain(value: Any) -> Any:
    if isinstance(value, Scenario):
        return value.model_dump(mode="json", by_alias=True)
    if isinstance(value, Path):
        return str(value)
    if isinstance(value, Enum):
        return value.value
    if isinstance(value, Sequence) and not isinstance(value, str):
        return [_plain(item) for item in value]
    return value
