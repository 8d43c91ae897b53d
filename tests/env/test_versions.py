"""A version of the environments is a set of tuples: they act everywhere, and beside the others."""

import dataclasses
import importlib
import inspect
import json
import os
import pickle
import subprocess
import sys
import textwrap
from dataclasses import fields
from typing import Any

import gymnasium
import numpy as np
import pytest
from own_blocks import beacon
from practice_grounds import practice_ground

import uas_coverage_env
from uas_coverage_env import MissionBrief, registration, uas_coverage_v0, uas_coverage_v1
from uas_coverage_env.compiled.kernels import kernel
from uas_coverage_env.env import (
    ACTIONS,
    OBSERVATION,
    OBSERVATION_SIZE,
    REWARD,
    CoverageBatch,
    CoverageSwarmEnv,
    CoverageVectorEnv,
    MissionSettings,
    RewardTerm,
)
from uas_coverage_env.env.api.parallel import CoverageParallelEnv
from uas_coverage_env.env.episode.settings import MissionKeywords, inside_name
from uas_coverage_env.env.policy.interface import MissionInterface
from uas_coverage_env.env.report import FILTERED, FIRST_TERM, INFOS, InfoField
from uas_coverage_env.env.report import REWARD as REWARD_COLUMN
from uas_coverage_env.env.versions import V0, Version


@kernel
def _hurry(arena, state, tables, learners, scratch, i, parameters):
    return -parameters[0] * state.step[0]


HURRY = RewardTerm("hurry", 0.5, "minus the sample, times a number", _hurry, (0.25,))
BEACON = beacon(1.0, 2.0)
NEXT = Version(
    "v7", (*OBSERVATION, BEACON), (*REWARD, HURRY), ACTIONS, infos=INFOS[:1], flat_infos=True
)


class NextParallelEnv(CoverageParallelEnv):
    version = NEXT


class NextSwarmEnv(CoverageSwarmEnv):
    version = NEXT


class NextVectorEnv(CoverageVectorEnv):
    version = NEXT


def flown(env, steps=5, seed=3):
    """Observations, rewards and infos of a few steps of random actions."""
    rng = np.random.default_rng(seed)
    observations, infos = env.reset(seed=1)
    seen, paid = [observations], []
    for _ in range(steps):
        actions = {a: rng.uniform(-1, 1, 3).astype(np.float32) for a in env.agents}
        observations, rewards, _, _, infos = env.step(actions)
        seen.append(observations)
        paid.append(rewards)
    return seen, paid, infos


def test_what_is_in_the_tuples_of_a_version_is_observed_and_paid():
    env = NextParallelEnv(practice_ground())
    seen, paid, infos = flown(env)
    agent = env.agents[0]
    assert env.observation_space(agent).shape == (OBSERVATION_SIZE + BEACON.size,)
    assert 0.4 < seen[-1][agent][OBSERVATION_SIZE] < 0.5
    assert infos[agent]["reward_terms_hurry"] == -0.5 * 0.25 * 5
    old_seen, old_paid, _ = flown(uas_coverage_v0.parallel_env(practice_ground()))
    for k in range(5):
        assert np.array_equal(seen[k][agent][:OBSERVATION_SIZE], old_seen[k][agent])
        assert paid[k][agent] == old_paid[k][agent] - 0.5 * 0.25 * (k + 1)


def test_a_batch_flies_them_as_one_environment_does():
    env = NextParallelEnv(practice_ground())
    batch = CoverageBatch(3, practice_ground(), version=NEXT)
    rng = np.random.default_rng(3)
    env.reset(seed=1)
    batch.reset(1)
    for _ in range(5):
        rows = [rng.uniform(-1, 1, 3).astype(np.float32) for _ in env.agents]
        seen, paid, *_ = env.step(dict(zip(env.agents, rows, strict=True)))
        rows = batch.step(np.stack([np.stack(rows)] * 3))
        for i, agent in enumerate(env.agents):
            assert np.array_equal(rows[2, i], seen[agent])
            assert batch.lanes.rewards[2, i] == paid[agent]


def test_planners_observe_what_they_observe():
    env = NextParallelEnv(practice_ground())
    seen, _ = env.reset(seed=0)
    interface = MissionInterface(MissionBrief.of(env.scenario), MissionSettings(version=NEXT))
    rows = interface.observe(env.swarm_state())
    assert all(np.array_equal(rows[i], seen[a]) for i, a in enumerate(env.agents))


