"""The terms of the reward of `uas_coverage_v1`: those of v0 at other weights, and what it adds.

The weights are such that returns are in the order of what is flown: hovering below landing at once,
that below planners that cover and come home, and those by how well they do (tests/tasks).
"""

from dataclasses import replace

from uas_coverage_env.env.rewards.left_open import left_open
from uas_coverage_env.env.rewards.potentials import to_home, to_waypoint
from uas_coverage_env.env.rewards.term import RewardTerm
from uas_coverage_env.env.rewards.terms import REWARD

_WEIGHTS = {"energy": 0.1, "home": 10.0, "stranded": 10.0}

REWARD_V1 = (
    *(replace(term, weight=_WEIGHTS.get(term.name, term.weight)) for term in REWARD),
    RewardTerm(
        "left_open",
        6.0,
        "when it lands, minus the share of the waypoints' weight that is open then and that it "
        "could have flown to from its start and back with the charge it started with",
        left_open,
    ),
    to_waypoint(),
    to_home(),
)
"""The default terms of v1, in their order; the potentials are off."""
