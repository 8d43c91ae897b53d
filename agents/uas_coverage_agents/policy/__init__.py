"""Policies as files: read without executing anything, run in NumPy."""

from uas_coverage_agents.policy.description import PolicyDescription
from uas_coverage_agents.policy.directory import Policy, load_policy, save_policy

__all__ = ["Policy", "PolicyDescription", "load_policy", "save_policy"]
