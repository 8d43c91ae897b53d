"""PPO from decisions alone: what is learned from, what flies, and that it repeats."""

import sys

import numpy as np
import pytest
import torch
from uas_coverage_agents.policy.actor import Actor
from uas_coverage_agents.policy.environment import action_of, keywords_of
from uas_coverage_agents.training import draws, packed
from uas_coverage_agents.training.learner import Told
from uas_coverage_agents.training.missions import Missions
from uas_coverage_agents.training.packed import PackedPpo, advantages_of
from uas_coverage_agents.training.rounds import TrainingJob, policy_of, train
from uas_coverage_agents.training.settings import settings_of

from uas_coverage_env import generate_scenario, load_planner, rollout
from uas_coverage_env.env import HOME_CHOICE, CoverageBatch
from uas_coverage_env.files.strict_toml import InputError

TINY = (
    *("num_envs=2", "rounds=2", "total_timesteps=64", "size.n_uas=[2,2]"),
    *("size.n_waypoints=[5,5]", "size.n_obstacles=[0,2]"),
    *("learning.n_steps=8", "learning.batch_size=16", "learning.hidden=[8,4]"),
    *("learning.missions=2",),
)
LEARNERS = "ppo-waypoint", "ppo-velocity"


def tiny(name="ppo-waypoint", *changes):
    return settings_of(name, scenario="generated", changes=[*TINY, *changes])


def made(settings, seed=0):
    return PackedPpo(settings, Missions.of(settings), seed)


def learned(settings, seed=0, rounds=1):
    learner = made(settings, seed)
    for number in range(rounds):
        learner.learn(number, Told())
    return learner


def policy(learner, settings):
    return policy_of(TrainingJob("tiny", settings), learner, 0.0, 0.0)


def observed(settings, steps=3):
    """What UAS observe in some steps of missions, with their masks."""
    missions = Missions.of(settings)
    batch = CoverageBatch(4, [missions.mission(k) for k in range(2)], **missions.settings())
    batch.reset(0)
    for _ in range(steps):
        batch.step(np.zeros(batch.learners.asked.shape[: 2 if batch.chooses else 3], int))
    masks = batch.action_masks()[batch.flying] if batch.chooses else None
    return batch.observation[batch.flying], masks


@pytest.mark.parametrize("name", LEARNERS)
def test_the_same_seed_learns_the_same_weights_and_another_seed_learns_others(name):
    one, again, other = (learned(tiny(name), seed).state_dict() for seed in (0, 0, 1))
    assert all(np.array_equal(one[key], again[key]) for key in one)
    assert not np.array_equal(one["model/others.weight"], other["model/others.weight"])


@pytest.mark.parametrize("name", LEARNERS)
def test_a_training_that_was_stopped_goes_on_to_the_same_weights(name, tmp_path):
    job = TrainingJob("tiny", tiny(name), missions=1)
    whole = train({tmp_path / "whole": job})[tmp_path / "whole"]

    def stop(progress):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        train({tmp_path / "stopped": job}, on_progress=stop)
    resumed = train({tmp_path / "stopped": job})[tmp_path / "stopped"]
    assert resumed.description.weights_sha256 == whole.description.weights_sha256
    assert resumed.description.training.steps >= 64


def test_what_is_put_aside_is_all_that_is_known():
    settings = tiny()
    state = learned(settings).state_dict()
    again = made(settings, seed=1)
    again.load_state_dict(state)
    back = again.state_dict()
    assert back.keys() == state.keys()
    assert all(np.array_equal(back[key], state[key]) for key in state)
    assert any(state[key].any() for key in state if "exp_avg_sq" in key)


def test_the_state_of_another_learner_is_refused_in_a_line():
    state = learned(tiny()).state_dict()
    for spoilt in (
        {key: each for key, each in state.items() if "adam/3" not in key},
        state | {"adam/3/exp_avg": np.zeros(3, np.float32)},
    ):
        with pytest.raises(InputError, match="does not fit this learner") as caught:
            made(tiny()).load_state_dict(spoilt)
        assert "\n" not in str(caught.value)
    with pytest.raises(InputError, match="does not fit this learner"):
        made(tiny("ppo-waypoint", "learning.hidden=[8,5]")).load_state_dict(state)


