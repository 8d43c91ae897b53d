"""Stable-Baselines3 on the batched world: lanes, episodes and what learners take from them."""

import numpy as np
import pytest

from uas_coverage_env.env import OBSERVATION_SIZE, CoverageBatch, observation_columns
from uas_coverage_env.scenario import GeneratedScenarios, generate_scenario

pytest.importorskip("stable_baselines3")

import torch
from stable_baselines3 import PPO
from stable_baselines3.common.evaluation import evaluate_policy
from stable_baselines3.common.monitor import Monitor
from stable_baselines3.common.vec_env import VecNormalize
from uas_coverage_agents.training.vec_env import CoverageVecEnv

TOWNS = tuple(
    generate_scenario(1_000_000 + n, n_uas=n, n_waypoints=10, n_obstacles=3) for n in (1, 2, 3)
)
FAMILY = GeneratedScenarios(n_uas=(1, 3), n_waypoints=(6, 10), n_obstacles=(0, 3))

torch.set_num_threads(1)
FLYING_COLUMN = int(observation_columns("own", "flying")[0, 0])


def fly(env, steps, seed=0):
    """Random actions; yields what every step gave."""
    rng = np.random.default_rng(seed)
    for _ in range(steps):
        if env.batch.chooses:
            actions = rng.integers(0, 13, env.num_envs)
        else:
            actions = rng.uniform(-1, 1, (env.num_envs, *env.action_space.shape))
        flew = env.alive
        yield flew, env.step(actions)


def test_lanes_are_the_uas_of_a_batch():
    env = CoverageVecEnv(3, TOWNS)
    batch = CoverageBatch(3, TOWNS, autoreset="same_step")
    env.seed(4)
    assert env.num_envs == 9
    np.testing.assert_array_equal(env.reset(), batch.reset(seed=4).reshape(9, -1))
    for step in range(5):
        actions = np.random.default_rng(step).uniform(-1, 1, (9, 3)).astype(np.float32)
        observations, rewards, _, _ = env.step(actions)
        np.testing.assert_array_equal(
            observations, batch.step(actions.reshape(3, -1)).reshape(9, -1)
        )
        np.testing.assert_array_equal(rewards, batch.lanes.rewards.ravel().astype(np.float32))
        assert np.asarray(observations).dtype == rewards.dtype == np.float32


def test_lanes_without_a_flying_uas_are_paid_nothing():
    env = CoverageVecEnv(4, TOWNS, max_cycles=60)
    env.seed(0)
    env.reset()
    waited = 0
    for flew, (_, rewards, dones, infos) in fly(env, 150):
        assert (rewards[~flew] == 0.0).all()
        assert (rewards[flew] != 0.0).any() or not flew.any()
        for lane in np.flatnonzero(~flew & dones):
            assert not infos[lane]["TimeLimit.truncated"]
            assert "episode" not in infos[lane]
        waited += int((~flew).sum())
    assert waited > 50


def test_episodes_are_told_once_with_all_their_rewards():
    env = CoverageVecEnv(4, TOWNS, max_cycles=60)
    env.seed(0)
    env.reset()
    returns, lengths, told = np.zeros(env.num_envs), np.zeros(env.num_envs), 0
    for flew, (_, rewards, dones, infos) in fly(env, 150):
        returns += rewards
        lengths += flew
        for lane in range(env.num_envs):
            assert ("terminal_observation" in infos[lane]) == dones[lane]
            if "episode" in infos[lane]:
                assert flew[lane]
                assert infos[lane]["episode"]["r"] == pytest.approx(returns[lane], abs=1e-4)
                assert infos[lane]["episode"]["l"] == lengths[lane]
                told += 1
            if dones[lane]:
                returns[lane] = lengths[lane] = 0
    assert told > 10


def test_a_uas_that_flies_when_its_mission_is_cut_is_truncated_and_not_lost():
    env = CoverageVecEnv(2, "open_field", max_cycles=5)
    before = env.reset().copy()
    hover = np.zeros((env.num_envs, 3))
    for step in range(5):
        observations, _, dones, infos = env.step(hover)
        assert dones.all() == (step == 4)
    for lane, info in enumerate(infos):
        assert info["TimeLimit.truncated"] is True
        assert info["terminal_observation"].shape == (OBSERVATION_SIZE,)
        assert info["terminal_observation"][FLYING_COLUMN] == 1.0
        assert (info["terminal_observation"] != observations[lane]).any()
    np.testing.assert_array_equal(observations, before)


def test_learners_add_the_value_of_what_a_cut_mission_leaves_out():
    env = CoverageVecEnv(1, "open_field", max_cycles=4)
    model = PPO("MlpPolicy", env, n_steps=4, batch_size=8, gamma=0.5, seed=0, device="cpu")
    seen = []
    step_wait = env.step_wait

    def watched():
        observations, rewards, dones, infos = step_wait()
        # the learner adds the values in place
        seen.append((rewards.copy(), dones, infos))
        return observations, rewards, dones, infos

    env.step_wait = watched
    model._setup_learn(8)
    model.collect_rollouts(env, model._init_callback(None), model.rollout_buffer, n_rollout_steps=4)
    rewards, dones, infos = seen[-1]
    assert dones.all()
    last = np.stack([info["terminal_observation"] for info in infos])
    values = model.policy.predict_values(model.policy.obs_to_tensor(last)[0]).detach().numpy()
    expected = rewards + 0.5 * values.ravel()
    np.testing.assert_allclose(model.rollout_buffer.rewards[-1], expected, atol=1e-5)
    assert (values != 0.0).all()


