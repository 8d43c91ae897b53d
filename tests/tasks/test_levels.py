"""Levels: their environments, their seeds, and what nothing can change about them."""

import dataclasses
import pickle
from typing import Any

import gymnasium
import numpy as np
import pettingzoo
import pytest

from uas_coverage_env import registration
from uas_coverage_env.env import CoverageParallelEnv
from uas_coverage_env.features.motor import MotorDegraded
from uas_coverage_env.features.radio import RadioLost
from uas_coverage_env.tasks import LEVELS, SPLITS, level_named, parallel_env, seeds_of

LEVEL_NAMES = tuple(LEVELS)


def test_every_level_is_registered_and_no_other():
    assert registration.LEVEL_NAMES == LEVEL_NAMES
    for task in LEVELS.values():
        assert task.id in gymnasium.registry


def test_no_mission_is_of_two_splits():
    seeds = [seed for split in SPLITS.values() for seed in split]
    assert len(set(seeds)) == len(seeds)
    assert len(seeds_of("test")) >= 20


@pytest.mark.parametrize("level", LEVEL_NAMES)
@pytest.mark.parametrize("split", SPLITS)
def test_the_missions_of_a_level_fit_its_spaces(level, split):
    task = level_named(level)
    source = task.missions(split)
    for seed in seeds_of(split)[:4]:
        scenario = source.fitted(task.scenario(seed))
        assert scenario == task.scenario(seed)
        assert (scenario.wind is not None) == (task.disturbances is not None)


def test_a_level_draws_training_missions_unless_it_is_asked_for_others():
    task = level_named("easy")
    names = {split: {task.scenario(seed).name for seed in seeds_of(split)} for split in ("test",)}
    env: Any = gymnasium.make(task.id)
    held_out: Any = gymnasium.make(task.id, split="test")
    for seed in range(3):
        env.reset(seed=seed)
        held_out.reset(seed=seed)
        assert env.unwrapped.scenario.name not in names["test"]
        assert held_out.unwrapped.scenario.name in names["test"]


@pytest.mark.parametrize(
    "settings",
    [{"return_mode": False}, {"safety_filter": True}, {"scenario": "village"}, {"max_cycles": 9}],
)
def test_what_is_on_is_in_the_id_and_cannot_be_said_otherwise(settings):
    with pytest.raises(ValueError, match="says it itself"):
        gymnasium.make("UASCoverage/Easy-v0", **settings)


def test_how_it_acts_and_what_it_is_paid_for_is_a_learners_affair():
    env = gymnasium.make("UASCoverage/Easy-v0", action="velocity", reward_weights={"energy": 1.0})
    assert env.action_space.shape == (3,)


@pytest.mark.parametrize(
    ("arguments", "reason"),
    [({"level": "hardest"}, "it is one of easy"), ({"level": "easy", "split": "exam"}, "training")],
)
def test_what_there_is_not_is_refused(arguments, reason):
    with pytest.raises(ValueError, match=reason):
        parallel_env(**arguments)


def test_many_missions_and_the_multi_agent_environment_fly_the_same_level():
    one = parallel_env("easy")
    many = gymnasium.make_vec(
        "UASCoverage/Easy-v0", num_envs=2, vectorization_mode="vector_entry_point"
    )
    observations, _ = one.reset(seed=4)
    batch, _ = many.reset(seed=4)
    assert np.array_equal(observations["uas_1"], batch[0])
    assert isinstance(one, CoverageParallelEnv)
    if hasattr(pettingzoo, "make"):
        made: Any = pettingzoo.make("parallel", "uas/coverage-easy-v0")
        made.reset(seed=4)
        assert made.unwrapped.scenario == one.scenario


def test_an_environment_of_a_level_travels_and_draws_on():
    env = parallel_env("easy")
    env.reset(seed=1)
    again = pickle.loads(pickle.dumps(env))
    env.reset()
    again.reset()
    assert again.scenario == env.scenario


def test_the_spec_of_a_level_is_plain_text():
    assert "easy" in gymnasium.make("UASCoverage/Easy-v0").spec.to_json()


def test_assistants_are_on_in_the_easy_ones_and_off_in_the_hard_ones():
    on = {level: task.return_mode and task.safety_filter for level, task in LEVELS.items()}
    assert on == {
        "easy": True,
        "medium": True,
        "hard": False,
        "extreme": False,
        "air-taxi": True,
        "indoor": True,
    }


def test_faults_of_the_last_level_are_those_of_its_table_and_repeat():
    task = LEVELS["extreme"]
    scenario = task.scenario(seeds_of("validation")[0])
    assert [type(event) for event in scenario.events] == [MotorDegraded, RadioLost]
    again = dataclasses.replace(task).scenario(seeds_of("validation")[0])
    assert again == scenario
