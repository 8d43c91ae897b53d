from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch
from stable_baselines3 import PPO, SAC
from uas_coverage_agents.policy import Policy
from uas_coverage_agents.training.config import SacSettings, load_config
from uas_coverage_agents.training.scenarios import training_scenarios
from uas_coverage_agents.training.score import MEASURES, fly
from uas_coverage_agents.training.training_run import TrainingJob, TrainingRun
from uas_coverage_agents.training.vec_env import CoverageVecEnv
from uas_coverage_agents.training.velocity import DecidingMemory, VelocityVecEnv

from uas_coverage_env.env import observation_columns

TINY = str(Path(__file__).with_name("tiny.toml"))
FLYING = int(observation_columns("own", "flying")[0, 0])
RETURNING = int(observation_columns("own", "returning")[0, 0])


@pytest.fixture(scope="module")
def towns():
    return training_scenarios(load_config(TINY).scenarios, seed=0)


def lanes(towns, nearing: float = 0.0, gamma: float = 0.9) -> tuple[VelocityVecEnv, CoverageVecEnv]:
    bare = CoverageVecEnv(3, towns, return_mode=True, safety_filter=True)
    bare.seed(4)
    return VelocityVecEnv(bare, nearing, gamma), bare


def actions_of(env, seed: int = 0):
    rng = np.random.default_rng(seed)
    while True:
        yield rng.uniform(-1, 1, (env.num_envs, 3)).astype(np.float32)


def test_lanes_that_do_not_decide_show_zeros_and_pay_nothing(towns):
    env, bare = lanes(towns)
    view = env.reset()
    decided = view[:, FLYING] > 0
    handed_over = 0
    for _, actions in zip(range(400), actions_of(env), strict=False):
        view, rewards, ended, _ = env.step(actions)
        raw = bare.batch.observation.reshape(env.num_envs, -1)
        decides = (raw[:, FLYING] > 0) & (raw[:, RETURNING] == 0)
        assert np.array_equal(view, np.where(decides[:, None], raw, 0.0))
        assert (rewards[~decided] == 0.0).all()
        # what is learned ends with the last decision
        assert ended[decided & ~decides].all()
        handed_over += int((decided & ~decides & (raw[:, FLYING] > 0)).sum())
        decided = decides
    assert handed_over > 0, "return mode should have taken over some UAS"


def test_an_episode_that_the_clock_ends_is_over(towns):
    bare = CoverageVecEnv(2, towns, max_cycles=5)
    bare.seed(0)
    env = VelocityVecEnv(bare, 0.0, 0.9)
    env.reset()
    for _, actions in zip(range(5), actions_of(env), strict=False):
        _, _, ended, infos = env.step(actions)
    assert ended.all()
    assert not any(info["TimeLimit.truncated"] for info in infos)


def test_nearing_is_a_potential_and_adds_up_to_nothing_but_its_start(towns):
    gamma = 0.9
    (shaped, _), (plain, _) = lanes(towns, nearing=2.0, gamma=gamma), lanes(towns, gamma=gamma)
    shaped.reset()
    plain.reset()
    start = shaped._potential.copy()
    assert (start[start != 0.0] < 0.0).all()
    extra = np.zeros(shaped.num_envs)
    open_lanes = np.ones(shaped.num_envs, dtype=bool)
    for k, actions in zip(range(600), actions_of(shaped), strict=False):
        _, with_it, ended, _ = shaped.step(actions)
        _, without, _, _ = plain.step(actions)
        extra += np.where(open_lanes, gamma**k * (with_it - without), 0.0)
        open_lanes &= ~ended
        if not open_lanes.any():
            break
    assert not open_lanes.any()
    assert np.allclose(extra, -start, atol=1e-4)


def test_restored_lanes_go_on_where_they_were(towns):
    first, _ = lanes(towns, nearing=0.5)
    second, _ = lanes(towns, nearing=0.5)
    first.reset()
    for _, actions in zip(range(50), actions_of(first), strict=False):
        first.step(actions)
    second.load_state_dict(first.state_dict())
    for _, actions in zip(range(50), actions_of(first, seed=1), strict=False):
        one, other = first.step(actions), second.step(actions)
        for mine, yours in zip(one[:3], other[:3], strict=True):
            assert np.array_equal(mine, yours)


def test_only_decisions_are_learned_from():
    training_run = TrainingRun.untrained(TrainingJob("tiny", load_config(TINY), seed=0))
    assert isinstance(training_run.model, PPO)
    training_run.model.learn(64)
    buffer = training_run.model.rollout_buffer
    batches = list(buffer.get(batch_size=16))
    assert (torch.cat([batch.observations for batch in batches])[:, FLYING] == 1.0).all()
    decided = int((buffer.observations[:, FLYING] > 0).sum())
    assert decided < len(buffer.observations), "some lanes should have had no UAS in them"
    assert abs(sum(len(batch.observations) for batch in batches) - decided) <= 8


