"""Reference learners on the levels: files that are read, trainings that go on, central critics."""

import numpy as np
import pytest
import torch
from gymnasium import spaces
from uas_coverage_agents.reference.central_critic import CentralCriticPolicy
from uas_coverage_agents.reference.settings import Reference, reference_named, reference_names
from uas_coverage_agents.reference.training import STATE, chosen_of, lanes_of, train_reference

from uas_coverage_env.files.strict_toml import InputError
from uas_coverage_env.tasks import LEVELS, level_named, score


def tiny(name: str, **changes) -> Reference:
    """A learner of the package that learns next to nothing, in two rounds."""
    given = reference_named(name)
    short = {"batch_size": 16} if given.algorithm == "SAC" else {"n_steps": 16, "batch_size": 16}
    learning = {**given.learning, **short}
    if given.algorithm == "SAC":
        learning |= {"learning_starts": 8, "buffer_size": 1000}
    usual = {"missions": 2, "steps": 64, "rounds": 2, "learning": learning}
    return given.model_copy(update={**usual, **changes})


def weights(trained) -> list[torch.Tensor]:
    return list(trained.policy.model.policy.state_dict().values())


def test_every_learner_of_the_package_is_read_and_has_an_environment_on_every_level():
    names = reference_names()
    assert names == ["ippo", "mappo", "maskable-ppo", "ppo", "recurrent-ppo", "sac"]
    for name in names:
        assert reference_named(name).summary
        for level in LEVELS:
            level_named(level).settings(**chosen_of(reference_named(name), level))
    lanes = lanes_of(tiny("mappo"), "medium")
    assert lanes.num_envs == 2 * 3
    sizes = [
        sum(b.size for b in chosen_of(tiny(n), "medium")["observation"]) for n in ("ippo", "mappo")
    ]
    assert lanes.observation_space.shape == (sizes[1],) > (sizes[0],)


@pytest.mark.parametrize("name", ["ppo", "sac"])
def test_a_training_that_was_killed_goes_on_to_the_same_weights(name, tmp_path):
    whole = train_reference(tiny(name), "easy", 3, tmp_path / "whole")

    def kill(done: int, *_: object) -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        train_reference(tiny(name), "easy", 3, tmp_path / "killed", kill)
    rounds: list[int] = []
    told = train_reference(
        tiny(name), "easy", 3, tmp_path / "killed", lambda done, *_: rounds.append(done)
    )
    assert rounds == [2]
    assert told.steps == whole.steps >= 64
    for mine, theirs in zip(weights(told), weights(whole), strict=True):
        assert torch.equal(mine, theirs)
    again = train_reference(tiny(name), "easy", 3, tmp_path / "whole")
    assert again.steps == whole.steps, "and nothing is repeated"


def test_other_settings_and_damaged_states_are_refused_in_a_line(tmp_path):
    train_reference(tiny("ppo", rounds=1, steps=16), "easy", 0, tmp_path)
    with pytest.raises(InputError, match="another --out"):
        train_reference(tiny("ppo"), "easy", 0, tmp_path)
    (tmp_path / STATE).write_bytes(b"none")
    with pytest.raises(InputError, match="cannot be read") as caught:
        train_reference(tiny("ppo"), "easy", 0, tmp_path)
    assert "\n" not in str(caught.value)
    with pytest.raises(InputError, match="did you mean mappo"):
        reference_named("mapo")
    with pytest.raises(InputError, match="gama"):
        train_reference(tiny("ppo", learning={"gama": 1.0}), "easy", 0, tmp_path / "other")


def test_a_central_critic_sees_the_whole_mission_and_the_actor_does_not():
    space = spaces.Box(-1.0, 1.0, (20,), np.float32)
    policy = CentralCriticPolicy(space, spaces.Box(-1.0, 1.0, (3,)), lambda _: 1e-3, actor_size=12)
    seen = torch.as_tensor(np.stack([space.sample(), space.sample()]))
    seen[1, :12] = seen[0, :12]
    actions = policy.get_distribution(seen).mode()
    values = policy.predict_values(seen)
    torch.testing.assert_close(actions[0], actions[1], rtol=0.0, atol=1e-6)
    assert abs(values[0] - values[1]) > 1e-3


def test_a_policy_with_a_memory_begins_each_mission_with_nothing_in_mind(tmp_path):
    trained = train_reference(tiny("recurrent-ppo", rounds=1), "easy", 0, tmp_path)
    returns = [score(trained.policy, "easy", missions=1).mean("episode_return") for _ in range(2)]
    assert returns[0] == returns[1]


def test_a_policy_with_masks_flies_what_it_may(tmp_path):
    trained = train_reference(tiny("maskable-ppo", rounds=1), "easy", 0, tmp_path)
    assert score(trained.policy, "easy", missions=1).missions[0].n_uas == 1
