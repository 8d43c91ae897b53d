"""skrl: its wrappers, its multi-agent algorithms and its trainer."""

from dataclasses import fields
from typing import Any

import gymnasium
import numpy as np
import pytest
from libraries import SHORT, library

wrap_env = library("skrl.envs.wrappers.torch").wrap_env

import torch
from skrl.memories.torch import RandomMemory
from skrl.models.torch import DeterministicMixin, GaussianMixin, Model
from skrl.multi_agents.torch.ippo import IPPO, IPPO_CFG
from skrl.multi_agents.torch.mappo import MAPPO, MAPPO_CFG
from skrl.trainers.torch import SequentialTrainer
from supersuit import black_death_v3

from uas_coverage_env import uas_coverage_v0

STEPS = 40


class Policy(GaussianMixin, Model):
    def __init__(self, **spaces: Any) -> None:
        Model.__init__(self, device="cpu", **spaces)
        GaussianMixin.__init__(self)
        self.net = torch.nn.Linear(self.num_observations, self.num_actions)
        self.spread = torch.nn.Parameter(torch.zeros(self.num_actions))

    def compute(self, inputs, role=""):
        return self.net(inputs["observations"]), {"log_std": self.spread}


class Value(DeterministicMixin, Model):
    def __init__(self, **spaces: Any) -> None:
        Model.__init__(self, device="cpu", **spaces)
        DeterministicMixin.__init__(self)
        self.net = torch.nn.Linear(self.num_observations, 1)

    def compute(self, inputs, role=""):
        return self.net(inputs["observations"]), {}


def flown(**settings):
    """An environment as skrl sees it; its agents stay until the mission ends."""
    return wrap_env(black_death_v3(uas_coverage_v0.parallel_env(**SHORT, **settings)))


def learner(env, kind, config):
    """One network for each agent."""
    # skrl 2.1.1 takes its own defaults, empty dictionaries, for settings that lack the agents
    unset = {agent: {} for agent in env.possible_agents}
    names = [each.name for each in fields(config) if each.name.endswith("_kwargs")]
    cfg = config(rollouts=16, **{name: dict(unset) for name in names})
    models, memories = {}, {}
    for agent in env.possible_agents:
        spaces = {
            "observation_space": env.observation_spaces[agent],
            "state_space": env.state_spaces[agent],
            "action_space": env.action_spaces[agent],
        }
        models[agent] = {"policy": Policy(**spaces), "value": Value(**spaces)}
        memories[agent] = RandomMemory(memory_size=16, num_envs=1, device="cpu")
    cfg.experiment.write_interval = cfg.experiment.checkpoint_interval = 0
    return kind(
        possible_agents=env.possible_agents,
        models=models,
        memories=memories,
        observation_spaces=env.observation_spaces,
        state_spaces=env.state_spaces,
        action_spaces=env.action_spaces,
        device="cpu",
        cfg=cfg,
    )


@pytest.mark.parametrize("wrapper", ["auto", "pettingzoo"])
def test_a_wrapped_environment_tells_its_spaces_and_flies_a_mission(wrapper):
    own = uas_coverage_v0.parallel_env(**SHORT)
    env = wrap_env(own, wrapper=wrapper)
    for agent in own.possible_agents:
        assert env.observation_spaces[agent] is own.observation_space(agent)
        assert env.action_spaces[agent] is own.action_space(agent)
    observations, _ = env.reset()
    steps = 0
    while env.agents:
        assert {agent: seen.shape for agent, seen in observations.items()} == dict.fromkeys(
            own.possible_agents, (1, 234)
        )
        actions = {agent: torch.zeros(1, 3) for agent in env.agents}
        observations, rewards, _, truncated, _ = env.step(actions)
        assert all(paid.isfinite().all() for paid in rewards.values())
        steps += 1
    assert steps == 12
    assert all(cut.all() for cut in truncated.values())


@pytest.mark.parametrize(("kind", "config"), [(IPPO, IPPO_CFG), (MAPPO, MAPPO_CFG)])
@pytest.mark.parametrize("action", ["velocity", "wrench"])
def test_its_trainer_flies_missions_and_learns(kind, config, action, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    torch.manual_seed(0)
    env = flown(action=action)
    agents = learner(env, kind, config)
    before = {a: agents.policies[a].net.weight.clone() for a in env.possible_agents}
    begun = []
    reset = env.reset
    monkeypatch.setattr(env, "reset", lambda: begun.append(True) or reset())
    chosen = {"timesteps": STEPS, "headless": True, "disable_progressbar": True}
    SequentialTrainer(
        env=env, agents=agents, cfg={**chosen, "close_environment_at_exit": False}
    ).train()
    assert len(begun) > STEPS // 13
    for agent, weights in before.items():
        now = agents.policies[agent].net.weight
        assert now.isfinite().all()
        assert not torch.equal(now, weights)


def test_the_swarm_as_one_agent_and_many_missions_fly():
    single = wrap_env(gymnasium.make("UASCoverage-v0", **SHORT))
    many = wrap_env(
        gymnasium.make_vec(
            "UASCoverage-v0", num_envs=3, vectorization_mode="vector_entry_point", **SHORT
        )
    )
    for env, lanes in ((single, 1), (many, 3)):
        env.reset()
        ended = np.zeros(lanes, bool)
        for _ in range(12):
            seen, paid, terminated, truncated, _ = env.step(torch.zeros(lanes, 6))
            ended |= (terminated | truncated).numpy().ravel()
        assert seen.shape == (lanes, 468)
        assert paid.isfinite().all()
        assert ended.all()
