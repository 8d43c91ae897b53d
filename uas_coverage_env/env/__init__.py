"""What a learner sees: environments for PettingZoo and Gymnasium on one world."""

from uas_coverage_env.env.actions import ACTION_NAMES, ACTIONS, HOME_CHOICE, ActionKind
from uas_coverage_env.env.api.aec import env, raw_env
from uas_coverage_env.env.api.parallel import CoverageParallelEnv
from uas_coverage_env.env.api.single import CoverageSwarmEnv
from uas_coverage_env.env.api.vector import CoverageVectorEnv
from uas_coverage_env.env.batch.batch import CoverageBatch
from uas_coverage_env.env.batch.pool import ScenarioPool
from uas_coverage_env.env.episode.settings import MissionSettings
from uas_coverage_env.env.observation import (
    K_WAYPOINTS,
    OBSERVATION,
    OBSERVATION_SIZE,
    OBSERVATIONS,
    Feature,
    ObservationBlock,
    full_state,
    full_state_of,
    grid,
    layout_table,
    local,
    observation_bounds,
    observation_columns,
)
from uas_coverage_env.env.policy.interface import MissionInterface
from uas_coverage_env.env.rewards import REWARD, REWARD_TERMS, RewardTerm, rewards_table
from uas_coverage_env.registration import GYMNASIUM_ID, PETTINGZOO_ID, register_environments

__all__ = [
    "ACTIONS",
    "ACTION_NAMES",
    "GYMNASIUM_ID",
    "HOME_CHOICE",
    "K_WAYPOINTS",
    "OBSERVATION",
    "OBSERVATIONS",
    "OBSERVATION_SIZE",
    "PETTINGZOO_ID",
    "REWARD",
    "REWARD_TERMS",
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
    "ScenarioPool",
    "env",
    "full_state",
    "full_state_of",
    "grid",
    "layout_table",
    "local",
    "observation_bounds",
    "observation_columns",
    "raw_env",
    "register_environments",
    "rewards_table",
]