@pytest.mark.parametrize("name", LEARNERS)
def test_the_saved_policy_gives_what_torch_gives(name, tmp_path):
    settings = tiny(name)
    learner = learned(settings)
    seen, _ = observed(settings)
    with torch.no_grad():
        expected = learner._model.outputs(*learner._model.read(torch.from_numpy(seen))).numpy()
    found = policy(learner, settings).forward(seen)
    np.testing.assert_allclose(found, expected, rtol=0.0, atol=1e-6 * max(1, abs(found).max()))
    assert np.ptp(found, axis=0).max() > 0.0


def test_a_masked_choice_is_never_taken_neither_in_flight_nor_with_noise():
    settings = tiny()
    learner = learned(settings)
    seen, masks = observed(settings)
    masks = masks.copy()
    best = policy(learner, settings).forward(seen).argmax(axis=1)
    masks[np.arange(len(seen)), best] = False
    masks[:, HOME_CHOICE] = True
    rows = np.arange(len(seen))
    choice = action_of(policy(learner, settings))
    assert masks[rows, choice({"observation": seen, "action_mask": masks})].all()
    with torch.no_grad():
        outputs = learner._model.outputs(*learner._model.read(torch.from_numpy(seen)))
        for _ in range(50):
            drawn, likely = draws.drawn(outputs, torch.from_numpy(masks), 1.0)
            assert masks[rows, drawn.numpy()].all()
            assert torch.isfinite(likely).all()


def test_choices_are_drawn_in_flight_as_often_as_learned_and_by_what_is_observed_alone():
    settings = tiny("ppo-waypoint", "learning.temperature=0.5")
    found = policy(learned(settings), settings)
    seen, masks = observed(settings)
    row, mask = seen[0], masks[0]
    rows = np.repeat(row[np.newaxis], 4000, axis=0)
    rows[:, 0] = np.linspace(-1e-3, 1e-3, len(rows))  # all but the same
    choose = action_of(found)
    chosen = choose({"observation": rows, "action_mask": mask})
    scores = np.where(mask, found.forward(row) / 0.5, -np.inf)
    wanted = np.exp(scores - scores.max())
    np.testing.assert_allclose(
        np.bincount(chosen, minlength=len(wanted)) / len(rows), wanted / wanted.sum(), atol=0.03
    )
    again = [choose({"observation": each, "action_mask": mask}) for each in rows[:50]]
    assert np.array_equal(again, chosen[:50])
    settings = tiny("ppo-waypoint", "learning.temperature=0")
    best = action_of(policy(learned(settings), settings))
    assert np.ptp(best({"observation": rows, "action_mask": mask})) == 0


def test_rows_hold_decisions_alone_and_an_end_is_the_last_of_them(monkeypatch):
    settings = tiny("ppo-waypoint", "learning.n_steps=40")
    learner = made(settings)
    missions = learner._begun(learner._own.phases[0], 0)
    batch = missions._flown
    flew, step = [], batch.step

    def noted(actions):
        flew.append(batch.flying)
        actions[:, 0] = HOME_CHOICE  # lands at once, then waits for the other
        return step(actions)

    monkeypatch.setattr(batch, "step", noted)
    flown = packed._Flown(missions, learner._own)
    rows = flown.collect(learner._model, 1.0)
    flew = np.array(flew)
    assert len(rows.read) == len(rows.actions) == len(rows.returns) == flew.sum()
    assert 0 < flew.sum() < flew.size
    told = flown.tell()
    assert told["flights"] > 0
    assert told["home"] == 1.0
    assert flown.tell()["flights"] == 0


def test_a_flight_ends_where_its_time_runs_out():
    changes = "environment.max_cycles=5", "environment.return_mode=false"
    learner = made(tiny("ppo-velocity", *changes))
    flown = packed._Flown(learner._begun(learner._own.phases[0], 0), learner._own)
    flown.collect(learner._model, 0.01)  # 8 steps of 2 missions of 2 UAS
    told = flown.tell()
    assert (told["flights"], told["home"], told["lost_or_late"]) == (4, 0.0, 1.0)


def test_advantages_look_ahead_to_an_end_and_not_beyond():
    rewards = np.array([[1.0], [2.0], [4.0]], np.float32)
    values = np.array([[0.5], [0.25], [8.0], [3.0]], np.float32)
    ended = np.array([[False], [True], [False]])
    of_torch = [torch.from_numpy(each) for each in (rewards, values, ended)]
    found = advantages_of(of_torch[0], of_torch[1], of_torch[2], 0.5, 0.5)[:, 0]
    last = 4.0 + 0.5 * 3.0 - 8.0
    second = 2.0 - 0.25
    first = 1.0 + 0.5 * 0.25 - 0.5 + 0.25 * second
    assert found.tolist() == [first, second, last]


