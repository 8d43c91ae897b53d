"""UAS coverage, version 0: several UAS cover an area and come home on their batteries.

Version history: v0, first version.
"""

from uas_coverage_env.env import CoverageParallelEnv, env, raw_env

parallel_env = CoverageParallelEnv

__all__ = ["env", "parallel_env", "raw_env"]
