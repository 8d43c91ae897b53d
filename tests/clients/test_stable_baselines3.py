"""Stable-Baselines3 and sb3-contrib: on Gymnasium's environment, and on `CoverageVecEnv`."""

from typing import Any

import numpy as np
import pytest
from libraries import SHORT, library

library("stable_baselines3")
library("sb3_contrib")

import gymnasium
import torch
from sb3_contrib import MaskablePPO
from sb3_contrib.common.maskable.callbacks import MaskableEvalCallback
from sb3_contrib.common.maskable.evaluation import evaluate_policy as evaluate_masked
from stable_baselines3 import PPO, SAC
from stable_baselines3.common.callbacks import EvalCallback
from stable_baselines3.common.env_checker import check_env
from stable_baselines3.common.env_util import make_vec_env
from stable_baselines3.common.evaluation import evaluate_policy
from stable_baselines3.common.torch_layers import NatureCNN
from stable_baselines3.common.vec_env import VecMonitor, VecNormalize
from uas_coverage_agents.training.vec_env import CoverageVecEnv

from uas_coverage_env.env import CoverageSwarmEnv, grid
from uas_coverage_env.env.observation.surroundings import SURROUNDINGS
from uas_coverage_env.env.observation.waypoints import WAYPOINTS

torch.set_num_threads(1)
QUICK: dict[str, Any] = {"n_steps": 24, "batch_size": 24, "n_epochs": 1, "device": "cpu", "seed": 0}


def lanes(**settings) -> Any:
    return CoverageVecEnv(2, **SHORT, **settings)


def swarms(**settings) -> Any:
    return make_vec_env("UASCoverage-v0", n_envs=2, env_kwargs={**SHORT, **settings})


@pytest.mark.parametrize("make", [lanes, swarms])
def test_ppo_learns_is_evaluated_and_monitored(make, tmp_path):
    env = VecNormalize(VecMonitor(make()))
    watched = VecNormalize(VecMonitor(make()), training=False)
    after = EvalCallback(watched, eval_freq=24, n_eval_episodes=2)
    model = PPO("MlpPolicy", env, **QUICK).learn(96, callback=after)
    assert np.isfinite(after.last_mean_reward)
    told: Any = evaluate_policy(model, env, n_eval_episodes=4, return_episode_rewards=True)
    returns, lengths = told
    assert all(0 < length <= 12 for length in lengths)
    assert np.isfinite(returns).all()
    model.save(tmp_path / "model")
    assert PPO.load(tmp_path / "model", device="cpu").observation_space == env.observation_space


def test_sac_learns():
    SAC("MlpPolicy", swarms(), learning_starts=8, batch_size=8, device="cpu", seed=0).learn(20)


@pytest.mark.parametrize("make", [lanes, swarms])
def test_maskable_ppo_chooses_waypoints(make):
    env = make(action="waypoint")
    after = MaskableEvalCallback(VecMonitor(make(action="waypoint")), eval_freq=24)
    model = MaskablePPO("MlpPolicy", env, **QUICK).learn(96, callback=after)
    evaluate_masked(model, env, n_eval_episodes=2)
    observation = env.reset()
    masks = np.stack(env.env_method("action_masks"))
    choices, _ = model.predict(observation, action_masks=masks)
    rows = masks.reshape(-1, 13)
    assert rows[np.arange(len(rows)), np.ravel(choices)].all()


@pytest.mark.parametrize("make", [lanes, swarms])
def test_policies_read_observations_with_masks_in_them(make):
    env = make(action="waypoint", mask_in_observation=True)
    PPO("MultiInputPolicy", env, **QUICK).learn(48)


def test_what_a_lane_has_seen_last_has_its_mask():
    env, plain = lanes(action="waypoint", mask_in_observation=True), lanes(action="waypoint")
    for each in (env, plain):
        each.seed(0)
        each.reset()
    for _ in range(12):
        masks = plain.action_masks()
        seen, _, dones, infos = env.step(masks.argmax(axis=1))
        expected = plain.step(masks.argmax(axis=1))
        np.testing.assert_array_equal(seen["observation"], expected[0])
        np.testing.assert_array_equal(seen["action_mask"], plain.action_masks())
    assert dones.all()
    for info, other in zip(infos, expected[3], strict=True):
        last = info["terminal_observation"]
        np.testing.assert_array_equal(last["observation"], other["terminal_observation"])
        assert env.observation_space.contains(last)


@pytest.mark.parametrize(
    ("policy", "observation"), [("CnnPolicy", (grid(),)), ("MultiInputPolicy", "grid")]
)
def test_pictures_are_learned_from(policy, observation):
    settings: dict[str, Any] = {"observation": observation, "images_apart": True}
    check_env(CoverageSwarmEnv(**SHORT, **settings))
    model = PPO(policy, swarms(**settings), **QUICK).learn(48)
    assert any(isinstance(part, NatureCNN) for part in model.policy.modules())


def test_lanes_show_pictures_apart_to_the_last():
    # 236 numbers, as in tests/env/test_blocks.py: a batch is compiled once for each size
    env = lanes(observation=(WAYPOINTS, SURROUNDINGS, grid(4, 80.0)), images_apart=True)
    seen = env.reset()
    for _ in range(12):
        seen, _, dones, infos = env.step(np.zeros((4, 3)))
    assert seen["grid"].shape == (4, 5, 4, 4)
    assert seen["grid"].dtype == np.uint8
    assert dones.all()
    for info in infos:
        assert env.observation_space.contains(info["terminal_observation"])


def test_lanes_are_filmed():
    env = lanes(render_mode="rgb_array")
    assert env.render_mode == "rgb_array"
    assert env.get_attr("render_mode") == ["rgb_array"] * 4
    env.reset()
    first = env.render()
    env.step(np.full((4, 3), 0.5))
    assert env.render().shape == first.shape == (512, 1024, 3)
    assert (env.render() != first).any()
    with pytest.raises(ValueError, match="render_mode is 'ansi'"):
        lanes(render_mode="ansi")


def test_many_missions_of_gymnasium_are_not_for_it():
    # what docs/works_with.md says: CoverageVecEnv is the door
    many: Any = gymnasium.make_vec("UASCoverage-v0", num_envs=2, **SHORT)
    with pytest.raises(ValueError, match="not a Gymnasium environment"):
        PPO("MlpPolicy", many)
