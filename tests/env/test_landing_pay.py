"""What landing is worth in `uas_coverage_v1`: how the mission ends, not who lands first."""

import numpy as np
import pytest
from practice_grounds import practice_ground

from uas_coverage_env import GoTo, rollout
from uas_coverage_env.env.rewards.version_1 import REWARD_V1

NAMES = [term.name for term in REWARD_V1]
WEIGHT = {term.name: term.weight for term in REWARD_V1}
FIELD = practice_ground(weights=[1.0, 2.0, 1.0], max_steps=200)


class InTurn:
    """`uas_1` lands at once; `uas_2` visits waypoints one by one, then lands."""

    goes_to = True

    def __init__(self, visits, lands_first=True):
        self.visits, self.lands_first = list(visits), lands_first

    def reset(self, brief, seed):
        self.left = list(self.visits)

    def act(self, swarm):
        while self.left and not swarm.uncovered[self.left[0]]:
            self.left.pop(0)
        to = GoTo(self.left[0]) if self.left else GoTo(None, mode="return")
        waits = GoTo(None, mode="return") if self.lands_first or not self.left else GoTo(0)
        return {name: waits if name == "uas_1" else to for name in swarm.active}


def paid(planner, scenario=FIELD):
    """Term -> (steps, UAS)."""
    flight = rollout(scenario, planner, reward=REWARD_V1, return_mode=False)
    assert flight.ended == "complete"
    assert flight.reward_terms is not None
    return {name: flight.reward_terms[..., k] for k, name in enumerate(NAMES)}


def test_who_lands_at_once_pays_for_all_that_is_open_and_is_paid_nothing():
    terms = paid(InTurn([]))
    assert np.allclose(terms["left_open"].sum(axis=0), -WEIGHT["left_open"])
    assert not terms["home"].any()


def test_what_is_covered_after_a_landing_is_paid_to_who_covers_it_once_more():
    terms = paid(InTurn([1, 0]))
    home, left = terms["home"].sum(axis=0), terms["left_open"].sum(axis=0)
    assert home == pytest.approx([0.0, 2 * 0.75 * WEIGHT["home"]])
    assert left == pytest.approx([-WEIGHT["left_open"], (0.75 - 0.25) * WEIGHT["left_open"]])
    # of what the swarm has covered in the end, for each UAS that is home
    assert home.sum() == pytest.approx(2 * 0.75 * WEIGHT["home"])
    assert left.sum() == pytest.approx(-2 * 0.25 * WEIGHT["left_open"])


def test_the_sum_of_the_swarm_is_the_same_in_whatever_order_it_comes_home():
    early, late = paid(InTurn([1, 0])), paid(InTurn([1, 0], lands_first=False))
    for term in ("home", "left_open"):
        assert early[term].sum() == pytest.approx(late[term].sum())
    assert late["left_open"].sum(axis=0)[0] > early["left_open"].sum(axis=0)[0]


def test_what_no_charge_reaches_is_not_left_open():
    far = ((60.0, 100.0, -10.0), (190.0, 190.0, -10.0), (10.0, 190.0, -10.0))
    terms = paid(InTurn([]), practice_ground(waypoints_m=far, soc_0=0.26))
    assert terms["left_open"].sum(axis=0) == pytest.approx(-WEIGHT["left_open"] / 3)