def test_sac_remembers_decisions_alone_and_what_came_of_them(towns):
    env, _ = lanes(towns)
    spaces = env.observation_space, env.action_space
    all_of_it = DecidingMemory(5000, *spaces, device="cpu", n_envs=env.num_envs)
    latest = DecidingMemory(100, *spaces, device="cpu", n_envs=env.num_envs)
    view = env.reset()
    happened = []
    for _, actions in zip(range(300), actions_of(env), strict=False):
        now, rewards, ended, infos = env.step(actions)
        for memory in (all_of_it, latest):
            memory.add(view, now, actions, rewards, ended, infos)
        step = zip(view, now, actions, rewards, ended, strict=True)
        happened.extend(sample for sample in step if sample[0][FLYING] > 0)
        view = now
    assert 100 < len(happened) < 300 * env.num_envs, "in some lanes, no UAS should have decided"
    names = ("observations", "next_observations", "actions", "rewards", "dones")
    for name, column in zip(names, map(np.array, zip(*happened, strict=True)), strict=True):
        assert np.array_equal(getattr(all_of_it, name)[: len(happened), 0], column)
        kept = np.roll(getattr(latest, name)[:, 0], -latest.pos, axis=0)
        assert np.array_equal(kept, column[-100:])
    assert all_of_it.dones.sum() > 0
    assert (latest.sample(500).observations[:, FLYING] == 1.0).all()


def test_at_the_start_of_sac_a_unit_of_entropy_is_worth_about_what_a_step_pays():
    config = load_config("sac", changes=["scenarios.pool=4", "num_envs=4"])
    training_run = TrainingRun.untrained(TrainingJob("sac", config, seed=0))
    assert isinstance(training_run.model, SAC)
    assert isinstance(config.learning, SacSettings)
    assert training_run.model.log_ent_coef is not None
    weight = float(training_run.model.log_ent_coef.detach().exp())
    assert weight == pytest.approx(config.learning.first_entropy)
    env = training_run.lanes
    view: Any = env.reset()
    paid = []
    for _, actions in zip(range(100), actions_of(env), strict=False):
        decided = view[:, FLYING] > 0
        view, rewards, _, _ = env.step(actions)
        paid.extend(np.abs(rewards[decided]))
    assert 0.2 < weight / np.mean(paid) < 5.0


@pytest.mark.parametrize("algorithm", ["ppo", "sac"])
def test_what_is_exported_decides_as_the_model_does(algorithm):
    changes = ["policy.hidden=[8, 8]"]
    if algorithm == "sac":
        config = load_config("sac", changes=[*changes, "scenarios.pool=1", "num_envs=1"])
    else:
        config = load_config(TINY, changes=changes)
    training_run = TrainingRun.untrained(TrainingJob(algorithm, config, seed=0))
    policy = training_run.policy()
    assert isinstance(policy, Policy)
    views = np.random.default_rng(0).uniform(
        -1, 1, (6, training_run.model.observation_space.shape[0])
    )
    expected, _ = training_run.model.predict(views.astype(np.float32), deterministic=True)
    assert np.allclose(np.clip(policy.forward(views), -1, 1), expected, atol=1e-5)


@pytest.mark.slow
def test_a_few_seconds_of_training_cover_far_more_than_none():
    changes = [
        "steps=120_000",
        "num_envs=16",
        "learning.rollout_steps=128",
        "learning.batch_size=2048",
        "learning.learning_rate=1e-3",
        "policy.hidden=[64, 64]",
        "scenarios.pool=16",
        "scenarios.family.towns.n_waypoints=[8, 12]",
    ]
    training_run = TrainingRun.untrained(
        TrainingJob("tiny", load_config(TINY, changes=changes), seed=0)
    )
    unseen = training_scenarios(load_config(TINY).scenarios, seed=77)
    before = training_run.flights(unseen)[:, MEASURES.index("coverage")].mean()
    training_run.model.learn(120_000)
    results = fly(training_run.policy(), unseen)
    assert before < 0.3
    assert results[:, MEASURES.index("coverage")].mean() > 0.8
    assert results[:, MEASURES.index("all_home")].all()
    assert not results[:, MEASURES.index("violations")].any()


@pytest.mark.slow
def test_a_quarter_of_a_minute_of_sac_covers_most_of_what_it_has_never_seen():
    changes = [
        "steps=15_000",
        "num_envs=8",
        "policy.hidden=[64, 64]",
        "scenarios.pool=16",
        "scenarios.family.towns.n_uas=[1, 2]",
        "scenarios.family.towns.n_waypoints=[8, 12]",
        "learning.first_samples=2_000",
        "learning.updates_per_step=2",
        "learning.batch_size=256",
    ]
    training_run = TrainingRun.untrained(
        TrainingJob("sac", load_config("sac", changes=changes), seed=0)
    )
    unseen = training_scenarios(load_config(TINY).scenarios, seed=77)
    before = training_run.flights(unseen)[:, MEASURES.index("coverage")].mean()
    training_run.model.learn(15_000)
    results = training_run.flights(unseen)
    assert before < 0.3
    assert results[:, MEASURES.index("coverage")].mean() > 0.8
    assert results[:, MEASURES.index("all_home")].all()
    assert not results[:, MEASURES.index("violations")].any()
