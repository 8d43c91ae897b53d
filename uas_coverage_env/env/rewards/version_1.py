"""The terms of the reward of `uas_coverage_v1`: those of v0 at other weights, and what it adds.

The weights are such that returns are in the order of what is flown: hovering below landing at once,
that below planners that cover and come home, and those by how well they do (tests/tasks).
"""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from uas_coverage_env.env.rewards.landing import home_in_the_end, left_open
from uas_coverage_env.env.rewards.potentials import to_home, to_waypoint
from uas_coverage_env.env.rewards.term import RewardTerm
from uas_coverage_env.env.rewards.terms import REWARD

_LATER = "; and of what it covers, the share for each UAS that is home by then"

_OTHERWISE: Mapping[str, Mapping[str, Any]] = {
    "energy": {"weight": 0.1},
    "home": {
        "weight": 10.0,
        "meaning": "when it lands, the share of the waypoints' weight covered by then" + _LATER,
        "value": home_in_the_end,
    },
    "stranded": {"weight": 10.0},
}

REWARD_V1 = (
    *(replace(term, **_OTHERWISE.get(term.name, {})) for term in REWARD),
    RewardTerm(
        "left_open",
        6.0,
        "when it lands, minus the share that is open and to which a UAS could have flown from its "
        "start and back, with the charge at its start" + _LATER,
        left_open,
    ),
    to_waypoint(),
    to_home(),
)
"""The default terms of v1, in their order; the potentials are off."""
