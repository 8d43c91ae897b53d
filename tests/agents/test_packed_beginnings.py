"""Several beginnings of one training: which goes on, what flies, and that it repeats."""

import numpy as np
import pytest
from uas_coverage_agents.policy.environment import action_of, keywords_of
from uas_coverage_agents.training import packed
from uas_coverage_agents.training.learner import Told
from uas_coverage_agents.training.missions import Missions
from uas_coverage_agents.training.packed import PackedPpo
from uas_coverage_agents.training.rounds import TrainingJob, one_round, policy_of, train
from uas_coverage_agents.training.settings import settings_of
from uas_coverage_agents.training.worth import worth_of

from uas_coverage_env.files.strict_toml import InputError
from uas_coverage_env.tasks import score

TINY = (
    *("num_envs=2", "rounds=5", "total_timesteps=160", "size.n_uas=[2,2]"),
    *("size.n_waypoints=[5,5]", "size.n_obstacles=[0,2]"),
    *("learning.n_steps=4", "learning.batch_size=16", "learning.hidden=[8,4]"),
    *("learning.missions=2", "learning.beginnings=2", "learning.beginning_rounds=2"),
    *("learning.validate_every=1000", "learning.validation_missions=2"),
)


def tiny(*changes):
    return settings_of("ppo-velocity", scenario="generated", changes=[*TINY, *changes])


@pytest.fixture
def rounds(monkeypatch):
    """States after each round of a training whose validations come to given numbers."""

    def flown(settings, *worths):
        left = iter(worths)
        monkeypatch.setattr(packed, "worth_of", lambda *_: next(left))
        monkeypatch.setattr("uas_coverage_agents.training.rounds._try", lambda *_: None)
        states = [None]
        for number in range(settings.rounds):
            states.append(one_round(TrainingJob("tiny", settings), number, states[-1]).arrays)
        assert next(left, None) is None
        return states[1:]

    return flown


def weights(state, owner="model/"):
    return {name: state[name] for name in state if name.startswith(owner)}


def alike(one, other):
    return one.keys() == other.keys() and all(np.array_equal(one[k], other[k]) for k in one)


def flies(settings, state):
    learner = PackedPpo(settings, Missions.of(settings), 0)
    learner.load_state_dict(state)
    return learner.learned().tensors["others.weight"]


def test_a_beginning_has_weights_of_its_own_and_the_better_one_goes_on(rounds):
    better_first = rounds(tiny(), 0.1, 0.3, 0.2, 0.1, 0.0)
    first, second = better_first[1], better_first[2]
    assert not np.allclose(second["model/one.weight"], first["model/one.weight"], atol=0.1)
    assert alike(weights(better_first[3]), weights(first))
    assert alike(weights(better_first[3], "adam/"), weights(first, "adam/"))
    assert not alike(weights(better_first[4]), weights(first))
    better_second = rounds(tiny(), 0.1, 0.3, 0.4, 0.1, 0.0)
    assert alike(weights(better_second[1]), weights(first))
    assert not alike(weights(better_second[3]), weights(first))
    last = better_second[3]
    assert np.allclose(last["model/one.weight"], second["model/one.weight"], atol=0.1)
    assert not any(name.startswith("rival/") for name in last)


def test_what_flies_is_the_best_on_validation_missions_so_far(rounds):
    settings = tiny("learning.beginnings=1", "rounds=3")
    states = rounds(settings, 0.1, 0.3, 0.2)
    for state, best in zip(states, (0, 1, 1), strict=True):
        assert np.array_equal(flies(settings, state), states[best]["model/others.weight"])
    assert not alike(weights(states[2]), weights(states[1]))


def test_steps_are_those_of_all_beginnings_and_a_schedule_counts_its_own(rounds):
    settings = tiny()
    states = rounds(settings, 0.1, 0.3, 0.2, 0.1, 0.0)
    assert [int(state["flown"]) for state in states] == [32, 64, 96, 128, 160]
    assert [int(state["steps"]) for state in states] == [32, 64, 32, 64, 96]
    learner = PackedPpo(settings, Missions.of(settings), 0)
    learner.load_state_dict(states[4])
    assert (learner.steps, learner._share) == (160, 1.0)


def test_a_training_that_is_stopped_after_every_round_comes_to_the_same_weights(tmp_path):
    job = TrainingJob("tiny", tiny(), missions=1)
    whole = train({tmp_path / "whole": job})[tmp_path / "whole"]

    def stop(progress):
        raise KeyboardInterrupt

    for _ in range(job.settings.rounds):
        with pytest.raises(KeyboardInterrupt):
            train({tmp_path / "stopped": job}, on_progress=stop)
    resumed = train({tmp_path / "stopped": job})[tmp_path / "stopped"]
    assert resumed.description.weights_sha256 == whole.description.weights_sha256
    assert resumed.description.training.steps == 160


def test_validation_leaves_what_is_learned_as_it_is():
    found, told = [], Told()
    for steps in (1, 0):
        settings = tiny("learning.beginnings=1", "rounds=1", f"learning.validate_every={steps}")
        learner = PackedPpo(settings, Missions.of(settings), 0)
        learner.learn(0, told)
        found.append(learner.state_dict())
    often, never = found
    assert len([numbers for _, numbers in told.rows if "worth" in numbers]) == 10
    assert alike(weights(often), weights(never))
    assert alike(weights(often, "adam/"), weights(never, "adam/"))
    assert not {"flown", "worth"} & never.keys()


def test_what_a_policy_is_worth_is_its_mean_value_on_the_validation_split_of_the_level():
    settings = settings_of("ppo-velocity", changes=["learning.hidden=[8,4]"])
    missions = Missions.of(settings)
    learner = PackedPpo(settings, missions, 0)
    policy = policy_of(TrainingJob("tiny", settings), learner, 0.0, 0.0)
    found = score(
        action_of(policy), "hard-v1", missions=3, split="validation", batch=2, action="velocity"
    )
    assert keywords_of(policy)["action"] == "velocity"
    assert worth_of(learner.learned(), missions, 3) == pytest.approx(found.mean("value"))
    assert found.mean("coverage") > 0.0


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        (("learning.validate_every=0",), "beginnings = 2: give validate_every, too"),
        (("rounds=3",), "beginnings take 4 of 3 rounds"),
        (("learning.beginnings=0",), "beginnings"),
        (("learning.validation_missions=51",), "validation_missions"),
    ],
)
def test_beginnings_that_cannot_be_are_refused_in_a_line(changes, words):
    settings = tiny(*changes)
    with pytest.raises(InputError, match=words) as caught:
        PackedPpo(settings, Missions.of(settings), 0)
    assert "\n" not in str(caught.value)


def test_a_best_of_other_shapes_is_refused_in_a_line(rounds):
    settings = tiny("learning.beginnings=1", "rounds=1")
    state = rounds(settings, 0.1)[0]
    spoilt = {**state, "best/others.bias": np.zeros(1, np.float32)}
    with pytest.raises(InputError, match="does not fit this learner"):
        flies(settings, spoilt)
    with pytest.raises(InputError, match="does not fit this learner"):
        flies(settings, {name: state[name] for name in state if name != "worth"})
