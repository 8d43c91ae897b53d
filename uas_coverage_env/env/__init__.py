"""What a learner sees: environments for PettingZoo and Gymnasium on one world.

Their versions are modules of their own, such as `uas_coverage_env.uas_coverage_v0`.
"""

from uas_coverage_env.env.actions import ACTIONS, HOME_CHOICE, ActionKind
from uas_coverage_env.env.api.parallel import CoverageParallelEnv
from uas_coverage_env.env.api.single import CoverageSwarmEnv
from uas_coverage_env.env.api.vector import CoverageVectorEnv
from uas_coverage_env.env.batch.batch import CoverageBatch
from uas_coverage_env.env.episode.settings import MissionSettings
from uas_coverage_env.env.observation import (
    K_WAYPOINTS,
    OBSERVATION,
    OBSERVATION_SIZE,
    Feature,
    ObservationBlock,
    full_state,
    full_state_of,
    grid,
    local,
    observation_columns,
)
from uas_coverage_env.env.policy.interface import MissionInterface
from uas_coverage_env.env.rewards import REWARD, RewardTerm
from uas_coverage_env.env.versions import Version

__all__ = [
    "ACTIONS",
    "HOME_CHOICE",
    "K_WAYPOINTS",
    "OBSERVATION",
    "OBSERVATION_SIZE",
    "REWARD",
    "ActionKind",
    "CoverageBatch",
    "CoverageParallelEnv",
    "CoverageSwarmEnv",
    "CoverageVectorEnv",
    "Feature",
    "MissionInterface",
    "MissionSettings",
    "ObservationBlock",
    "RewardTerm",
    "Version",
    "full_state",
    "full_state_of",
    "grid",
    "local",
    "observation_columns",
]
