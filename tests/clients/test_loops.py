"""Loops as people write them, after CleanRL: nothing but the environment and arrays."""

from typing import Any

import gymnasium
import numpy as np
from libraries import SHORT

from uas_coverage_env import uas_coverage_v0


def test_a_loop_that_acts_for_every_key_of_the_observations():
    env = uas_coverage_v0.parallel_env(**SHORT, action="waypoint")
    observations, infos = env.reset(seed=0)
    steps = 0
    while env.agents:
        # also for those that have just ended
        actions = {agent: int(infos[agent]["action_mask"].argmin() == 0) for agent in observations}
        observations, *_, infos = env.step(actions)
        steps += 1
    assert 1 < steps <= 12


def test_a_loop_that_acts_for_every_possible_agent():
    env = uas_coverage_v0.parallel_env(**SHORT, action="waypoint")
    env.reset(seed=0)
    while env.agents:
        _, rewards, *_ = env.step(dict.fromkeys(env.possible_agents, 12))
        batch = np.array([rewards.get(agent, 0.0) for agent in env.possible_agents])
        assert np.isfinite(batch).all()


def test_a_loop_over_vector_environments_that_reads_the_last_observations():
    envs: Any = gymnasium.make_vec(
        "UASCoverage-v0",
        num_envs=3,
        vectorization_mode="vector_entry_point",
        autoreset_mode="SameStep",
        **SHORT,
    )
    envs = gymnasium.wrappers.vector.RecordEpisodeStatistics(envs)
    observation, _ = envs.reset(seed=1)
    envs.action_space.seed(1)
    ends = 0
    for _ in range(25):
        following, _, _, truncated, infos = envs.step(envs.action_space.sample())
        real = following.copy()
        for i in np.flatnonzero(truncated):
            real[i] = infos["final_obs"][i]
            ends += 1
        assert real.shape == observation.shape
        observation = following
    assert ends >= 6
