"""Every wrapper of Gymnasium that fits a continuous environment, single and vector."""

from typing import Any

import gymnasium
import gymnasium.wrappers as single
import gymnasium.wrappers.vector as many
import numpy as np
import pytest
from gymnasium.vector import AutoresetMode
from libraries import SHORT

import uas_coverage_env  # noqa: F401  # registers the names

ID = "UASCoverage-v0"

SINGLE = {
    "RecordEpisodeStatistics": single.RecordEpisodeStatistics,
    "TimeLimit": lambda env: single.TimeLimit(env, 5),
    "TimeAwareObservation": single.TimeAwareObservation,
    "NormalizeObservation": single.NormalizeObservation,
    "NormalizeReward": single.NormalizeReward,
    "FrameStackObservation": lambda env: single.FrameStackObservation(env, 3),
    "FlattenObservation": single.FlattenObservation,
    "DtypeObservation": lambda env: single.DtypeObservation(env, np.float64),
    "ClipAction": single.ClipAction,
    "ClipReward": lambda env: single.ClipReward(env, -1.0, 1.0),
    "RescaleAction": lambda env: single.RescaleAction(env, -2.0, 2.0),
    "StickyAction": lambda env: single.StickyAction(env, 0.5),
    "DelayObservation": lambda env: single.DelayObservation(env, 2),
    "Autoreset": single.Autoreset,
    "PassiveEnvChecker": single.PassiveEnvChecker,
    "RecordEpisodeStatistics of masks": single.RecordEpisodeStatistics,
}
VECTOR = {
    "RecordEpisodeStatistics": many.RecordEpisodeStatistics,
    "NormalizeObservation": many.NormalizeObservation,
    "NormalizeReward": many.NormalizeReward,
    "FlattenObservation": many.FlattenObservation,
    "ClipAction": many.ClipAction,
    "ClipReward": lambda env: many.ClipReward(env, -1.0, 1.0),
    "DictInfoToList": many.DictInfoToList,
    "DtypeObservation": lambda env: many.DtypeObservation(env, np.float64),
}


@pytest.mark.parametrize("name", SINGLE)
def test_a_wrapped_environment_flies_a_mission(name):
    masks = {"action": "waypoint", "mask_in_observation": True} if name.endswith("masks") else {}
    env: Any = SINGLE[name](gymnasium.make(ID, **SHORT, **masks))
    env.action_space.seed(1)
    env.reset(seed=0)
    steps, ended = 0, False
    while not ended:
        action = env.action_space.sample()
        observation, _, terminated, truncated, info = env.step(action)
        ended = terminated or truncated
        steps += 1
    assert env.observation_space.contains(observation)
    assert steps == 5 if name == "TimeLimit" else steps <= 12
    if name.startswith("RecordEpisodeStatistics"):
        assert info["episode"]["l"] == steps


MODES = [(name, AutoresetMode.NEXT_STEP) for name in VECTOR]
# Gymnasium's wrappers of observations refuse this mode
MODES += [(n, AutoresetMode.SAME_STEP) for n in VECTOR if "Observation" not in n]


@pytest.mark.parametrize(("name", "mode"), MODES)
def test_wrapped_missions_go_on_after_their_end(name, mode):
    made = gymnasium.make_vec(
        ID, num_envs=2, vectorization_mode="vector_entry_point", autoreset_mode=mode, **SHORT
    )
    env: Any = VECTOR[name](made)
    env.action_space.seed(0)
    env.reset(seed=0)
    ends = 0
    for _ in range(20):
        observation, _, terminated, truncated, infos = env.step(env.action_space.sample())
        ends += (terminated | truncated).sum()
        assert np.isfinite(observation).all()
    assert ends >= 2
    assert len(infos) == 2 if name == "DictInfoToList" else "_covered" in infos


def test_what_was_wrapped_can_be_made_again_from_its_spec():
    env = single.NormalizeObservation(gymnasium.make(ID, **SHORT))
    assert env.spec is not None
    again = gymnasium.make(env.spec)
    assert isinstance(again, single.NormalizeObservation)
    assert again.observation_space == env.observation_space
