"""The contracts that PettingZoo tests itself, and those that it does not."""

import re
import warnings

import numpy as np
import pettingzoo
import pytest

from uas_coverage_env import uas_coverage_v0
from uas_coverage_env.env import CoverageParallelEnv
from uas_coverage_env.env.actions.kinds import ACTION_NAMES
from uas_coverage_env.registration import PETTINGZOO_ID
from uas_coverage_env.scenario import generate_scenario

with warnings.catch_warnings():
    # its tests import one of pettingzoo's own environments in the way that it deprecates
    warnings.simplefilter("ignore", DeprecationWarning)
    from pettingzoo.test import (
        api_test,
        max_cycles_test,
        parallel_api_test,
        parallel_seed_test,
        render_test,
        seed_test,
        state_test,
    )

SETTINGS = [
    *({"action": name} for name in ACTION_NAMES),
    {"dynamics": "nonlinear"},
    {"action": "waypoint", "dynamics": "nonlinear", "return_mode": True, "safety_filter": True},
    {"action": "waypoint", "mask_in_observation": True},
    {"scenario": generate_scenario(0, n_uas=5, n_waypoints=30, n_obstacles=6)},
]
SEEN = [{"observation": "local"}, {"observation": "grid", "images_apart": True}]
DRAWN = [{"scenario": "generated"}, {"scenario": "generated", "action": "waypoint"}]


def named(settings):
    return "-".join(str(getattr(value, "name", value)) for value in settings.values())


all_settings = pytest.mark.parametrize("settings", SETTINGS + DRAWN, ids=named)


@pytest.mark.parametrize("settings", SETTINGS + SEEN, ids=named)
def test_parallel_api(settings, capsys):
    parallel_api_test(uas_coverage_v0.parallel_env(**settings), num_cycles=150)


# it expects an end of all possible agents, of those too that a mission does not have
@pytest.mark.filterwarnings("ignore:No agents present but not all possible_agents:UserWarning")
@pytest.mark.parametrize("settings", DRAWN, ids=named)
def test_parallel_api_of_drawn_missions(settings, capsys):
    parallel_api_test(uas_coverage_v0.parallel_env(**settings), num_cycles=150)


# it warns of every observation that is no array, as those with a mask beside it
@pytest.mark.filterwarnings("ignore:Observation space for each agent probably:UserWarning")
@pytest.mark.filterwarnings("ignore:Observation is not a NumPy array:UserWarning")
@pytest.mark.parametrize("settings", SETTINGS + DRAWN + SEEN, ids=named)
def test_aec_api(settings, capsys):
    api_test(uas_coverage_v0.env(**settings), num_cycles=60)


@all_settings
def test_parallel_seed(settings):
    parallel_seed_test(lambda: uas_coverage_v0.parallel_env(**settings), num_cycles=50)


@all_settings
def test_aec_seed(settings):
    seed_test(lambda: uas_coverage_v0.env(**settings), num_cycles=20)


def test_max_cycles():
    max_cycles_test(uas_coverage_v0)


def test_rendering(monkeypatch):
    pytest.importorskip("pygame")
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    render_test(uas_coverage_v0.env)


@all_settings
def test_global_state(settings):
    state_test(uas_coverage_v0.env(**settings), uas_coverage_v0.parallel_env(**settings))


def test_long_random_play_in_turns():
    # pettingzoo's bombardment_test takes what step() returns, None, for the next observation, and
    # so fails with any two agents
    env = uas_coverage_v0.env("village")
    for episode in range(20):
        env.reset(seed=episode)
        first, *_ = env.last()
        for agent in env.agent_iter():
            observation, reward, terminated, truncated, _ = env.last()
            assert env.observation_space(agent).contains(observation)
            assert observation.shape == first.shape
            assert np.isfinite(reward)
            env.step(None if terminated or truncated else env.action_space(agent).sample())
        assert env.agents == []


def test_the_registry_makes_both_kinds():
    # the registry came with pettingzoo 1.27
    parallel = pettingzoo.make("parallel", PETTINGZOO_ID, scenario="open_field", max_cycles=9)
    assert isinstance(parallel, CoverageParallelEnv)
    assert (parallel.scenario.name, parallel.max_cycles) == ("open_field", 9)
    in_turns = pettingzoo.make("aec", PETTINGZOO_ID, action="waypoint")
    assert isinstance(in_turns, pettingzoo.AECEnv)
    assert isinstance(in_turns.unwrapped, CoverageParallelEnv)


def test_metadata_says_what_learners_look_for():
    metadata = uas_coverage_v0.parallel_env("open_field").metadata
    assert metadata["name"] == "uas_coverage_v0"
    assert metadata["is_parallelizable"] is True
    assert "rgb_array" in metadata["render_modes"]
    assert set(metadata["render_modes"]) <= {"human", "rgb_array"}
    assert metadata["render_fps"] > 0
    env = uas_coverage_v0.env("open_field")
    assert all(re.fullmatch("[a-z]+_[0-9]+", agent) for agent in env.possible_agents)


def test_the_door_has_four_names():
    assert uas_coverage_v0.__all__ == ["env", "parallel_env", "raw_env", "vector_env"]
    raw = uas_coverage_v0.raw_env("open_field")
    assert isinstance(raw, pettingzoo.AECEnv)
