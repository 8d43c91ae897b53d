"""The environments of a level."""

from typing import Any

from uas_coverage_env.env import CoverageParallelEnv, CoverageSwarmEnv, CoverageVectorEnv
from uas_coverage_env.tasks.levels import level_named


def swarm_env(level: str, *, split: str = "training", **chosen: Any) -> CoverageSwarmEnv:
    """One agent for the whole swarm (Gymnasium).

    Args:
        level: Its name.
        split: Which seeds missions are drawn from: training, validation or test.
        **chosen: See `Task.settings`.

    Raises:
        ValueError: There is no such level or split, or a setting is the level's affair.
    """
    task = level_named(level)
    return CoverageSwarmEnv(task.missions(split), **task.settings(**chosen))


def vector_env(
    level: str, num_envs: int = 1, *, split: str = "training", **given: Any
) -> CoverageVectorEnv:
    """Many missions at once (Gymnasium); arguments as for `swarm_env` and `CoverageVectorEnv`."""
    task = level_named(level)
    own = ("autoreset_mode", "threads", "copy")
    batch = {name: given.pop(name) for name in own if name in given}
    given.pop("max_episode_steps", None)
    return CoverageVectorEnv(num_envs, task.missions(split), **batch, **task.settings(**given))


def parallel_env(level: str, *, split: str = "training", **chosen: Any) -> CoverageParallelEnv:
    """One agent per UAS (PettingZoo); arguments as for `swarm_env`."""
    task = level_named(level)
    return CoverageParallelEnv(task.missions(split), **task.settings(**chosen))
