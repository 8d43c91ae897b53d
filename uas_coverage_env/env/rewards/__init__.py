"""What a learner is paid for: named terms, each with a weight."""

from uas_coverage_env.env.rewards.term import RewardTerm, weights_of
from uas_coverage_env.env.rewards.terms import REWARD, REWARD_TERMS, rewards_table

__all__ = [
    "REWARD",
    "REWARD_TERMS",
    "RewardTerm",
    "rewards_table",
    "weights_of",
]
