import copy
import pickle
import warnings
from typing import Any

import numpy as np
import pytest
from gymnasium.error import ResetNeeded
from practice_grounds import practice_ground

from uas_coverage_env import ContactKind, UasStatus, uas_coverage_v0
from uas_coverage_env.env import HOME_CHOICE
from uas_coverage_env.env.episode.episode import Episode
from uas_coverage_env.env.episode.settings import MissionSettings
from uas_coverage_env.files.strict_toml import InputError
from uas_coverage_env.scenario import load_scenario


def still(env):
    return {agent: np.zeros(3, np.float32) for agent in env.agents}


def test_agents_are_the_uas_of_the_scenario():
    env = uas_coverage_v0.parallel_env("village")
    assert env.possible_agents == ["uas_1", "uas_2"]
    assert env.agents == []
    observations, infos = env.reset()
    assert env.agents == ["uas_1", "uas_2"] == list(observations) == list(infos)


def test_a_scenario_can_be_a_name_a_path_or_an_object(tmp_path):
    scenario = load_scenario("open_field")
    scenario.to_file(tmp_path / "field.toml")
    observed = []
    for given in ("open_field", str(tmp_path / "field.toml"), tmp_path / "field.toml", scenario):
        observations, _ = uas_coverage_v0.parallel_env(given).reset()
        observed.append(observations["uas_1"])
    for other in observed[1:]:
        np.testing.assert_array_equal(observed[0], other)


@pytest.mark.parametrize(
    ("settings", "named"),
    [
        ({"scenario": "vilage"}, "village"),
        ({"dynamics": "linear"}, "lpv.*nonlinear"),
        ({"render_mode": "ansi"}, "human, rgb_array"),
        ({"max_cycles": 0}, "max_cycles is 0"),
        ({"max_cycles": 2.5}, "max_cycles is 2.5"),
        ({"max_cycles": True}, "max_cycles is True"),
        ({"reward_weights": {"home": 10**400}}, "home is 1000.*give a finite number"),
        ({"reward_weights": {"home": 1e300}}, "home is 1e[+]300.*at most 1e[+]09"),
        ({"return_mode": "yes"}, "return_mode is 'yes'"),
        ({"safety_filter": None}, "safety_filter is None"),
    ],
)
def test_wrong_settings_are_refused_with_what_is_allowed(settings, named):
    with pytest.raises(ValueError, match=named):
        uas_coverage_v0.parallel_env(**settings)


def test_an_unknown_scenario_is_an_input_error():
    with pytest.raises(InputError):
        uas_coverage_v0.parallel_env("nowhere")


def test_reset_comes_first():
    env = uas_coverage_v0.parallel_env(practice_ground(), render_mode="rgb_array")
    with pytest.raises(ResetNeeded):
        env.step({})
    with pytest.raises(ResetNeeded):
        env.render()


def test_spaces_are_the_same_objects_each_time_and_one_per_agent():
    env = uas_coverage_v0.parallel_env(practice_ground())
    for agent in env.possible_agents:
        assert env.observation_space(agent) is env.observation_space(agent)
        assert env.action_space(agent) is env.action_space(agent)
    assert env.action_space("uas_1") is not env.action_space("uas_2")
    assert env.action_space("uas_1") == env.action_space("uas_2")


def test_a_uas_that_has_ended_leaves_and_the_others_go_on():
    env = uas_coverage_v0.parallel_env(practice_ground(n_uas=3), action="waypoint")
    env.reset()
    results = env.step({"uas_1": 0, "uas_2": HOME_CHOICE, "uas_3": 1})
    assert all(set(result) == {"uas_1", "uas_2", "uas_3"} for result in results)
    assert results[2] == {"uas_1": False, "uas_2": True, "uas_3": False}
    assert env.agents == ["uas_1", "uas_3"]
    assert env.num_agents == 2
    results = env.step({"uas_1": 0, "uas_3": 1})
    assert all(set(result) == {"uas_1", "uas_3"} for result in results)


def test_after_the_end_an_empty_step_gives_nothing():
    env = uas_coverage_v0.parallel_env(practice_ground(), max_cycles=1)
    env.reset()
    env.step(still(env))
    assert env.agents == []
    assert env.step({}) == ({}, {}, {}, {}, {})
    assert env.step({"uas_1": np.zeros(3)}) == ({}, {}, {}, {}, {})
    assert env.swarm_state().step == 1


def test_reset_begins_the_same_mission_again():
    env = uas_coverage_v0.parallel_env(practice_ground(n_moving=2), action="waypoint")
    first, _ = env.reset(seed=1)
    for _ in range(5):
        env.step(dict.fromkeys(env.agents, 0))
    again, infos = env.reset(seed=2)
    for agent, observation in first.items():
        np.testing.assert_array_equal(observation, again[agent])
    assert infos["uas_1"]["energy_Wh"] == 0.0
    assert infos["uas_1"]["status"] == UasStatus.FLYING
    assert not any(infos["uas_1"]["reward_terms"].values())


