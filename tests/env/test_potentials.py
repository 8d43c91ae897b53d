"""Potentials as terms of the reward: their sum is fixed by the start, whatever is flown."""

import numpy as np
import pytest
from practice_grounds import practice_ground

from uas_coverage_env import load_planner, rollout
from uas_coverage_env.entities.state import FLYING, LANDED, LOST
from uas_coverage_env.env import CoverageBatch
from uas_coverage_env.env.report import FIRST_TERM, STATUS
from uas_coverage_env.env.rewards import to_home, to_waypoint
from uas_coverage_env.env.rewards.version_1 import REWARD_V1

LANES = 12
FIELD = practice_ground(max_steps=80)
WEIGHTS = {"to_waypoint": 2.0, "to_home": 3.0}
NO_CHARGE = practice_ground(soc_0=0.26)  # dod_max is 0.75: not enough to visit anything


def reward_with(**chosen):
    """The terms of v1 with other potentials."""
    others = [term for term in REWARD_V1 if not term.name.startswith("to_")]
    return (*others, to_waypoint(2.0, **chosen), to_home(3.0, **chosen))


def flown(scenario=FIELD, reward=REWARD_V1, weights=WEIGHTS, discount=1.0, scale=1.0):
    """Sums of both potentials (L, U, 2) over whole missions, and how each UAS ended.

    Lanes fly random waypoints, the velocities of some that crash, and some that do nothing.
    """
    batch = CoverageBatch(
        LANES, scenario, autoreset="rest", version="v1", reward=reward, reward_weights=weights
    )
    batch.reset(0)
    rng = np.random.default_rng(5)
    sums, factor = np.zeros((LANES, batch.n_uas, 2)), 1.0
    towards = rng.uniform(-1.0, 1.0, (LANES, batch.n_uas, 3)) * scale
    towards[:3] = [0.0, 0.0, -1.0]  # lands where it stands
    towards[3:6] = 0.0
    while not (batch.lanes.terminated | batch.lanes.truncated).all():
        batch.step(np.clip(towards + rng.normal(0.0, 0.05 * scale, towards.shape), -1.0, 1.0))
        sums += factor * batch.learners.amounts[..., -2:]
        factor *= discount
    assert batch.learners.amounts.shape[2] == FIRST_TERM + len(reward)
    return sums, batch.learners.report[..., STATUS]


def test_the_sum_over_an_episode_is_the_same_whatever_is_flown():
    sums, status = flown()
    assert {LANDED, LOST, FLYING} <= set(status.ravel().tolist())
    assert sums[0, 0, 0] == pytest.approx(2.0 * 30.0 / 100.0)
    assert np.ptp(sums, axis=0).max() < 1e-12


def test_with_charge_for_nothing_the_potential_is_that_of_home_and_its_sum_is_fixed_too():
    sums, status = flown(NO_CHARGE)
    assert LOST in status
    assert not sums[..., 0].any()
    assert np.ptp(sums, axis=0).max() < 1e-12


@pytest.mark.parametrize("scenario", [FIELD, NO_CHARGE])
def test_discounted_as_the_learner_does_the_discounted_sum_is_fixed(scenario):
    discounted = reward_with(discount=0.97)
    sums, _ = flown(scenario, discounted, None, discount=0.97)
    plain, _ = flown(scenario)
    assert np.ptp(sums, axis=0).max() < 1e-12
    assert np.allclose(sums, plain, atol=1e-12)


def test_without_the_refund_a_loss_has_a_price_and_nothing_else_has():
    sums, status = flown(reward=reward_with(refunds_losses=False), weights=None)
    refunded, _ = flown()
    lost = status == LOST
    assert np.allclose(sums[~lost], refunded[~lost], atol=1e-12)
    total, before = sums.sum(axis=2)[lost], refunded.sum(axis=2)[lost]
    assert (total <= before + 1e-12).all()
    assert (total < before - 0.1).any()


def test_a_step_towards_the_nearest_waypoint_is_paid_by_the_metre():
    field = practice_ground(n_uas=1, waypoints_m=((180.0, 100.0, -10.0), (10.0, 100.0, -10.0)))
    batch = CoverageBatch(1, field, version="v1", reward_weights={"to_waypoint": 1.0})
    batch.reset(0)
    north_m = []
    for _ in range(4):
        batch.step(np.array([[[0.5, 0.0, 0.0]]]))
        north_m.append(float(batch.missions.worlds.x[0, 0, 0]))
        paid = batch.learners.amounts[0, 0, -2]
    assert north_m[-1] > north_m[-2] > 100.0
    assert paid == pytest.approx((north_m[-1] - north_m[-2]) / 100.0)


def test_off_they_pay_nothing_and_take_no_time():
    sums, _ = flown(weights=None)
    assert not sums.any()
    batch = CoverageBatch(1, FIELD, version="v1")
    batch.reset(0)
    batch.step(np.zeros((1, 2, 3)))
    assert not batch.learners.potentials.any()


def test_a_planners_flight_is_paid_by_the_same_terms():
    sums, _ = flown()
    planner = load_planner("nearest-waypoint")
    flight = rollout(FIELD, planner, reward=REWARD_V1, reward_weights=WEIGHTS)
    assert flight.reward_terms is not None
    paid = flight.reward_terms[..., -2:].sum(axis=0)
    assert np.allclose(paid, sums[0], atol=1e-12)


def test_a_discount_above_one_is_refused():
    with pytest.raises(ValueError, match=r"discount is 1.1; give a number above 0"):
        to_waypoint(1.0, discount=1.1)