def test_noise_falls_from_the_begin_of_a_phase_to_its_end():
    phases = "[{noise=[0.4, 0.1]}, {begins=0.5, noise=[0.1, 0.05]}]"
    changes = "total_timesteps=400", f"learning.phases={phases}"
    learner = made(tiny("ppo-velocity", *changes))
    first, second = learner._own.phases
    found = []
    for steps, phase in ((0, first), (100, first), (200, first), (200, second), (400, second)):
        learner._steps = steps
        found.append(learner._noise(phase))
    assert found == pytest.approx([0.4, 0.2, 0.1, 0.1, 0.05])


def test_a_phase_pays_by_its_own_weights_and_lessons_are_as_many_missions_as_it_says():
    phases = """[
        {reward_weights={home=1.0}, lessons={landing=1.0}},
        {begins=0.5, reward_weights={home=7.0}},
    ]"""
    learner = made(tiny("ppo-waypoint", f"learning.phases={phases}", "learning.missions=8"))
    first, second = (learner._begun(phase, 0)._flown for phase in learner._own.phases)
    at = first.settings.term_names.index("home")
    assert [first.settings.weights[at], second.settings.weights[at]] == [1.0, 7.0]
    missions = [learner._missions.mission(k) for k in range(8)]
    taught = packed.Phase(lessons={"landing": 0.25, "near": 0.5}).taught(missions)
    wide = [each.landing_distance_m > 2.0 for each in taught]
    near = [len(each.waypoints) == len(each.uas) for each in taught]
    assert wide == [True] * 2 + [False] * 6
    assert near == [False] * 2 + [True] * 4 + [False] * 2
    assert taught[6:] == missions[6:]
    assert first.scenario_of(0).landing_distance_m > second.scenario_of(0).landing_distance_m


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ("phases=[{begins=0.5}]", "give 0 first"),
        ("phases=[{begins=0.0},{begins=3000.0}]", "less than 1"),
        ("phases=[{reward_weights={homme=1.0}}]", "homme"),
        ("phases=[{lessons={flying=1.0}}]", "'flying' is none that changes missions"),
        ("phases=[{lessons={assisted=1.0}}]", "'assisted' is none that changes missions"),
        ("phases=[{lessons={few=0.6, near=0.5}}]", "shares of 1.1"),
        ("gamma=1.5", "gamma"),
    ],
)
def test_settings_that_cannot_be_are_refused_in_a_line(change, words):
    with pytest.raises(InputError, match=words) as caught:
        made(tiny("ppo-waypoint", f"learning.{change}"))
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("name", LEARNERS)
def test_the_policy_flies_without_torch(name, tmp_path, monkeypatch):
    settings = tiny(name)
    train({tmp_path: TrainingJob("tiny", settings, missions=1)})
    for module in [each for each in sys.modules if each.startswith("uas_coverage_agents.training")]:
        monkeypatch.delitem(sys.modules, module)
    monkeypatch.setitem(sys.modules, "torch", None)
    planner = load_planner(f"policy:{tmp_path / 'policy'}")
    scenario = generate_scenario(900_501, n_uas=2, n_waypoints=5, n_obstacles=2)
    assert rollout(scenario, planner, max_steps=5).planner == f"policy:{tmp_path / 'policy'}"
    assert "uas_coverage_agents.training" not in sys.modules


def test_a_file_whose_network_reads_what_is_not_there_is_refused():
    settings = tiny()
    network = policy(made(settings), settings).description.network
    data = network.model_dump()
    for change in (
        {"columns": (network.inputs,)},
        {"velocity": (0, 99_999)},
        {"vectors": ((0, 1, -1),)},
        {"candidates": {**data["candidates"], "sharp": data["candidates"]["sharp"][1:]}},
    ):
        with pytest.raises(ValueError, match=r"column|greater|row"):
            Actor.model_validate({**data, **change})


def test_a_policy_of_other_outputs_than_its_action_has_is_refused():
    settings = tiny()
    found = policy(made(settings), settings)
    network = found.description.network.model_copy(update={"others": 2})
    changed = type(found)(found.description.model_copy(update={"network": network}), found.tensors)
    with pytest.raises(ValueError, match="outputs for action 'waypoint'"):
        keywords_of(changed)
