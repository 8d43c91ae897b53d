"""UAS coverage, version 0: several UAS cover an area and come home on their batteries.

Version history: v0, first version.
"""

from uas_coverage_env.env.api.aec import env, raw_env
from uas_coverage_env.env.api.many import vector_env
from uas_coverage_env.env.api.parallel import CoverageParallelEnv
from uas_coverage_env.env.api.single import CoverageSwarmEnv
from uas_coverage_env.env.versions import V0

VERSION = V0
parallel_env = CoverageParallelEnv
swarm_env = CoverageSwarmEnv

__all__ = ["env", "parallel_env", "raw_env", "swarm_env", "vector_env"]
