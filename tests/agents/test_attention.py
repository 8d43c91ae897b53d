"""The attention network: what it looks at and does at first, and that torch and NumPy agree."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from uas_coverage_agents.policy.attention import Attention
from uas_coverage_agents.training.config import load_config
from uas_coverage_agents.training.training_run import TrainingJob, TrainingRun
from uas_coverage_agents.velocity.policy_runner import attention_network

from uas_coverage_env import InputError
from uas_coverage_env.env import observation_columns

TINY = str(Path(__file__).with_name("tiny.toml"))
CHANGES = ['policy.network="attention"', "policy.hidden=[8]", "policy.keys=4"]
SMALL = Attention(inputs=11, outputs=2, before=2, candidates=3, features=2, keys=4, hidden=5)


def tensors_of(network: Attention, seed: int = 0) -> dict[str, np.ndarray]:
    rng = np.random.default_rng(seed)
    return {name: rng.normal(size=shape) for name, shape in network.shapes().items()}


def views(n: int, seed: int = 0) -> np.ndarray:
    """(n, 11), every candidate there."""
    x = np.random.default_rng(seed).uniform(-1, 1, (n, SMALL.inputs))
    x[:, [2, 4, 6]] = 1.0
    return x


@pytest.fixture(scope="module")
def training_run() -> TrainingRun:
    return TrainingRun.untrained(TrainingJob("tiny", load_config(TINY, changes=CHANGES), seed=0))


@given(st.permutations(range(3)), st.integers(0, 99))
@settings(max_examples=30, deadline=None, derandomize=True)
def test_the_order_of_the_candidates_does_not_matter(order, seed):
    x = views(4, seed)
    shuffled = x.copy()
    shuffled[:, 2:8] = x[:, 2:8].reshape(4, 3, 2)[:, order].reshape(4, 6)
    t = tensors_of(SMALL, seed)
    assert np.allclose(SMALL.forward(t, x), SMALL.forward(t, shuffled), rtol=1e-9)


def test_the_network_is_found_under_its_former_name():
    described = SMALL.model_dump()
    assert described["kind"] == "attention"
    assert Attention(**{**described, "kind": "gaze"}) == SMALL


def test_a_candidate_that_is_not_there_is_not_looked_at():
    t = tensors_of(SMALL)
    x = views(4)
    x[:, 4] = 0.0
    changed = x.copy()
    changed[:, 5] = 7.0
    assert np.array_equal(SMALL.forward(t, x), SMALL.forward(t, changed))
    alone = x.copy()
    alone[:, [2, 6]] = 0.0
    changed = alone.copy()
    changed[:, [3, 5, 7]] = 7.0
    assert np.array_equal(SMALL.forward(t, alone), SMALL.forward(t, changed))
    assert np.isfinite(SMALL.forward(t, alone)).all()


def test_the_largest_weights_give_finite_outputs():
    t = {name: np.full(shape, 1e6) for name, shape in SMALL.shapes().items()}
    for x in (views(4), np.zeros((4, SMALL.inputs)), -2.0 * views(4)):
        assert np.isfinite(SMALL.forward(t, x)).all()


def test_sizes_that_do_not_fit_are_refused():
    with pytest.raises(ValueError, match="before \\+ candidates \\* features is 102"):
        Attention.model_validate(SMALL.model_dump() | {"before": 96})


def test_before_training_it_flies_to_the_nearest_open_waypoint(training_run):
    network, tensors = training_run.learner.export(training_run.model)
    assert network == attention_network(8, 4)
    x = np.zeros((1, network.inputs))
    there, closeness = (
        observation_columns("waypoints", name)[:, 0] for name in ("valid", "closeness")
    )
    north, east = observation_columns("waypoints", "direction").T
    x[0, there] = 1.0
    x[0, closeness] = np.linspace(0.9, 0.1, len(there))
    x[0, north[0]], x[0, east[0]] = 0.6, 0.8
    x[0, north[1:]] = -1.0
    outputs = network.forward({k: v.astype(np.float64) for k, v in tensors.items()}, x)
    assert np.allclose(outputs[0, :2], [0.54, 0.72], atol=0.1)


def test_what_is_exported_decides_as_the_model_does(training_run):
    seen = np.random.default_rng(0).uniform(
        -1, 1, (6, training_run.model.observation_space.shape[0])
    )
    expected, _ = training_run.model.predict(seen.astype(np.float32), deterministic=True)
    assert np.allclose(np.clip(training_run.policy().forward(seen), -1, 1), expected, atol=1e-5)


def test_it_learns_and_explores_less_and_less():
    changes = [*CHANGES, "policy.first_deviation=0.5", "learning.epochs=1"]
    fresh = TrainingRun.untrained(TrainingJob("tiny", load_config(TINY, changes=changes), seed=0))
    before = fresh.policy().tensors
    fresh.model.lr_schedule = lambda _: 0.25 * fresh.model.learning_rate
    fresh.model.learn(64)
    assert np.allclose(fresh.model.policy.get_parameter("log_std").detach(), np.log(0.125))
    after = fresh.policy().tensors
    assert all(not np.array_equal(before[name], after[name]) for name in before)


@pytest.mark.parametrize(
    ("name", "changes", "words"),
    [
        (TINY, ['policy.network="attention"', "policy.hidden=[8, 8]"], "'attention' has one width"),
        ("sac", ['policy.network="attention"', "policy.hidden=[8]"], "learned by ppo alone"),
        (TINY, ['policy.network="glance"'], "should be 'layers' or 'attention'"),
    ],
)
def test_a_network_that_cannot_be_learned_is_refused(name, changes, words):
    with pytest.raises(InputError, match=words):
        load_config(name, changes=changes)
