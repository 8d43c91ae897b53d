"""UAS coverage, version 0: several UAS cover an area and come home on their batteries.

Version history: v0, first version.
"""

from uas_coverage_env.env.api.aec import env, raw_env
from uas_coverage_env.env.api.parallel import CoverageParallelEnv
from uas_coverage_env.env.api.vector import vector_env

parallel_env = CoverageParallelEnv

__all__ = ["env", "parallel_env", "raw_env", "vector_env"]
