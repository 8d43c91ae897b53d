"""UAS coverage, version 1: the missions and physics of version 0, and an environment to learn in.

Version history: v1, ways past obstacles are observed, and what is left open has a price
(docs/versions.md).
"""

from typing import Any

from uas_coverage_env.env.api import aec, many
from uas_coverage_env.env.api.parallel import CoverageParallelEnv
from uas_coverage_env.env.api.single import CoverageSwarmEnv
from uas_coverage_env.env.api.vector import CoverageVectorEnv
from uas_coverage_env.env.episode.settings import described_as
from uas_coverage_env.env.versions import V1

VERSION = V1


class CoverageParallelEnvV1(CoverageParallelEnv):
    version = V1


class CoverageSwarmEnvV1(CoverageSwarmEnv):
    version = V1


class CoverageVectorEnvV1(CoverageVectorEnv):
    version = V1


parallel_env = CoverageParallelEnvV1
swarm_env = CoverageSwarmEnvV1


@described_as(aec.raw_env)
def raw_env(*scenario: Any, **settings: Any) -> Any:
    return aec.in_turns(parallel_env(*scenario, **settings))


@described_as(aec.env)
def env(*scenario: Any, **settings: Any) -> Any:
    return aec.ChecksAtOnce(raw_env(*scenario, **settings))


@described_as(many.vector_env)
def vector_env(*missions: Any, **settings: Any) -> Any:
    return many.many_of(CoverageVectorEnvV1, *missions, **settings)


__all__ = ["env", "parallel_env", "raw_env", "swarm_env", "vector_env"]
