"""The environments of a level."""

from importlib import import_module
from typing import Any

from uas_coverage_env.env import CoverageParallelEnv, CoverageSwarmEnv, CoverageVectorEnv
from uas_coverage_env.tasks.levels import level_named
from uas_coverage_env.tasks.task import Task


def swarm_env(level: str, *, split: str = "training", **chosen: Any) -> CoverageSwarmEnv:
    """One agent for the whole swarm (Gymnasium).

    Args:
        level: Its name, with the version of the environments: `hard`, or `hard-v1`.
        split: Which seeds missions are drawn from: training, validation or test.
        **chosen: See `Task.settings`.

    Raises:
        ValueError: There is no such level or split, or a setting is the level's affair.
    """
    task = level_named(level)
    return _module_of(task).swarm_env(task.missions(split), **_settings(task, chosen))


def vector_env(
    level: str, num_envs: int = 1, *, split: str = "training", **given: Any
) -> CoverageVectorEnv:
    """Many missions at once (Gymnasium); arguments as for `swarm_env` and `CoverageVectorEnv`."""
    task = level_named(level)
    own = ("autoreset_mode", "threads", "copy")
    batch = {name: given.pop(name) for name in own if name in given}
    given.pop("max_episode_steps", None)
    made = _module_of(task).vector_env
    return made(num_envs, task.missions(split), **batch, **_settings(task, given))


def parallel_env(level: str, *, split: str = "training", **chosen: Any) -> CoverageParallelEnv:
    """One agent per UAS (PettingZoo); arguments as for `swarm_env`."""
    task = level_named(level)
    return _module_of(task).parallel_env(task.missions(split), **_settings(task, chosen))


def _module_of(task: Task) -> Any:
    return import_module(f"uas_coverage_env.uas_coverage_{task.version.name}")


def _settings(task: Task, chosen: dict[str, Any]) -> dict[str, Any]:
    """Those of the level; the environments of a module have its version."""
    return {k: v for k, v in task.settings(**chosen).items() if k != "version"}
