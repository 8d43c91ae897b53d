"""Many single-agent environments in one object (Gymnasium)."""

from typing import Any

from gymnasium.vector import SyncVectorEnv

from uas_coverage_env.env.single import CoverageSwarmEnv


def vector_env(num_envs: int = 1, **settings: Any) -> SyncVectorEnv:
    """Copies of `CoverageSwarmEnv`, stepped one after the other.

    A version that steps all copies in one compiled loop will take its place; spaces, order and
    results stay.

    Args:
        num_envs: How many.
        **settings: See `CoverageSwarmEnv`.

    Raises:
        ValueError: There would be none.
    """
    whole = isinstance(num_envs, int) and not isinstance(num_envs, bool)
    if not whole or num_envs < 1:
        raise ValueError(f"num_envs is {num_envs!r}; give a whole number from 1 on")
    return SyncVectorEnv([lambda: CoverageSwarmEnv(**settings)] * num_envs)
