"""The waypoint task as an environment to learn in, and that something is learned in it."""

import numpy as np
import pytest
import torch
from uas_coverage_agents.policy.pointer import Pointer
from uas_coverage_agents.training.config import load_config
from uas_coverage_agents.training.pointer import PointerPolicy
from uas_coverage_agents.training.waypoint import WaypointLearner
from uas_coverage_agents.training.waypoint_env import WaypointVecEnv, prices_of
from uas_coverage_agents.waypoint.layout import HOME_CHOICE, OBSERVATION_SIZE, K
from uas_coverage_agents.waypoint.settings import WaypointSettings
from uas_coverage_agents.waypoint.team import LEFT, LOST_UAS, NOT_HOME
from waypoint_missions import town

SETTINGS = WaypointSettings(interface="waypoint", hidden=8)
SCENARIOS = [town(seed, n_uas=1 + seed % 3, n_waypoints=6 + seed) for seed in range(4)]


def environment(n_lanes=3, seed=0):
    return WaypointVecEnv(SCENARIOS, SETTINGS, n_lanes, seed)


def config(*changes):
    return load_config(
        "maskable-ppo", changes=["scenarios.pool=4", "num_envs=4", "policy.hidden=8", *changes]
    )


def fly(lanes, rng, n_steps):
    """Choose at random; everything that came back."""
    seen = []
    for _ in range(n_steps):
        masks = lanes.action_masks()
        choices = (masks * rng.random(masks.shape)).argmax(axis=1)
        observation, rewards, done, infos = lanes.step(choices)
        seen.append((observation, rewards, done))
        assert all(
            ("account" in info) == bool(over) for info, over in zip(infos, done, strict=True)
        )
    return seen


def test_rewards_add_up_to_the_price_of_the_mission():
    lanes = environment(n_lanes=1)
    lanes.reset()
    rng, total = np.random.default_rng(0), 0.0
    first_Wh = lanes._lanes.account[0] @ prices_of(SETTINGS)
    while True:
        masks = lanes.action_masks()
        _, rewards, done, infos = lanes.step((masks * rng.random(masks.shape)).argmax(axis=1))
        total += float(rewards[0])
        if done[0]:
            break
    account = infos[0]["account"]
    assert infos[0]["terminal_observation"].shape == (OBSERVATION_SIZE,)
    assert not infos[0]["TimeLimit.truncated"]
    assert total == pytest.approx(first_Wh - account @ prices_of(SETTINGS), rel=1e-5)
    assert account[[LOST_UAS, NOT_HOME, LEFT]].sum() == 0.0


def test_a_choice_that_is_masked_is_refused():
    lanes = environment()
    lanes.reset()
    assert not lanes.action_masks().all(axis=1).any()
    with pytest.raises(ValueError, match="masked"):
        lanes.step(lanes.action_masks().argmin(axis=1))


def test_the_same_seed_flies_the_same_and_another_does_not():
    runs = []
    for seed in (0, 0, 1):
        lanes = environment(seed=seed)
        lanes.reset()
        runs.append(fly(lanes, np.random.default_rng(5), 20))
    for one, two in zip(runs[0], runs[1], strict=True):
        assert all(np.array_equal(a, b) for a, b in zip(one, two, strict=True))
    assert not np.array_equal(runs[0][0][0], runs[2][0][0])


def test_restored_lanes_go_on_bit_for_bit():
    lanes = environment()
    lanes.reset()
    fly(lanes, np.random.default_rng(1), 25)
    kept = lanes.state_dict()
    expected = fly(lanes, np.random.default_rng(2), 25)
    fresh = environment()
    fresh.reset()
    fresh.load_state_dict(kept)
    for one, two in zip(expected, fly(fresh, np.random.default_rng(2), 25), strict=True):
        assert all(np.array_equal(a, b) for a, b in zip(one, two, strict=True))
    with pytest.raises(ValueError, match="has shape"):
        environment(n_lanes=2).load_state_dict(kept)


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("lanes.scenario", 10**9),
        ("lanes.decider", 10**6),
        ("lanes.targets", -3),
        ("lanes.candidates", 10**12),
        ("state.step", -(10**9)),
        ("state.uas.status", 77),
        ("state.x", np.nan),
        ("missions", -1),
    ],
)
def test_lanes_do_not_go_on_from_numbers_that_point_at_nothing(name, value):
    lanes = environment()
    lanes.reset()
    forged = lanes.state_dict()
    forged[name].flat[-1] = value
    with pytest.raises(ValueError, match=rf"{name}\[.*\] is "):
        lanes.load_state_dict(forged)


def test_what_is_exported_chooses_as_the_model_does():
    learner = WaypointLearner()
    lanes = learner.lanes(config(), seed=3)
    model = learner.model(config(), lanes, seed=3)
    policy = model.policy
    assert isinstance(policy, PointerPolicy)
    with torch.no_grad():
        for parameter in policy.parameters():
            parameter.add_(0.2 * torch.randn_like(parameter))
    rows = np.asarray(lanes.reset())
    pointer, tensors = learner.export(model)
    assert isinstance(pointer, Pointer)
    weights = {name: tensor.astype(np.float64) for name, tensor in tensors.items()}
    assert {name: tensor.shape for name, tensor in tensors.items()} == pointer.shapes()
    scores = policy.mlp_extractor.forward_actor(torch.as_tensor(rows)).detach().numpy()
    there = np.concatenate(
        [rows[:, pointer.team :].reshape(-1, K, pointer.features)[..., 0] > 0, [[True]] * 4], axis=1
    )
    assert scores[there] == pytest.approx(pointer.forward(weights, rows)[there], abs=1e-4)


def test_an_untrained_model_takes_the_nearest_waypoint():
    learner = WaypointLearner()
    lanes = learner.lanes(config(), seed=4)
    model = learner.model(config(), lanes, seed=4)
    observation = np.asarray(lanes.reset())
    for _ in range(20):
        masks = np.stack(lanes.env_method("action_masks"))
        choices = model.predict(observation, action_masks=masks, deterministic=True)[0]  # pyrefly: ignore[unexpected-keyword]
        assert (choices == masks.argmax(axis=1)).all()
        assert (choices != HOME_CHOICE).all()
        observation = lanes.step(choices)[0]


@pytest.mark.slow
def test_a_short_training_saves_energy_and_time_on_towns_it_has_not_seen():
    torch.set_num_threads(1)
    learner = WaypointLearner()
    shares = [f"policy.{of}_share=0.0" for of in ("moving", "covered", "discharged")]
    little = config("num_envs=32", "scenarios.pool=48", "policy.hidden=48", *shares)
    model = learner.model(little, learner.lanes(little, 0), 0)

    def costs_Wh():
        """Of the first mission in each lane."""
        lanes = learner.lanes(little, 7)
        observation, costs = np.asarray(lanes.reset()), np.full(32, np.nan)
        while np.isnan(costs).any():
            masks = np.stack(lanes.env_method("action_masks"))
            choices = model.predict(observation, action_masks=masks, deterministic=True)[0]  # pyrefly: ignore[unexpected-keyword]
            observation, _, done, infos = lanes.step(choices)
            for lane in np.flatnonzero(done & np.isnan(costs)):
                costs[lane] = infos[lane]["account"] @ prices_of(SETTINGS) / SETTINGS.price_per_Wh
        return costs

    before = costs_Wh()
    model.learn(30_000)
    gain = before - costs_Wh()
    assert gain.mean() > 0.04 * before.mean()
    assert gain.mean() > 2.0 * gain.std() / np.sqrt(len(gain))
