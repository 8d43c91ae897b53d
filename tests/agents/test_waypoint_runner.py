"""The waypoint policy in flight: the same decisions as in training, and what simulation adds."""

from types import SimpleNamespace

import numpy as np
import pytest
from uas_coverage_agents.policy.pointer import Pointer
from uas_coverage_agents.waypoint.layout import OBSERVATION_SIZE, K
from uas_coverage_agents.waypoint.policy_runner import WaypointRunner, network, observation
from uas_coverage_agents.waypoint.scorer import scorer_weights, write_scores
from uas_coverage_agents.waypoint.sub_environments import (
    begin_lanes,
    make_lanes,
    pool_legs,
    step_lanes,
)
from uas_coverage_agents.waypoint.team import ENERGY, LEFT, NO_UAS, TIME
from waypoint_missions import PRIOR, tensors, town, with_something_parked

from uas_coverage_env import rollout
from uas_coverage_env.autopilot.assist import assistants
from uas_coverage_env.flight import Assistants
from uas_coverage_env.flight.metrics import coverage, energy_Wh, home
from uas_coverage_env.simulation.pool import pool_worlds

BOTH = Assistants(return_mode=True, safety_filter=True)


def policy_of(weights, hidden=16):
    described = SimpleNamespace(observation=observation(), network=network(hidden, PRIOR))
    return SimpleNamespace(description=described, tensors=weights)


def flown(scenario, weights, simulations=0, seed=0):
    runner = WaypointRunner(policy_of(weights), BOTH, simulations)
    return rollout(scenario, runner, seed, return_mode=True, safety_filter=True)


def in_training(scenario, weights):
    """The account of the mission, flown by the task with the NumPy network."""
    arenas, legs = pool_worlds([scenario]), pool_legs([scenario])
    lanes, states = make_lanes(1, arenas)
    begin_lanes(
        arenas, legs, lanes, states, np.array([0]), np.array([0]),
        np.zeros(states.uncovered.shape, dtype=bool), np.zeros(states.uas.shape),
        True, assistants(True, True),
    )  # fmt: skip
    while lanes.decider[0] != NO_UAS:
        scores = network(16, PRIOR).forward(weights, lanes.observation)
        choices = np.where(lanes.legal, scores, -np.inf).argmax(axis=1)
        step_lanes(arenas, legs, lanes, states, choices, True, assistants(True, True))
    return lanes.account[0]


@pytest.mark.parametrize("weights", [None, 1])
@pytest.mark.parametrize("n_uas", [1, 3])
def test_a_flight_decides_as_the_training_does(weights, n_uas):
    scenario = town(7, n_uas=n_uas, n_waypoints=12)
    for mission in (scenario, with_something_parked(scenario, waypoint=5, leaves_s=50.0)):
        flight = flown(mission, tensors(seed=weights))
        account = in_training(mission, tensors(seed=weights))
        assert flight.steps == account[TIME]
        assert energy_Wh(flight).sum() == pytest.approx(account[ENERGY], rel=1e-12)
        assert (1 - coverage(flight)) * 12 == pytest.approx(account[LEFT])


def test_the_compiled_network_is_the_network_of_the_policy_file():
    rng = np.random.default_rng(3)
    pointer, weights = network(16, PRIOR), tensors(seed=4)
    row = rng.normal(size=OBSERVATION_SIZE).astype(np.float32)
    each = row[pointer.team :].reshape(K, -1)
    each[:, 0] = 1.0
    each[7:] = 0.0
    scores = np.empty(K + 1)
    write_scores(scorer_weights(pointer, weights), row, scores)
    expected = pointer.forward(weights, row)
    assert scores[:7] == pytest.approx(expected[:7], rel=1e-9)
    assert (scores[7:K] == -np.inf).all()
    assert scores[K] == pytest.approx(expected[K], rel=1e-9)


def test_before_training_the_nearest_candidate_wins():
    weights = tensors()
    rng = np.random.default_rng(5)
    rows = rng.normal(size=(20, OBSERVATION_SIZE))
    each = rows[:, network(16, PRIOR).team :].reshape(20, K, -1)
    each[..., 0] = 1.0
    each[..., 1] = np.sort(rng.uniform(0.0, 3.0, (20, K)), axis=1)
    scores = network(16, PRIOR).forward(weights, rows)
    assert (scores.argmax(axis=1) == 0).all()


def test_scores_follow_the_candidates_when_these_change_places():
    pointer, weights = network(16, 0.0), tensors(seed=6)
    row = np.random.default_rng(6).uniform(0.0, 1.0, OBSERVATION_SIZE)
    each = row[pointer.team :].reshape(K, -1)
    each[:, 0] = 1.0
    before = pointer.forward(weights, row)
    order = np.random.default_rng(7).permutation(K)
    each[:] = each[order]
    after = pointer.forward(weights, row)
    assert after[:K] == pytest.approx(before[order], rel=1e-9)
    assert after[K] == pytest.approx(before[K], rel=1e-9)


def test_simulated_missions_make_a_flight_cheaper_and_the_same_seed_makes_the_same_flight():
    scenario = town(11, n_uas=2, n_waypoints=14)
    alone = flown(scenario, tensors())
    tried = flown(scenario, tensors(), simulations=12)
    again = flown(scenario, tensors(), simulations=12)
    assert coverage(tried) == 1.0
    assert home(tried).all()
    assert not tried.violations
    assert _price(tried) < _price(alone)
    assert np.array_equal(tried.x, again.x)


def _price(flight):
    return energy_Wh(flight).sum() + 0.1 * flight.steps


def test_a_runner_needs_no_knowledge_of_what_moving_obstacles_will_do():
    """Two obstacles that differ only in the future are flown the same until they differ."""
    scenario = town(12, n_uas=2, n_waypoints=12)
    early = flown(with_something_parked(scenario, 3, leaves_s=40.0), tensors(), simulations=3)
    late = flown(with_something_parked(scenario, 3, leaves_s=400.0), tensors(), simulations=3)
    same = 40
    assert np.array_equal(early.x[:same], late.x[:same])


def test_a_policy_of_another_layout_is_refused():
    policy = policy_of(tensors())
    policy.description.observation = observation().model_copy(update={"layout": "waypoint_v0"})
    with pytest.raises(ValueError, match="train it anew"):
        WaypointRunner(policy, BOTH)
    policy = policy_of(tensors())
    policy.description.network = network(16, PRIOR).model_copy(update={"way": 2})
    with pytest.raises(ValueError, match="train it anew"):
        WaypointRunner(policy, BOTH)


def test_a_pointer_whose_sizes_contradict_each_other_is_refused():
    data = network(16, PRIOR).model_dump()
    with pytest.raises(ValueError, match="inputs is 5"):
        Pointer.model_validate({**data, "inputs": 5})
    with pytest.raises(ValueError, match="outputs is 3"):
        Pointer.model_validate({**data, "outputs": 3})
    with pytest.raises(ValueError, match="way is 99"):
        Pointer.model_validate({**data, "way": 99})
