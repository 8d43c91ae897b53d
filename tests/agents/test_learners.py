"""Learners of libraries and of one's own: trained in rounds, put aside and flown."""

import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
import torch
from gymnasium import spaces
from safetensors import numpy as safetensors
from tiny_trainings import tiny
from uas_coverage_agents.policy import load_policy
from uas_coverage_agents.training import curve
from uas_coverage_agents.training.central_critic import CentralCriticPolicy
from uas_coverage_agents.training.checkpoint import CHECKPOINT
from uas_coverage_agents.training.learner import Told
from uas_coverage_agents.training.library import LibraryLearner
from uas_coverage_agents.training.missions import Missions
from uas_coverage_agents.training.policy_runner import EnvironmentRunner
from uas_coverage_agents.training.rounds import TrainingJob, TrainingProgress, learner_of, train

from uas_coverage_env import MissionBrief, generate_scenario, load_planner, rollout
from uas_coverage_env.env import CoverageParallelEnv
from uas_coverage_env.files.strict_toml import InputError
from uas_coverage_env.flight import Assistants
from uas_coverage_env.mission import first_sight
from uas_coverage_env.tasks import score

OWN = '''
import numpy as np
from stable_baselines3 import PPO
from stable_baselines3.common.buffers import RolloutBuffer
from stable_baselines3.common.policies import ActorCriticPolicy


class Search:
    """Keeps the best of random linear policies."""

    def __init__(self, policy, env, seed=0, device="cpu", spread=0.1):
        self.env, self.spread, self.num_timesteps = env, spread, 0
        self.rng = np.random.default_rng(seed)
        self.weights = np.zeros((env.observation_space.shape[0], env.action_space.shape[0]))
        self.best = -np.inf

    def learn(self, total_timesteps, reset_num_timesteps=False):
        end = self.num_timesteps + total_timesteps
        while self.num_timesteps < end:
            tried = self.weights + self.rng.normal(0.0, self.spread, self.weights.shape)
            seen, paid = self.env.reset(), 0.0
            for _ in range(8):
                action = np.clip(seen @ tried, -1, 1).astype(np.float32)
                seen, rewards, _, _ = self.env.step(action)
                paid += rewards.sum()
                self.num_timesteps += self.env.num_envs
            if paid > self.best:
                self.best, self.weights = float(paid), tried

    def predict(self, observation, state=None, episode_start=None, deterministic=True):
        return np.clip(observation @ self.weights, -1, 1).astype(np.float32), None

    def state_dict(self):
        return {"weights": self.weights, "best": np.array(self.best)}

    def load_state_dict(self, state):
        self.weights, self.best = state["weights"], float(state["best"])


class Counting(PPO):
    """PPO that remembers one number more."""

    updates = 0

    def train(self):
        super().train()
        self.updates += 1

    def state_dict(self):
        return {"updates": np.array(self.updates)}

    def load_state_dict(self, state):
        self.updates = int(state["updates"])


class Choosy:
    """Takes the first choice that the mask allows, and says how often it was asked."""

    def __init__(self, policy, env, seed=0, device="cpu"):
        self.env, self.num_timesteps = env, 0

    def learn(self, total_timesteps, reset_num_timesteps=False):
        self.env.reset()
        self.num_timesteps += total_timesteps

    def predict(self, observation, state=None, episode_start=None, deterministic=True,
                action_masks=None):
        begins = state is None
        assert bool(np.all(episode_start)) == begins
        return np.int64(np.argmax(action_masks)), 1 if begins else state + 1

    def state_dict(self):
        return {}

    def load_state_dict(self, state):
        pass


class Half(RolloutBuffer):
    """Leaves out every second sample."""

    taken = []

    def get(self, batch_size=None):
        for batch in super().get(batch_size):
            self.taken.append(len(batch.observations) // 2)
            yield type(batch)(*(part[::2] for part in batch))


class Wide(ActorCriticPolicy):
    """A policy of one's own."""

    def __init__(self, *args, width=4, **kwargs):
        super().__init__(*args, net_arch=[width], **kwargs)
'''


@pytest.fixture(autouse=True)
def curve_without_picture(monkeypatch):
    """To draw it takes longer than to learn."""
    monkeypatch.setattr(curve, "write", curve.write_table)


@pytest.fixture
def own(tmp_path, monkeypatch) -> Iterator[Path]:
    """A folder with a file of one's own, in which the program is called."""
    (tmp_path / "my_learners.py").write_text(OWN)
    monkeypatch.chdir(tmp_path)
    yield tmp_path
    sys.modules.pop("my_learners", None)


def trained(settings, directory: Path, seed: int = 3):
    (policy,) = train({directory: TrainingJob("tiny", settings, seed, missions=1)}).values()
    return policy


