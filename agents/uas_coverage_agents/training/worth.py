"""What a policy in training is worth on unseen missions, which fly side by side."""

from types import SimpleNamespace

import numpy as np

from uas_coverage_agents.policy.description import Training
from uas_coverage_agents.policy.environment import action_of, keywords_of
from uas_coverage_agents.training.learner import Learned
from uas_coverage_agents.training.missions import Missions
from uas_coverage_env.tasks.in_batch import flown_in_batches
from uas_coverage_env.tasks.scoring import mission_value


def worth_of(learned: Learned, missions: Missions, count: int) -> float:
    """The mean value of validation missions, see `uas_coverage_env.tasks.scoring`.

    Args:
        learned: What flies.
        missions: Where it learns.
        count: How many are flown, or all that there are.
    """
    training = Training(
        algorithm="validated", settings={}, seed=0, steps=0, process_s=0.0, wall_s=0.0, machine=""
    )
    policy = learned.policy(missions.family, training)
    unseen = missions.validation(count)
    found = flown_in_batches(action_of(policy), unseen, keywords_of(policy), len(unseen), None)
    return float(np.mean([mission_value(SimpleNamespace(**figures)) for _, figures in found]))
