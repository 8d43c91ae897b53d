"""What a learner is paid for: named terms, each with a weight."""

from uas_coverage_env.env.rewards.potentials import to_home, to_waypoint
from uas_coverage_env.env.rewards.term import RewardTerm
from uas_coverage_env.env.rewards.terms import REWARD

__all__ = ["REWARD", "RewardTerm", "to_home", "to_waypoint"]
