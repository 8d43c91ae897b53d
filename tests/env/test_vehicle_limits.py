"""A learner of wrenches cannot leave the vehicle's limits unseen, in whatever environment."""

import gymnasium as gym
import numpy as np
from practice_grounds import practice_ground

from uas_coverage_env import uas_coverage_v0
from uas_coverage_env.env import CoverageBatch
from uas_coverage_env.env.episode.step import LIMITS
from uas_coverage_env.vehicle.limits import limit_names

GROUND = practice_ground(n_uas=2, size_m=2000.0)
EXPECTED = [set(), set(), set(), set(), {"tilt"}, {"speed", "tilt"}]
TURNING = np.array([0.0, 0.0, 0.1, 0.0], np.float32)
"""A tenth of the largest torque about pitch."""


def names(masks):
    return [set(limit_names(mask)) for mask in masks]


def test_the_infos_of_each_agent_name_the_limits_it_exceeds():
    env = uas_coverage_v0.parallel_env(GROUND, action="wrench")
    _, infos = env.reset(seed=0)
    assert infos["uas_1"]["limits_exceeded"] == 0
    masks = []
    for _ in EXPECTED:
        actions = {"uas_1": TURNING, "uas_2": np.zeros(4, np.float32)}
        infos = env.step(actions)[-1]
        masks.append(infos["uas_1"]["limits_exceeded"])
        assert infos["uas_2"]["limits_exceeded"] == 0
    assert names(masks) == EXPECTED
    assert type(masks[-1]) is int


def test_so_do_the_reports_of_a_batch():
    batch = CoverageBatch(3, GROUND, action="wrench")
    batch.reset(seed=0)
    actions = np.zeros((3, 2, 4))
    masks = []
    for _ in EXPECTED:
        actions[1, 0] = TURNING
        batch.step(actions)
        masks.append(int(batch.learners.report[1, 0, LIMITS]))
        assert not batch.learners.report[[0, 2], :, LIMITS].any()
        assert not batch.learners.report[1, 1, LIMITS]
    assert names(masks) == EXPECTED


def test_so_do_the_infos_of_a_vector_environment():
    envs = gym.make_vec(
        "UASCoverage-v0",
        num_envs=2,
        vectorization_mode="vector_entry_point",
        scenario=GROUND,
        action="wrench",
    )
    envs.reset(seed=0)
    masks = []
    for _ in EXPECTED:
        actions = np.zeros((2, 2, 4), np.float32)
        actions[1, 0] = TURNING
        infos = envs.step(actions.reshape(2, 8))[-1]
        masks.append(infos["limits_exceeded"][1, 0])
        assert not infos["limits_exceeded"][0].any()
    assert names(masks) == EXPECTED
