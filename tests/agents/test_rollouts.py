"""What learners of Stable-Baselines3 learn from: rows that hold a decision, and no others."""

import numpy as np
import pytest
from tiny_trainings import tiny
from uas_coverage_agents.training.learner import Told
from uas_coverage_agents.training.library import LibraryLearner
from uas_coverage_agents.training.missions import Missions
from uas_coverage_agents.training.rounds import learner_of

from uas_coverage_env.env import observation_columns
from uas_coverage_env.scenario import generate_scenario

pytest.importorskip("stable_baselines3")

import torch
from sb3_contrib import TRPO, MaskablePPO
from stable_baselines3 import A2C, PPO, SAC
from stable_baselines3.common.buffers import RolloutBuffer
from stable_baselines3.common.vec_env import VecNormalize
from uas_coverage_agents.training.rollouts import (
    FlownDictRolloutBuffer,
    FlownMaskableRolloutBuffer,
    FlownRolloutBuffer,
    FlownSteps,
)
from uas_coverage_agents.training.vec_env import CoverageVecEnv

# of one and of three UAS: two lanes in five hold nothing from the first step on
TOWNS = tuple(
    generate_scenario(1_000_000 + n, n_uas=n, n_waypoints=10, n_obstacles=3) for n in (1, 3)
)
FLYING = int(observation_columns("own", "flying")[0, 0])

torch.set_num_threads(1)


class Watched(CoverageVecEnv):
    """Remembers which lanes flew, from what they say of themselves before each step."""

    def __init__(self, *args, **settings):
        super().__init__(*args, **settings)
        self.flights = []

    def step_wait(self):
        self.flights.append(self.alive)
        return super().step_wait()


def environment(**settings):
    return Watched(4, TOWNS, **{"max_cycles": 40, **settings})


def learned(algorithm, buffer, env, steps=600, **settings):
    given = {"n_steps": 64, "seed": 0, "device": "cpu", "rollout_buffer_class": buffer, **settings}
    model = algorithm("MlpPolicy", env, **given)
    return model.learn(steps, callback=FlownSteps())


@pytest.mark.parametrize(
    ("algorithm", "settings", "passes"),
    [(PPO, {"n_epochs": 3}, 3), (A2C, {}, 1), (TRPO, {"n_critic_updates": 2}, 1 + 2)],
)
def test_a_learner_is_given_the_decisions_of_a_rollout_and_nothing_else(
    algorithm, settings, passes, monkeypatch
):
    given = []
    get = FlownRolloutBuffer.get
    monkeypatch.setattr(
        FlownRolloutBuffer,
        "get",
        lambda self, batch_size: (
            given.append(batch.observations) or batch for batch in get(self, batch_size)
        ),
    )
    env = environment()
    model = learned(algorithm, FlownRolloutBuffer, env, steps=200, **settings)
    rows = torch.cat(given)
    assert (rows[:, FLYING] == 1.0).all()
    flown = int(np.sum(env.flights))
    assert 0 < flown < 0.7 * np.size(env.flights)
    assert model.num_timesteps == flown
    assert len(rows) == passes * flown


def test_advantages_of_what_is_kept_are_those_of_the_library():
    kept, whole = (
        learned(PPO, buffer, environment(), steps=1, n_epochs=1)
        for buffer in (FlownRolloutBuffer, RolloutBuffer)
    )
    # the library has turned its arrays: lane after lane
    flown = np.stack(kept.env.flights).T.ravel()
    assert not flown.all()
    for name in ("observations", "actions", "values", "log_probs", "advantages", "returns"):
        library = getattr(whole.rollout_buffer, name)[flown]
        own = getattr(kept.rollout_buffer, name)
        order, library_order = (np.lexsort(np.round(each.T, 5)) for each in (own, library))
        np.testing.assert_allclose(own[order], library[library_order], rtol=1e-6)
    assert kept.rollout_buffer.values.size == flown.sum()