def test_the_seed_seeds_the_generator_and_unknown_options_are_ignored():
    env = uas_coverage_v0.parallel_env(practice_ground())
    env.reset(seed=7, options={"anything": 1})
    drawn = env.np_random.random()
    env.reset(seed=7)
    assert env.np_random.random() == drawn
    env.reset()
    assert env.np_random.random() != drawn


def test_infos_count_energy_and_coverage():
    env = uas_coverage_v0.parallel_env("open_field", action="waypoint")
    _, infos = env.reset()
    spent = 0.0
    for _ in range(20):
        *_, infos = env.step(dict.fromkeys(env.agents, 0))
        assert infos["uas_1"]["energy_Wh"] > spent
        spent = infos["uas_1"]["energy_Wh"]
    covered = int((~env.swarm_state().uncovered).sum())
    assert infos["uas_1"]["covered"] == infos["uas_2"]["covered"] == covered > 0


def test_types_are_plain():
    env = uas_coverage_v0.parallel_env(practice_ground(), safety_filter=True)
    env.reset()
    _, rewards, terminations, truncations, infos = env.step(still(env))
    assert type(rewards["uas_1"]) is float
    assert type(terminations["uas_1"]) is type(truncations["uas_1"]) is bool
    info = infos["uas_1"]
    assert type(info["covered"]) is int
    assert type(info["energy_Wh"]) is float
    assert type(info["returning"]) is type(info["filter"]["changed"]) is bool
    assert (info["contact"], info["contact_with"]) == (ContactKind.NONE, -1)
    assert type(info["contact"]) is type(info["contact_with"]) is type(info["status"]) is int


def test_every_mission_begins_with_the_infos_of_the_first():
    env = uas_coverage_v0.parallel_env(practice_ground(), safety_filter=True)
    _, first = env.reset()
    env.step({agent: np.array([1.0, 0.5, 0.0]) for agent in env.agents})
    _, again = env.reset()
    assert str(again) == str(first)


def test_return_mode_brings_all_home_whatever_is_asked():
    env = uas_coverage_v0.parallel_env(practice_ground(), return_mode=True)
    env.reset()
    returned = False
    infos = {}
    while env.agents:
        *_, infos = env.step({agent: np.array([0.0, 0.1, 0.0]) for agent in env.agents})
        returned = returned or any(info["returning"] for info in infos.values())
    assert returned
    assert {info["status"] for info in infos.values()} == {UasStatus.LANDED}


def test_the_filter_keeps_random_flight_whole():
    env = uas_coverage_v0.parallel_env(practice_ground(tower=True), safety_filter=True)
    env.reset()
    rng = np.random.default_rng(0)
    while env.agents:
        *_, truncations, infos = env.step({a: rng.uniform(-1, 1, 3) for a in env.agents})
        assert all(info["status"] != UasStatus.LOST for info in infos.values())
    assert all(truncations.values())


@pytest.mark.parametrize("duplicate", [copy.deepcopy, lambda env: pickle.loads(pickle.dumps(env))])
def test_a_copy_in_mid_flight_flies_on_in_the_same_way(duplicate):
    env = uas_coverage_v0.parallel_env(
        practice_ground(tower=True), action="waypoint", render_mode="rgb_array"
    )
    env.reset(seed=3)
    for _ in range(4):
        env.step(dict.fromkeys(env.agents, 0))
    env.render()
    other = duplicate(env)
    for _ in range(6):
        results = [e.step(dict.fromkeys(e.agents, 0)) for e in (env, other)]
        for mine, theirs in zip(*(result[0].values() for result in results), strict=True):
            np.testing.assert_array_equal(mine, theirs)
        assert results[0][1] == results[1][1]
    np.testing.assert_array_equal(env.state(), other.state())
    np.testing.assert_array_equal(env.render(), other.render())
    env.step(dict.fromkeys(env.agents, 0))
    assert other.swarm_state().step == env.swarm_state().step - 1
    assert not np.array_equal(env.state(), other.state())


def test_same_mission_same_pictures():
    pictures = []
    for _ in range(2):
        env = uas_coverage_v0.parallel_env("village", render_mode="rgb_array")
        env.reset(seed=0)
        for _ in range(3):
            env.step({agent: np.array([0.1, 0.8, -0.3]) for agent in env.agents})
        pictures.append(env.render())
    assert pictures[0].shape == (512, 512, 3)
    assert pictures[0].dtype == np.uint8
    np.testing.assert_array_equal(pictures[0], pictures[1])


def test_without_a_render_mode_nothing_is_rendered():
    env = uas_coverage_v0.parallel_env(practice_ground())
    env.reset()
    assert env.render() is None