@pytest.mark.parametrize("kind", [NextSwarmEnv, NextVectorEnv])
def test_the_other_environments_have_them_too(kind):
    env = kind(scenario=practice_ground())
    size = OBSERVATION_SIZE + BEACON.size
    seen, _ = env.reset(seed=0)
    assert (
        seen.shape[-1] == size * len(env.unwrapped.call("scenario")[0].uas)
        if hasattr(env, "num_envs")
        else seen.size % size == 0
    )
    action = env.action_space.sample()
    *_, infos = env.step(action)
    assert np.all(np.asarray(infos["reward_terms_hurry"]) < 0.0)


def test_infos_are_those_of_the_version():
    _, _, infos = flown(NextParallelEnv(practice_ground()), steps=1)
    terms = [f"reward_terms_{term.name}" for term in NEXT.reward]
    assert all(list(info) == ["status", *terms] for info in infos.values())
    *_, told = NextVectorEnv(2, practice_ground()).reset(seed=0)
    assert {"status", "scenario", "reward_terms_hurry"} <= told.keys()
    assert not {"contact", "covered", "energy_Wh"} & told.keys()
    *_, told = NextSwarmEnv(practice_ground()).reset(seed=0)
    assert "covered" not in told


def test_what_is_told_of_amounts_is_told_of_the_swarm_as_their_sum():
    paid = InfoField("paid", "reward of the step", REWARD_COLUMN, of_amounts=True)
    late = InfoField("hurry", "the same as the term", FIRST_TERM + len(REWARD), of_amounts=True)
    filtered = InfoField("filtered_now", "of the first", FILTERED, of_swarm=True, flag=True)
    version = dataclasses.replace(NEXT, infos=(*INFOS, paid, late, filtered))
    kinds = {"version": version}
    single = type("Single", (CoverageSwarmEnv,), kinds)(practice_ground())
    many = type("Many", (CoverageVectorEnv,), kinds)(2, practice_ground())
    single.reset(seed=0)
    many.reset(seed=0)
    action = np.full(single.action_space.shape, 0.3, np.float32)
    _, reward, *_, one = single.step(action)
    _, rewards, *_, all_ = many.step(np.stack([action] * 2))
    assert one["paid"] == all_["paid"][1] == reward == rewards[1]
    assert one["hurry"] == all_["hurry"][0] == one["reward_terms_hurry"] < 0.0
    assert one["energy_Wh"] == all_["energy_Wh"][0] > 0.0
    assert (one["filtered_now"], all_["filtered_now"].tolist()) == (False, [False, False])


