"""Which learner trains policies of which interface."""

from uas_coverage_agents.training.config import TrainingConfig
from uas_coverage_agents.training.learner import Learner


def learner_of(config: TrainingConfig) -> Learner:
    """The learner for this configuration; only what it needs is imported."""
    if config.policy.interface == "waypoint":
        from uas_coverage_agents.training.waypoint import WaypointLearner

        return WaypointLearner()
    from uas_coverage_agents.training.velocity import VelocityLearner

    return VelocityLearner()