def test_close_can_be_called_twice():
    env = uas_coverage_v0.parallel_env(practice_ground(), render_mode="rgb_array")
    env.reset()
    env.close()
    env.close()


def test_a_window_shows_the_mission(monkeypatch):
    pygame = pytest.importorskip("pygame")
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    env = uas_coverage_v0.parallel_env(practice_ground(), render_mode="human")
    env.reset()
    env.step(still(env))
    assert env.render() is None
    assert pygame.display.get_surface().get_size() == (720, 720)
    env.close()
    env.close()
    assert pygame.display.get_surface() is None


def test_a_window_that_a_person_closes_does_not_end_the_mission(monkeypatch):
    pygame = pytest.importorskip("pygame")
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    env = uas_coverage_v0.parallel_env(practice_ground(max_steps=5), render_mode="human")
    env.reset()
    pygame.event.post(pygame.event.Event(pygame.KEYDOWN, key=pygame.K_ESCAPE))
    steps = 0
    while env.agents:
        env.step(still(env))
        steps += 1
    assert steps == 5
    env.reset()
    assert env.render() is None
    assert pygame.display.get_surface() is None
    env.close()


def test_a_window_without_pygame_says_what_to_install(monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "pygame", None)
    with pytest.raises(ImportError, match=r"uas-coverage-env\[human\]"):
        uas_coverage_v0.parallel_env(practice_ground(), render_mode="human")


def test_a_shorter_limit_of_steps_is_exact():
    env = uas_coverage_v0.parallel_env(practice_ground(), max_cycles=7)
    env.reset()
    steps = 0
    while env.agents:
        env.step(still(env))
        steps += 1
    assert steps == env.max_cycles == env.scenario.max_steps == 7


@pytest.mark.parametrize("steps", [0, -3, 2.5, "7", True])
def test_a_limit_that_is_none_cannot_be_set_either(steps):
    env = uas_coverage_v0.parallel_env(practice_ground(), max_cycles=7)
    with pytest.raises(ValueError, match="max_cycles is"):
        env.max_cycles = steps
    assert env.max_cycles == 7


def test_a_limit_that_is_set_is_the_same_as_one_that_was_given():
    given = uas_coverage_v0.parallel_env(practice_ground(), max_cycles=9, return_mode=True)
    late = uas_coverage_v0.parallel_env(practice_ground(), max_cycles=40, return_mode=True)
    late.reset()
    late.max_cycles = 9
    with pytest.raises(ResetNeeded):
        late.step(still(given))
    assert late.max_cycles == late.scenario.max_steps == 9
    given.reset(seed=1)
    late.reset(seed=1)
    while given.agents:
        for mine, other in zip(given.step(still(given)), late.step(still(late)), strict=True):
            for agent, value in mine.items():
                np.testing.assert_array_equal(value, other[agent])
    assert not late.agents


def test_in_turns_an_invalid_action_is_refused_at_once():
    env: Any = uas_coverage_v0.env(practice_ground())
    env.reset()
    for wrong in (np.array([np.nan, 0, 0]), np.array([np.inf, 0, 0]), np.zeros(2), None, "up"):
        with pytest.raises(ValueError, match="uas_1"):
            env.step(wrong)
        assert env.agent_selection == "uas_1"
    env.step(np.zeros(3))
    assert env.agent_selection == "uas_2"
    with pytest.raises(ValueError, match="uas_2"):
        env.step(np.full(3, np.nan))
    env.step(np.zeros(3))
    assert env.swarm_state().step == 1


def test_in_turns_and_at_once_the_same_mission_is_flown():
    parallel = uas_coverage_v0.parallel_env(practice_ground(), max_cycles=10)
    turns = uas_coverage_v0.env(practice_ground(), max_cycles=10)
    observations, _ = parallel.reset(seed=0)
    turns.reset(seed=0)
    rng = np.random.default_rng(0)
    while parallel.agents:
        actions = {agent: rng.uniform(-0.5, 0.5, 3).astype(np.float32) for agent in parallel.agents}
        for agent, action in actions.items():
            observation, *_ = turns.last()
            assert turns.agent_selection == agent
            np.testing.assert_array_equal(observation, observations[agent])
            turns.step(action)
        observations, *_ = parallel.step(actions)
    assert all(turns.truncations.values())


def test_an_action_out_of_bounds_is_clipped_in_turns_without_a_word(capsys):
    env = uas_coverage_v0.env(practice_ground())
    env.reset()
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        env.step(np.array([5.0, 0.0, 0.0]))
    assert capsys.readouterr().out == ""


def test_an_episode_has_so_few_attributes_that_python_finds_them_fast():
    # from 30 on, CPython 3.11 looks each of them up in a dictionary
    episode = Episode(practice_ground(), MissionSettings())
    assert len(vars(episode)) < 30
