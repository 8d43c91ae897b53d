"""EPyMARL: its wrappers, from a checkout whose `src` is on the path."""

import sys
from types import ModuleType

import gymnasium
import numpy as np
import pytest
from libraries import SHORT, library

gymma = library("envs.gymma")

from supersuit import black_death_v3

from uas_coverage_env import uas_coverage_v0

KEY = "pz-uas-coverage-v0"


def environment(**settings):
    """Its wrapper reads agents by their places, so they have to stay until the mission ends."""
    return black_death_v3(uas_coverage_v0.parallel_env(action="waypoint", **settings))


@pytest.fixture
def wrapped(monkeypatch):
    """As the key of an experiment names it: EPyMARL looks for modules of `pettingzoo`."""
    module = ModuleType("pettingzoo.uas.coverage_v0")
    module.parallel_env = environment
    monkeypatch.setitem(sys.modules, module.__name__, module)
    gymnasium.register(
        KEY,
        entry_point="envs.pz_wrapper:PettingZooWrapper",
        kwargs={"lib_name": "uas", "env_name": "coverage_v0"},
    )
    yield gymma.GymmaWrapper(
        key=KEY,
        time_limit=50,
        pretrained_wrapper=None,
        seed=0,
        common_reward=True,
        reward_scalarisation="sum",
        disable_env_checker=True,
        **SHORT,
    )
    del gymnasium.registry[KEY]


def test_its_wrapper_tells_the_sizes_and_flies_a_mission_to_its_end(wrapped):
    own = uas_coverage_v0.parallel_env(action="waypoint", **SHORT)
    own.reset(seed=3)
    assert wrapped.n_agents == 2
    assert wrapped.get_total_actions() == 13
    assert wrapped.get_obs_size() == 234
    assert np.sum(wrapped.get_avail_actions()) == 2 * 13
    seen, _ = wrapped.reset(seed=3)
    assert np.shape(seen) == (2, 234)
    assert wrapped.get_state().shape == (wrapped.get_state_size(),)
    steps, ended = 0, False
    while not ended:
        actions = [steps % 13, 12]
        seen, paid, terminated, truncated, _ = wrapped.step(actions)
        steps, ended = steps + 1, terminated or truncated
        assert np.isfinite(seen).all()
        if own.agents:
            expected = own.step(dict(zip(own.possible_agents, actions, strict=True)))[1]
            assert paid == pytest.approx(sum(expected.values()))
    # one has landed, the other was cut: for EPyMARL the mission is over when no agent is left
    assert steps == SHORT["max_cycles"] + 1
    assert paid == 0.0