def weights_after_training(seed):
    env = CoverageVecEnv(3, TOWNS, max_cycles=20)
    model = PPO("MlpPolicy", env, n_steps=32, batch_size=96, n_epochs=2, seed=seed, device="cpu")
    model.learn(600)
    return [value.numpy().copy() for value in model.policy.state_dict().values()]


def test_a_seed_reproduces_every_weight():
    first, again, other = (weights_after_training(seed) for seed in (3, 3, 4))
    for a, b in zip(first, again, strict=True):
        np.testing.assert_array_equal(a, b)
    assert any((a != b).any() for a, b in zip(first, other, strict=True))


@pytest.mark.parametrize("scenario", [TOWNS, FAMILY], ids=["towns", "family"])
def test_missions_go_on_bit_for_bit_from_a_saved_state(scenario):
    env = CoverageVecEnv(3, scenario, max_cycles=12)
    env.seed(1)
    env.reset()
    list(fly(env, 20, seed=1))
    saved = env.state_dict()
    twin = CoverageVecEnv(3, scenario, max_cycles=12)
    np.testing.assert_array_equal(twin.load_state_dict(saved), env.batch.observation.reshape(9, -1))
    pairs = zip(fly(env, 30, seed=2), fly(twin, 30, seed=2), strict=True)
    for (flew, result), (twin_flew, twin_result) in pairs:
        np.testing.assert_array_equal(flew, twin_flew)
        for mine, other in zip(result[:3], twin_result[:3], strict=True):
            np.testing.assert_array_equal(mine, other)
        for info, twin_info in zip(result[3], twin_result[3], strict=True):
            assert info.get("episode", {}).get("r") == twin_info.get("episode", {}).get("r")


def test_a_state_of_another_environment_is_refused():
    saved = CoverageVecEnv(2, TOWNS).state_dict()
    with pytest.raises(ValueError, match="episode_returns has shape"):
        CoverageVecEnv(3, TOWNS).load_state_dict(saved)
    with pytest.raises(ValueError, match="episode_lengths missing"):
        CoverageVecEnv(2, TOWNS).load_state_dict(
            {name: array for name, array in saved.items() if name != "episode_lengths"}
        )
    with pytest.raises(ValueError, match="surplus"):
        CoverageVecEnv(2, TOWNS).load_state_dict({**saved, "secret": np.zeros(1)})


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("scenario", len(TOWNS)),
        ("scenario", -1),
        ("orders", 3),
        ("targets", 10**9),
        ("candidates", -2),
        ("step", -(10**9)),
        ("uas.status", 77),
        ("x", np.inf),
        ("observation", np.nan),
        ("episode_returns", np.inf),
        ("episode_lengths", -1),
    ],
)
def test_missions_do_not_go_on_from_numbers_that_point_at_nothing(name, value):
    env = CoverageVecEnv(3, TOWNS)
    env.reset()
    forged = env.state_dict()
    forged[name].flat[-1] = value
    before = env.state_dict()
    with pytest.raises(ValueError, match=rf"^{name}\[.*\] is "):
        env.load_state_dict(forged)
    for kept, array in env.state_dict().items():
        np.testing.assert_array_equal(array, before[kept])


def test_choices_are_masked_for_maskable_ppo():
    env = CoverageVecEnv(2, TOWNS, action="waypoint", max_cycles=30)
    env.reset()
    masks = np.stack(env.env_method("action_masks"))
    assert masks.shape == (env.num_envs, 13)
    assert masks.dtype == np.bool_
    assert masks.any(axis=1).all()
    np.testing.assert_array_equal(env.env_method("action_masks", indices=[3])[0], masks[3])
    for _ in fly(env, 40):
        assert env.action_masks().any(axis=1).all()
    with pytest.raises(AttributeError, match="continuous"):
        CoverageVecEnv(2, TOWNS).get_attr("action_masks")


def test_attributes_are_those_of_a_lane():
    env = CoverageVecEnv(2, TOWNS)
    env.seed(2)
    env.reset()
    names = [scenario.name for scenario in env.get_attr("scenario")]
    assert names == [env.batch.scenario_of(lane // 3).name for lane in range(6)]
    assert env.get_attr("alive") == env.alive.tolist()
    assert env.get_attr("render_mode", [0, 2]) == [None, None]
    env.set_attr("note", "mine", [1])
    assert env.get_attr("note", [0, 1]) == [None, "mine"]
    assert env.env_is_wrapped(Monitor) == [True] * 6
    assert env.env_is_wrapped(VecNormalize) == [False] * 6
    with pytest.raises(AttributeError):
        env.get_attr("nothing")
    with pytest.raises(AttributeError, match="all environments"):
        env.set_attr("num_envs", 3)
    with pytest.raises(AttributeError, match="action_masks"):
        env.env_method("fly_home")


def test_stable_baselines_evaluates_and_normalises_it():
    env = CoverageVecEnv(2, "open_field", max_cycles=6)
    model = PPO("MlpPolicy", VecNormalize(env), n_steps=16, batch_size=32, device="cpu", seed=0)
    model.learn(64)
    returns, lengths = evaluate_policy(model, env, n_eval_episodes=6, return_episode_rewards=True)
    assert len(returns) == 6
    assert set(lengths) == {6}


def test_an_action_that_is_no_number_is_refused():
    env = CoverageVecEnv(2, "open_field")
    env.reset()
    actions = np.zeros((4, 3))
    actions[2, 1] = np.nan
    with pytest.raises(ValueError, match="UAS 0 in environment 1"):
        env.step(actions)
