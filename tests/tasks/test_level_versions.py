"""Levels of other versions of the environments: the same missions, seen and paid otherwise."""

import pickle

import gymnasium
import numpy as np
import pettingzoo
import pytest

from uas_coverage_env import registration, uas_coverage_v1
from uas_coverage_env.env import CoverageBatch, MissionSettings
from uas_coverage_env.env.versions import V0, V1, version_named
from uas_coverage_env.flight import as_planner
from uas_coverage_env.tasks import LEVELS, level_named, parallel_env
from uas_coverage_env.tasks.levels import level_names
from uas_coverage_env.tasks.scoring import entry_of, spec_of


def test_every_level_is_there_in_every_version_under_an_id_that_says_it():
    ids = {level_named(name).id for name in level_names()}
    assert len(ids) == len(LEVELS) * len(registration.version_names())
    assert {"UASCoverage/Hard-v0", "UASCoverage/Hard-v1"} <= ids <= gymnasium.registry.keys()
    if hasattr(pettingzoo, "make"):
        assert "uas/coverage-hard-v1" in pettingzoo.parallel_registry


def test_its_missions_are_those_of_the_first_version():
    first, second = level_named("hard"), level_named("hard-v1")
    assert (first.name, second.name) == ("hard", "hard-v1")
    assert (first.version, second.version) == (V0, V1)
    assert second.scenarios("test", 2) == first.scenarios("test", 2)


def test_its_environments_are_of_its_version_whatever_their_interface():
    env = parallel_env("easy-v1")
    assert env.metadata["name"] == "uas_coverage_v1"
    assert pickle.loads(pickle.dumps(env)).version is V1
    assert gymnasium.make("UASCoverage/Easy-v1").unwrapped.version is V1
    many = gymnasium.make_vec("UASCoverage/Easy-v1", 2, vectorization_mode="vector_entry_point")
    assert many.unwrapped.version is V1
    task = level_named("easy-v1")
    batch = CoverageBatch(1, task.missions(), **task.settings())
    assert batch.settings.version is V1
    seen, _ = env.reset(seed=3)
    assert np.array_equal(batch.reset(3)[0], np.stack(list(seen.values())))


def test_its_reward_is_what_its_flights_are_recorded_with():
    task = level_named("hard-v1")
    entry = entry_of(spec_of("random", task), task, 1, task.scenario(1))
    assert (entry.level, entry.environment) == ("hard-v1", V1)
    assert pickle.loads(pickle.dumps(entry)).environment is V1


def test_a_policy_sees_what_the_level_of_its_version_shows():
    task = level_named("hard-v1")
    sizes = []
    planner = as_planner(lambda seen: sizes.append(seen.size) or np.zeros(3), **task.settings())
    assert planner.assistants is not None
    assert MissionSettings.of(task.settings()).version is V1
    assert MissionSettings.of(task.settings()).flat_infos


def test_settings_of_another_version_are_refused_by_an_environment_of_one():
    with pytest.raises(ValueError, match="take that of uas_coverage_v1"):
        MissionSettings.of({"version": V1}, V0)
    with pytest.raises(ValueError, match="level is 'hard-v9'; it is one of easy"):
        level_named("hard-v9")
    with pytest.raises(ValueError, match="version is 'v9'; it is one of v0, v1"):
        version_named("v9")


def test_environments_in_turns_and_many_at_once_have_the_version_too():
    turns = uas_coverage_v1.env("village")
    turns.reset(seed=0)
    assert turns.unwrapped.metadata["name"] == "uas_coverage_v1"
    assert uas_coverage_v1.vector_env(2, "village").version is V1
    assert pickle.loads(pickle.dumps(uas_coverage_v1.env)) is uas_coverage_v1.env
