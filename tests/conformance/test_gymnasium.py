"""The contracts of Gymnasium and Stable-Baselines3 for the swarm as one agent."""

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from gymnasium.vector import VectorEnv

import uas_coverage_env  # noqa: F401  it registers the ids
from uas_coverage_env.env import OBSERVATION_SIZE, CoverageSwarmEnv
from uas_coverage_env.env.actions.kinds import ACTION_NAMES

ID = "UASCoverage-v0"


SCENARIO_AND_ACTION = [*(("village", action) for action in ACTION_NAMES), ("generated", "waypoint")]


@pytest.mark.parametrize("dynamics", ["lpv", "nonlinear"])
@pytest.mark.parametrize(("scenario", "action"), SCENARIO_AND_ACTION)
def test_gymnasium_finds_nothing_wrong(scenario, action, dynamics, monkeypatch):
    pytest.importorskip("pygame")
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    env = gymnasium.make(ID, scenario=scenario, action=action, dynamics=dynamics)
    check_env(env.unwrapped)


def test_gymnasium_finds_nothing_wrong_with_masks_in_observations():
    settings = {"action": "waypoint", "mask_in_observation": True}
    env = gymnasium.make(ID, scenario="generated", **settings)
    check_env(env.unwrapped, skip_render_check=True)


@pytest.mark.parametrize(("scenario", "action"), SCENARIO_AND_ACTION)
def test_stable_baselines_finds_nothing_wrong(scenario, action):
    checker = pytest.importorskip("stable_baselines3.common.env_checker")
    checker.check_env(CoverageSwarmEnv(scenario, action=action))


@pytest.mark.parametrize("action", ACTION_NAMES)
def test_made_environments_fly_a_mission(action):
    env = gymnasium.make(ID, scenario="open_field", action=action, max_cycles=30)
    env.action_space.seed(0)
    observation, info = env.reset(seed=0)
    ended = False
    steps = 0
    while not ended:
        assert env.observation_space.contains(observation)
        observation, reward, terminated, truncated, info = env.step(env.action_space.sample())
        # sum() rounds in another way since Python 3.12
        assert reward == pytest.approx(sum(info["reward_terms"].values()), abs=1e-12)
        ended = terminated or truncated
        steps += 1
    assert steps <= 30
    assert set(info["uas"]) == {"uas_1", "uas_2"}
    env.close()


@pytest.mark.parametrize("mode", ["sync", "vector_entry_point"])
def test_vector_environments_fly_side_by_side(mode):
    env = gymnasium.make_vec(ID, num_envs=3, vectorization_mode=mode, scenario="open_field")
    assert isinstance(env, VectorEnv)
    observations, _ = env.reset(seed=0)
    assert observations.shape == (3, 2 * OBSERVATION_SIZE)
    env.action_space.seed(0)
    for _ in range(20):
        observations, rewards, *_ = env.step(env.action_space.sample())
        assert env.observation_space.contains(observations)
        assert np.isfinite(rewards).all()
    env.close()


@pytest.mark.parametrize("n", [0, -1, 1.5, True])
def test_no_environment_is_no_vector(n):
    with pytest.raises(ValueError, match="num_envs"):
        gymnasium.make_vec(ID, num_envs=n, vectorization_mode="vector_entry_point")
