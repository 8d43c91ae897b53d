"""Tianshou: `PettingZooEnv`, its collector and its multi-agent algorithms."""

from libraries import SHORT, library

library("tianshou")

import numpy as np
from tianshou.algorithm.multiagent.marl import (
    MultiAgentOffPolicyAlgorithm,
)
from tianshou.algorithm.random import (
    MARLRandomDiscreteMaskedOffPolicyAlgorithm,
)
from tianshou.data import Collector, VectorReplayBuffer
from tianshou.env import DummyVectorEnv, PettingZooEnv

from uas_coverage_env import uas_coverage_v0


def environment():
    return PettingZooEnv(uas_coverage_v0.env(**SHORT, action="waypoint", mask_in_observation=True))


def test_masks_are_those_of_the_environment():
    env = environment()
    observation, _ = env.reset()
    expected = env.env.last()[0]["action_mask"]
    assert observation["mask"] == [bool(choice) for choice in expected]
    assert not all(observation["mask"])


def test_a_collector_plays_missions():
    envs = DummyVectorEnv([environment] * 2)
    env = environment()
    agents = [MARLRandomDiscreteMaskedOffPolicyAlgorithm(env.action_space) for _ in env.agents]
    algorithm = MultiAgentOffPolicyAlgorithm(algorithms=agents, env=env)
    collector = Collector(algorithm, envs, VectorReplayBuffer(400, 2))
    collector.reset()
    collected = collector.collect(n_step=60)
    assert collected.n_collected_steps == 60
    batch, _ = collector.buffer.sample(0)
    chosen = np.take_along_axis(batch.obs.mask, batch.act[:, None].astype(int), axis=1)
    assert chosen.all()