def test_wrappers_of_the_library_and_dictionaries_change_nothing_of_it():
    env = environment()
    model = learned(PPO, FlownRolloutBuffer, VecNormalize(env))
    assert model.num_timesteps == np.sum(env.flights)
    env = environment(action="waypoint", mask_in_observation=True)
    model = PPO("MultiInputPolicy", env, n_steps=32, rollout_buffer_class=FlownDictRolloutBuffer)
    model.learn(60, callback=FlownSteps())
    rows = model.rollout_buffer.observations
    assert len(rows["observation"]) == len(rows["action_mask"]) == np.sum(env.flights[-32:])
    assert (rows["observation"][:, FLYING] == 1.0).all()


def test_a_learner_of_choices_gets_the_masks_of_its_decisions_and_stays_finite():
    env = environment(action="waypoint")
    model = learned(MaskablePPO, FlownMaskableRolloutBuffer, env, steps=1, n_epochs=1)
    buffer, flown = model.rollout_buffer, int(np.sum(env.flights))
    assert len(buffer.action_masks) == flown
    chosen = buffer.actions.astype(int).ravel()
    assert (buffer.action_masks.reshape(flown, -1)[np.arange(flown), chosen] == 1.0).all()
    # a last batch of one row: the library would divide by its deviation
    again = environment(action="waypoint")
    batch_size = next(size for size in range(2, flown) if flown % size == 1)
    model = learned(
        MaskablePPO, FlownMaskableRolloutBuffer, again, steps=1, n_epochs=1, batch_size=batch_size
    )
    assert np.sum(again.flights) == flown
    assert all(torch.isfinite(each).all() for each in model.policy.parameters())


def test_steps_of_learners_without_rollouts_are_flown_steps_too():
    env = environment()
    model = SAC("MlpPolicy", env, learning_starts=1000, seed=0, device="cpu", buffer_size=500)
    model.learn(300, callback=FlownSteps())
    assert 300 <= model.num_timesteps == np.sum(env.flights)


def test_a_saved_model_goes_on(tmp_path):
    learned(PPO, FlownRolloutBuffer, environment(), steps=1).save(tmp_path / "model")
    env = environment()
    model = PPO.load(tmp_path / "model", env=env, device="cpu")
    before = model.num_timesteps
    model.learn(1, callback=FlownSteps(), reset_num_timesteps=False)
    assert model.num_timesteps == before + np.sum(env.flights)


def test_what_does_not_know_who_flew_is_refused():
    model = A2C("MlpPolicy", environment(), rollout_buffer_class=FlownRolloutBuffer)
    with pytest.raises(ValueError, match=r"callback=FlownSteps\(\)"):
        model.learn(8)
    with pytest.raises(ValueError, match="no CoverageVecEnv"):
        A2C("MlpPolicy", "Pendulum-v1", device="cpu").learn(8, callback=FlownSteps())


def test_one_decision_is_too_little_to_learn_from():
    env = CoverageVecEnv(1, "open_field", max_cycles=5)
    buffer = FlownRolloutBuffer(2, env.observation_space, env.action_space, n_envs=2)
    one = torch.zeros(2)
    for flew in ([True, False], [False, False]):
        buffer.flew = np.array(flew)
        seen = np.zeros((2, *env.observation_space.shape))
        buffer.add(seen, np.zeros((2, 3)), np.zeros(2), np.zeros(2), one, one)
    with pytest.raises(ValueError, match="1 decisions in a rollout; take more n_steps"):
        buffer.compute_returns_and_advantage(one, np.zeros(2))


@pytest.mark.parametrize(
    ("name", "changes", "buffer"),
    [
        ("ppo", ["agent=each"], FlownRolloutBuffer),
        ("maskable-ppo", ["agent=each", "environment.action=waypoint"], FlownMaskableRolloutBuffer),
        ("ppo", ["agent=swarm"], RolloutBuffer),
    ],
)
def test_trainings_learn_from_decisions_and_count_them(name, changes, buffer):
    settings = tiny(name, *changes, scenario="hard")
    learner = learner_of(settings, Missions.of(settings), 0)
    assert isinstance(learner, LibraryLearner)
    flown = []
    if isinstance(learner.env, CoverageVecEnv):
        step = learner.env.step_wait
        learner.env.step_wait = lambda: flown.append(learner.env.alive) or step()
    assert learner.model.rollout_buffer_class is buffer
    learner.learn(0, Told())
    assert learner.steps == (np.sum(flown) if flown else learner.model.num_timesteps)
    assert learner.steps < np.size(flown) if flown else learner.steps > 0
