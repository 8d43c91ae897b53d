"""SuperSuit: its wrappers, and the way from PettingZoo to a vector environment."""

import numpy as np
import pytest
from libraries import SHORT, library

supersuit = library("supersuit")

from uas_coverage_env import uas_coverage_v0

WRAPPERS = {
    "black_death": supersuit.black_death_v3,
    "pad_observations": supersuit.pad_observations_v0,
    "pad_action_space": supersuit.pad_action_space_v0,
    "frame_stack": lambda env: supersuit.frame_stack_v1(env, 2),
    "agent_indicator": supersuit.agent_indicator_v0,
    "sticky_actions": lambda env: supersuit.sticky_actions_v0(env, 0.3),
    "clip_actions": supersuit.clip_actions_v0,
    "normalize_obs": supersuit.normalize_obs_v0,
}


@pytest.mark.parametrize("name", WRAPPERS)
def test_a_wrapped_environment_flies_a_mission(name):
    env = WRAPPERS[name](uas_coverage_v0.parallel_env(**SHORT))
    env.reset(seed=0)
    steps = 0
    while env.agents:
        action = np.full(env.action_space("uas_1").shape, 0.5, np.float32)
        env.step(dict.fromkeys(env.agents, action))
        steps += 1
    assert steps == (13 if name == "black_death" else 12)


def test_agents_are_lanes_of_a_vector_environment():
    env = supersuit.black_death_v3(uas_coverage_v0.parallel_env(**SHORT))
    env = supersuit.pettingzoo_env_to_vec_env_v1(env)
    lanes = supersuit.concat_vec_envs_v1(env, 2, num_cpus=0, base_class="gymnasium")
    lanes.reset(seed=0)
    ends = 0
    for _ in range(15):
        observation, _, terminated, truncated, _ = lanes.step(np.full((4, 3), 0.5, np.float32))
        ends += (terminated | truncated).sum()
    assert observation.shape == (4, 234)
    assert ends == 4
