"""UAS coverage, version 1: the missions and physics of version 0, and an environment to learn in.

Version history: v1, ways past obstacles are observed, and what is left open has a price
(docs/versions.md).
"""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, Unpack

from gymnasium.vector import AutoresetMode
from numpy.typing import NDArray
from pettingzoo import AECEnv

from uas_coverage_env.env.api.aec import ChecksAtOnce, in_turns
from uas_coverage_env.env.api.many import many_of
from uas_coverage_env.env.api.parallel import CoverageParallelEnv
from uas_coverage_env.env.api.single import CoverageSwarmEnv
from uas_coverage_env.env.api.vector import CoverageVectorEnv
from uas_coverage_env.env.episode.settings import MissionKeywords, takes_settings
from uas_coverage_env.env.versions import V1
from uas_coverage_env.scenario import Scenario
from uas_coverage_env.scenario.source import ScenarioLike

if TYPE_CHECKING:
    from uas_coverage_env.env.gpu.missions import CudaMissions

VERSION = V1


class CoverageParallelEnvV1(CoverageParallelEnv):
    version = V1


class CoverageSwarmEnvV1(CoverageSwarmEnv):
    version = V1


class CoverageVectorEnvV1(CoverageVectorEnv):
    version = V1


parallel_env = CoverageParallelEnvV1
swarm_env = CoverageSwarmEnvV1


@takes_settings
def raw_env(
    scenario: ScenarioLike = "village",
    *,
    render_mode: str | None = None,
    **settings: Unpack[MissionKeywords],
) -> AECEnv[str, NDArray[Any], Any]:
    """The environment in turns, without checks of its own; arguments as of `uas_coverage_v0`."""
    return in_turns(parallel_env(scenario, render_mode=render_mode, **settings))


@takes_settings
def env(
    scenario: ScenarioLike = "village",
    *,
    render_mode: str | None = None,
    **settings: Unpack[MissionKeywords],
) -> ChecksAtOnce:
    """The environment in turns; arguments as of `uas_coverage_v0.env`."""
    return ChecksAtOnce(raw_env(scenario, render_mode=render_mode, **settings))


@takes_settings
def vector_env(
    num_envs: int = 1,
    scenario: ScenarioLike | Sequence[str | Path | Scenario] = "village",
    *,
    autoreset_mode: str | AutoresetMode = AutoresetMode.NEXT_STEP,
    threads: int = 1,
    copy: bool = True,
    render_mode: str | None = None,
    device: Literal["cpu", "cuda"] = "cpu",
    **settings: Unpack[MissionKeywords],
) -> "CoverageVectorEnv | CudaMissions":
    """Many missions at once; arguments as of `uas_coverage_v0.vector_env`."""
    given: dict[str, Any] = {
        "autoreset_mode": autoreset_mode, "threads": threads, "render_mode": render_mode,
        "copy": copy, **settings,
    }  # fmt: skip
    return many_of(CoverageVectorEnvV1, num_envs, scenario, device, given)


__all__ = ["env", "parallel_env", "raw_env", "swarm_env", "vector_env"]