def killed(settings, directory: Path, seed: int = 3) -> None:
    """Ends after the first round."""

    def kill(progress: TrainingProgress) -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        train({directory: TrainingJob("tiny", settings, seed, missions=1)}, on_progress=kill)


@pytest.mark.parametrize("name", ["ppo", "tqc", "trpo", "recurrent-ppo"])
def test_a_training_that_was_killed_goes_on_to_the_same_weights(name, tmp_path):
    whole = trained(tiny(name), tmp_path / "whole")
    killed(tiny(name), tmp_path / "killed")
    assert not (tmp_path / "killed" / "policy").exists()
    after = trained(tiny(name), tmp_path / "killed")
    assert after.description.training.steps == whole.description.training.steps >= 64
    assert after.description.weights_sha256 == whole.description.weights_sha256
    one, other = (safetensors.load_file(tmp_path / k / CHECKPOINT) for k in ("whole", "killed"))
    assert one.keys() == other.keys()
    assert all(np.array_equal(one[name], other[name]) for name in one)


@pytest.mark.parametrize("name", ["my_learners:Search", "my_learners:Counting"])
def test_a_class_of_ones_own_trains_goes_on_and_flies_without_an_edit(name, own):
    settings = tiny(name, "environment.action=velocity")
    if name.endswith("Counting"):
        settings = tiny(name, "environment.action=velocity", "learning.n_steps=16")
    whole = trained(settings, own / "whole")
    killed(settings, own / "killed")
    after = trained(settings, own / "killed")
    assert after.description.weights_sha256 == whole.description.weights_sha256
    one, other = (safetensors.load_file(own / k / CHECKPOINT) for k in ("whole", "killed"))
    assert all(np.array_equal(one[each], other[each]) for each in one)
    if name.endswith("Counting"):
        assert one["own/updates"] == 2
    with pytest.raises(InputError, match=r"flies by my_learners:\w+.*--option trust=true"):
        load_planner(f"policy:{own / 'whole' / 'policy'}")
    planner = load_planner(f"policy:{own / 'whole' / 'policy'}", {"trust": "true"})
    assert score(planner, "easy", missions=1).mean("episode_return") != 0.0


def test_a_policy_of_a_class_that_is_not_trusted_imports_nothing(own):
    trained(tiny("my_learners:Search", "environment.action=velocity"), own / "run")
    del sys.modules["my_learners"]
    with pytest.raises(InputError, match="trust=true"):
        load_planner(f"policy:{own / 'run' / 'policy'}")
    assert "my_learners" not in sys.modules


def test_masks_are_shown_and_what_is_remembered_is_given_back_to_learners_that_take_them(own):
    settings = tiny("my_learners:Choosy", "agent=each", scenario="medium")
    settings = settings.model_copy(
        update={"environment": settings.environment.model_copy(update={"action": "waypoint"})}
    )
    policy = trained(settings, own / "run")
    runner = EnvironmentRunner(policy, Assistants(), trust=True)
    brief = MissionBrief.of(generate_scenario(4, n_uas=2, n_waypoints=5, n_obstacles=0))
    swarm = first_sight(brief)
    for _ in range(2):  # a mission begins with nothing in mind
        runner.reset(brief, 0)
        for asked in (1, 2, 3):
            assert set(runner.act(swarm)) == set(swarm.active)
            assert runner._memories == dict.fromkeys(swarm.active, asked)


def test_a_policy_with_a_memory_begins_each_mission_with_nothing_in_mind(tmp_path):
    trained(tiny("recurrent-ppo"), tmp_path)
    planner = load_planner(f"policy:{tmp_path / 'policy'}")
    returns = [score(planner, "easy", missions=1).mean("episode_return") for _ in range(2)]
    assert returns[0] == returns[1]


def test_a_buffer_and_a_network_of_ones_own_are_named_in_the_settings(own):
    changes = ["learning.rollout_buffer_class=my_learners:Half", "policy=my_learners:Wide",
               "learning.policy_kwargs.width=3",
               "learning.policy_kwargs.activation_fn=torch.nn:ReLU"]  # fmt: skip
    policy = trained(tiny("ppo", *changes), own / "run")
    shapes = policy.description.network.shapes()
    assert shapes["mlp_extractor.policy_net.0.weight"][0] == 3
    assert set(sys.modules["my_learners"].Half.taken) == {8}
    assert load_planner(f"policy:{own / 'run' / 'policy'}", {"trust": "true"})


