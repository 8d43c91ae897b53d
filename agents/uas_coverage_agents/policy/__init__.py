"""Policies as files: read without executing anything, run in NumPy."""

from uas_coverage_agents.policy.description import (
    Interval,
    Observation,
    PolicyDescription,
    ScenarioFamily,
    Score,
    Towns,
    Training,
)
from uas_coverage_agents.policy.directory import Policy, load_policy, save_policy
from uas_coverage_agents.policy.networks import Mlp, Network
from uas_coverage_agents.policy.tensors import Tensors

__all__ = [
    "Interval",
    "Mlp",
    "Network",
    "Observation",
    "Policy",
    "PolicyDescription",
    "ScenarioFamily",
    "Score",
    "Tensors",
    "Towns",
    "Training",
    "load_policy",
    "save_policy",
]
