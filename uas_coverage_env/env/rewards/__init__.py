"""What a learner is paid for: named terms, each with a weight."""

from uas_coverage_env.env.rewards.potentials import to_home, to_waypoint
from uas_coverage_env.env.rewards.term import RewardTerm
from uas_coverage_env.env.rewards.terms import REWARD
from uas_coverage_env.env.rewards.version_1 import REWARD_V1

__all__ = ["REWARD", "REWARD_V1", "RewardTerm", "to_home", "to_waypoint"]