def test_what_python_alone_flies_is_the_same(tmp_path):
    code = (
        "import json; from test_versions import NextParallelEnv, flown;"
        "from practice_grounds import practice_ground;"
        "seen, paid, infos = flown(NextParallelEnv(practice_ground()), steps=2);"
        "print(json.dumps([{a: r.tolist() for a, r in seen[-1].items()}, paid[-1]]))"
    )
    folder = os.path.dirname(__file__)
    path = os.pathsep.join([folder, os.path.dirname(folder), *sys.path])
    environment = {**os.environ, "NUMBA_DISABLE_JIT": "1", "PYTHONPATH": path}
    ran = subprocess.run(
        [sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=True
    )
    seen, paid, _ = flown(NextParallelEnv(practice_ground()), steps=2)
    there, pay = json.loads(ran.stdout)
    assert {a: r.tolist() for a, r in seen[-1].items()} == there
    assert paid[-1] == pay


def test_docstrings_say_what_the_version_has():
    assert NextParallelEnv.__doc__ is not None
    assert f"| {HURRY.name} | 0.5 |" in NextParallelEnv.__doc__
    assert f"{BEACON.name}." in NextParallelEnv.__doc__
    assert HURRY.name not in (CoverageParallelEnv.__doc__ or "").split()
    assert NextParallelEnv.metadata["name"] == "uas_coverage_v7"
    assert CoverageParallelEnv.metadata["name"] == "uas_coverage_v0"


@pytest.mark.parametrize("margin", [0, 4])
def test_tables_of_a_docstring_are_as_far_in_as_their_place(margin):
    """Compilers strip the indentation of docstrings from Python 3.13 on."""
    text = textwrap.indent("Head.\n\nInfos:\n    {infos}\n    - last", " " * margin)
    made = type("Described", (CoverageParallelEnv,), {"__doc__": text})
    entries = [line for line in str(made.__doc__).splitlines() if line.lstrip().startswith("- ")]
    assert len(entries) > 5
    assert {len(line) - len(line.lstrip()) for line in entries} == {margin + 4}


def test_an_environment_of_a_version_can_be_pickled():
    assert pickle.loads(pickle.dumps(MissionSettings())).version is V0
    there = pickle.loads(pickle.dumps(NextParallelEnv(practice_ground())))
    here = NextParallelEnv(practice_ground())
    assert type(there).version == NEXT
    for one, other in zip(flown(there)[0], flown(here)[0], strict=True):
        assert all(np.array_equal(one[agent], other[agent]) for agent in one)


@pytest.mark.parametrize(
    "door",
    [
        uas_coverage_v0.parallel_env,
        uas_coverage_v0.env,
        uas_coverage_v0.raw_env,
        uas_coverage_v0.vector_env,
        uas_coverage_v1.env,
        uas_coverage_v1.raw_env,
        uas_coverage_v1.vector_env,
        CoverageBatch,
        CoverageSwarmEnv,
        CoverageVectorEnv,
    ],
)
def test_every_setting_is_in_signature_and_docstring(door):
    parameters = inspect.signature(door).parameters
    text = inspect.getdoc(door) or ""
    for name, kind in MissionKeywords.__annotations__.items():
        assert parameters[name].annotation == kind
        assert f"{name}: " in text
    assert all(each.kind != each.VAR_KEYWORD for each in parameters.values())


def test_what_makes_environments_is_of_its_own_version_and_can_be_pickled():
    ground = practice_ground()
    for module in (uas_coverage_v0, uas_coverage_v1):
        for door in (module.env, module.raw_env, module.vector_env):
            assert pickle.loads(pickle.dumps(door)) is door
        assert module.vector_env(2, ground).version is module.VERSION
        assert module.env(ground).unwrapped.version is module.VERSION
    for name, value, words in (("speed", 3, "argument 'speed'"), ("device", "tpu", "is 'tpu'")):
        wrong: Any = {name: value}
        with pytest.raises(ValueError, match=words):
            uas_coverage_v1.vector_env(2, ground, **wrong)


def test_every_setting_is_a_keyword_argument():
    keywords = {inside_name(name) for name in MissionKeywords.__annotations__}
    assert keywords | {"version"} == {field.name for field in fields(MissionSettings)}


def test_the_short_way_to_many_missions_is_the_fast_one():
    short = uas_coverage_v0.vector_env(3, practice_ground(), action="waypoint")
    long = gymnasium.make_vec("UASCoverage-v0", 3, scenario=practice_ground(), action="waypoint")
    assert type(short) is type(long.unwrapped) is CoverageVectorEnv
    assert np.array_equal(short.reset(seed=4)[0], long.reset(seed=4)[0])


def test_a_version_that_is_gone_names_the_one_that_follows(monkeypatch):
    monkeypatch.setattr(registration, "version_names", lambda: ("v8", "v9"))
    with pytest.raises(ImportError, match="uas_coverage_v7 is gone; take uas_coverage_v8"):
        exec("from uas_coverage_env import uas_coverage_v7")
    with pytest.raises(AttributeError, match="uas_coverage_v10"):
        _ = uas_coverage_env.uas_coverage_v10


def test_missions_that_have_ended_wait_where_they_rest():
    ground = practice_ground()
    batch = CoverageBatch(2, [ground, ground], autoreset="rest", max_cycles=3)
    batch.reset(0)
    still = np.zeros((2, batch.n_uas, 3))
    for _ in range(3):
        seen = batch.step(still).copy()
    assert (batch.lanes.truncated | batch.lanes.terminated).all()
    energy_Wh = batch.lanes.swarm[:, 0].copy()
    again = batch.step(still)
    assert np.array_equal(seen, again)
    assert not batch.lanes.rewards.any()
    assert not batch.lanes.swarm[:, 2:].any()
    assert np.array_equal(batch.lanes.swarm[:, 0], energy_Wh)
    assert batch.lanes.truncated.all()
    batch.reset(mask=np.array([True, False]))
    assert batch.lanes.truncated.tolist() == [False, True]


def test_every_version_has_a_module_and_ids():
    assert registration.version_names()[0] == "v0"
    for name in registration.version_names():
        module = importlib.import_module(f"uas_coverage_env.uas_coverage_{name}")
        assert module.parallel_env.version is module.swarm_env.version is module.VERSION
        assert module.VERSION.name == name
        assert f"UASCoverage-{name}" in gymnasium.registry