def test_a_policy_flies_as_its_actions_do_in_the_environment(tmp_path):
    trained(tiny("ippo", "environment.action=velocity", scenario="generated"), tmp_path)
    planner = load_planner(f"policy:{tmp_path / 'policy'}")
    scenario = generate_scenario(900_501, n_uas=2, n_waypoints=5, n_obstacles=2)
    flight = rollout(scenario, planner, max_steps=40)
    env = CoverageParallelEnv(scenario, return_mode=True, safety_filter=True)
    seen, _ = env.reset()
    positions_m = [env.swarm_state().x[:, :3]]
    for _ in range(40):
        model = planner._runner.model
        actions = {agent: model.predict(seen[agent], deterministic=True)[0] for agent in env.agents}
        seen, *_ = env.step(actions)
        positions_m.append(env.swarm_state().x[:, :3])
    assert np.array_equal(flight.x[:, :, :3], positions_m)


def test_two_trainings_side_by_side_come_to_what_each_comes_to_by_itself(tmp_path):
    settings = tiny("ppo")
    jobs = {tmp_path / f"seed-{k}": TrainingJob("tiny", settings, k, missions=1) for k in (0, 1)}
    both = train(jobs)
    alone = trained(settings, tmp_path / "alone", seed=1)
    hashes = [policy.description.weights_sha256 for policy in both.values()]
    assert hashes[0] != hashes[1] == alone.description.weights_sha256


def test_settings_that_do_not_fit_the_class_are_refused_in_a_line(tmp_path):
    for settings, words in (
        (tiny("ppo", "learning.gama=1.0"), "gama"),
        (tiny("tqc", "environment.action=waypoint"), "see .* environment.action"),
        (tiny("ippo", "critic=full", "policy=CnnPolicy"), 'critic = "full"'),
    ):
        with pytest.raises(InputError, match=words) as caught:
            learner_of(settings, Missions.of(settings), 0)
        assert "\n" not in str(caught.value)


def test_the_state_of_another_learner_is_refused_in_a_line(tmp_path):
    def made(name, *changes):
        settings = tiny(name, *changes)
        return learner_of(settings, Missions.of(settings), 0)

    state = made("ppo").state_dict()
    for other in (made("ppo", "learning.policy_kwargs.net_arch=[8]"), made("sac")):
        with pytest.raises(InputError, match="does not fit this learner") as caught:
            other.load_state_dict(state)
        assert "\n" not in str(caught.value)
    spoilt = state | {name: array * np.nan for name, array in state.items() if "value_net" in name}
    with pytest.raises(InputError, match="does not fit this learner"):
        made("ppo").load_state_dict(spoilt)


def test_what_is_remembered_goes_into_the_state_as_far_as_it_is_filled():
    settings = tiny("sac")
    learner = learner_of(settings, Missions.of(settings), 0)
    assert isinstance(learner, LibraryLearner)
    told = Told()
    learner.learn(0, told)
    state = learner.state_dict()
    rows = learner.steps // 2
    assert state["memory/observations"].shape[0] == rows < 500
    assert {"memory/actions", "memory/rewards", "ent_coef_optimizer/0/exp_avg"} <= state.keys()
    other = learner_of(settings, Missions.of(settings), 1)
    other.load_state_dict(state)
    assert other.steps == learner.steps
    buffers = [each.model.replay_buffer for each in (learner, other)]
    assert np.array_equal(*(buffer.observations[:rows] for buffer in buffers))


def test_a_central_critic_sees_the_whole_mission_and_the_actor_does_not():
    space = spaces.Box(-1.0, 1.0, (20,), np.float32)
    policy = CentralCriticPolicy(space, spaces.Box(-1.0, 1.0, (3,)), lambda _: 1e-3, actor_size=12)
    seen = torch.as_tensor(np.stack([space.sample(), space.sample()]))
    seen[1, :12] = seen[0, :12]
    actions = policy.get_distribution(seen).mode()
    values = policy.predict_values(seen)
    torch.testing.assert_close(actions[0], actions[1], rtol=0.0, atol=1e-6)
    assert abs(values[0] - values[1]) > 1e-3


def test_each_uas_is_a_lane_and_a_central_critic_sees_more():
    def learner(name):
        settings = tiny(name, scenario="medium")
        return learner_of(settings, Missions.of(settings), 0)

    ippo, mappo = learner("ippo"), learner("mappo")
    assert ippo.env.num_envs == 2 * 3
    assert mappo.env.observation_space.shape > ippo.env.observation_space.shape


def test_a_changed_observation_or_class_is_refused_before_it_flies(tmp_path):
    policy = trained(tiny("ppo"), tmp_path)
    described = policy.description
    other = described.observation.model_copy(update={"scales": {"ray_m": 81.0}})
    for update, words in (
        ({"observation": other}, "its observation is not that of this version"),
        ({"training": described.training.model_copy(update={"settings": {"a": 1}})}, "a: unknown"),
    ):
        changed = type(policy)(described.model_copy(update=update), policy.tensors)
        with pytest.raises((InputError, ValueError), match=words):
            EnvironmentRunner(changed, Assistants())
    assert load_policy(tmp_path / "policy").description == described
