"""RLlib, new API stack: PPO on `ParallelPettingZooEnv` and on Gymnasium's environment."""

import pytest
from libraries import SHORT, library

ray = library("ray")
library("ray.rllib")
ParallelPettingZooEnv = library("ray.rllib.env.wrappers.pettingzoo_env").ParallelPettingZooEnv
PPOConfig = library("ray.rllib.algorithms.ppo").PPOConfig

import gymnasium
from ray.tune.registry import register_env

import uas_coverage_env  # noqa: F401  # registers the names
from uas_coverage_env import uas_coverage_v0


@pytest.fixture(scope="module", autouse=True)
def _ray():
    ray.init(num_cpus=1, include_dashboard=False, log_to_driver=False)
    yield
    ray.shutdown()


def trained(config):
    config = config.env_runners(num_env_runners=0, rollout_fragment_length=40).training(
        train_batch_size_per_learner=40, minibatch_size=20, num_epochs=1
    )
    algorithm = config.build_algo()
    try:
        return algorithm.train()["env_runners"]["num_env_steps_sampled"]
    finally:
        algorithm.stop()


@pytest.mark.parametrize("action", ["velocity", "waypoint"])
def test_ppo_flies_the_agents(action):
    register_env(
        "uas",
        lambda config: ParallelPettingZooEnv(uas_coverage_v0.parallel_env(**SHORT, action=action)),
    )
    config = PPOConfig().environment("uas")
    config = config.multi_agent(policies={"shared"}, policy_mapping_fn=lambda *_, **__: "shared")
    assert trained(config) >= 40


def test_ppo_flies_the_swarm():
    register_env("swarm", lambda config: gymnasium.make("UASCoverage-v0", **SHORT))
    assert trained(PPOConfig().environment("swarm")) >= 40
