"""What learners' libraries need of observations, infos, actions and specs."""

import copy
import json
import os
import pickle
import subprocess
import sys
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.envs.registration import EnvSpec
from gymnasium.spaces import Box, Dict, Tuple
from gymnasium.vector import AutoresetMode, SyncVectorEnv
from pettingzoo.utils.conversions import aec_to_parallel
from pettingzoo.utils.wrappers import BaseParallelWrapper
from practice_grounds import practice_ground

from uas_coverage_env import ContactKind, UasStatus, load_scenario, uas_coverage_v0
from uas_coverage_env.entities.codes import CommandKind
from uas_coverage_env.entities.commands import KIND_NAMES
from uas_coverage_env.entities.outcome import CONTACT_NAMES
from uas_coverage_env.entities.state import STATUS_NAMES
from uas_coverage_env.env import HOME_CHOICE, CoverageSwarmEnv
from uas_coverage_env.files.strict_toml import InputError
from uas_coverage_env.scenario import GeneratedScenarios

ID = "UASCoverage-v0"
GROUND = practice_ground(tower=True, n_moving=1, max_steps=25)
WAYPOINT = {"action": "waypoint", "mask_in_observation": True}


def fleets(rng):
    return practice_ground(n_uas=int(rng.integers(1, 4)), max_steps=12)


def forms(told):
    """Kind and shape of everything in infos."""
    if isinstance(told, dict):
        return {name: forms(value) for name, value in told.items()}
    if isinstance(told, np.ndarray):
        assert told.dtype.kind in "biuf"
        return told.dtype, told.shape
    assert type(told) in (bool, int, float)
    return type(told)


def random_steps(env, seed=0):
    """What a parallel environment says in a mission, step by step."""
    _, infos = env.reset(seed=seed)
    yield infos
    for k, agent in enumerate(env.possible_agents):
        env.action_space(agent).seed(seed + k)
    while env.agents:
        *_, infos = env.step({agent: env.action_space(agent).sample() for agent in env.agents})
        yield infos


def make_vec(num_envs=2, **settings) -> Any:
    return gymnasium.make_vec(
        ID, num_envs=num_envs, vectorization_mode="vector_entry_point", **settings
    )


def test_codes_have_the_names_that_files_and_records_use():
    assert STATUS_NAMES == ("flying", "landed", "lost", "swapping")
    assert CONTACT_NAMES == (
        "none", "obstacle", "moving_obstacle", "uas", "geofence", "battery", "fault", "limits",
    )  # fmt: skip
    assert KIND_NAMES == ("velocity", "acceleration", "wrench", "goto", "climb")
    for codes, names in ((UasStatus, STATUS_NAMES), (ContactKind, CONTACT_NAMES)):
        assert [codes[name.upper()] for name in names] == list(range(len(names)))
    assert [*CommandKind] == list(range(len(KIND_NAMES)))


@pytest.mark.parametrize("action", ["velocity", "waypoint"])
@pytest.mark.parametrize("scenario", [GROUND, fleets], ids=["fixed", "drawn"])
def test_infos_are_numbers_of_the_same_kind_and_shape_in_every_step(scenario, action):
    settings = {"action": action, "safety_filter": True}
    env = uas_coverage_v0.parallel_env(scenario, **settings)
    told = [
        info for seed in range(4) for infos in random_steps(env, seed) for info in infos.values()
    ]
    assert all(forms(info) == forms(told[0]) for info in told)
    if action == "waypoint":
        assert UasStatus.LANDED in {info["status"] for info in told}

    swarm = CoverageSwarmEnv(scenario, **settings)
    swarm.action_space.seed(0)
    expected = forms(swarm.reset(seed=0)[1])
    for seed in range(4):
        _, info = swarm.reset(seed=seed)
        ended = False
        while not ended:
            assert forms(info) == expected
            *_, terminated, truncated, info = swarm.step(swarm.action_space.sample())
            ended = terminated or truncated


def test_a_uas_that_a_mission_lacks_is_absent_in_the_infos_of_the_swarm():
    swarm = CoverageSwarmEnv(fleets, action="waypoint")
    statuses = set()
    for seed in range(6):
        _, info = swarm.reset(seed=seed)
        n_uas = len(swarm.scenario.uas)
        status = [uas["status"] for uas in info["uas"].values()]
        assert status == [UasStatus.FLYING] * n_uas + [UasStatus.ABSENT] * (3 - n_uas)
        assert list(info["uas"]) == ["uas_1", "uas_2", "uas_3"]
        statuses |= set(status)
    assert UasStatus.ABSENT in statuses


def test_infos_can_be_flat():
    settings = {"action": "waypoint", "safety_filter": True}
    nested = uas_coverage_v0.parallel_env(GROUND, **settings)
    flat = uas_coverage_v0.parallel_env(GROUND, flat_infos=True, **settings)
    for theirs, mine in zip(random_steps(nested), random_steps(flat), strict=True):
        for agent, info in mine.items():
            assert not any(isinstance(value, dict) for value in info.values())
            assert info["reward_terms_home"] == theirs[agent]["reward_terms"]["home"]
            asked = theirs[agent]["filter"]["asked"]
            np.testing.assert_array_equal(info["filter_asked_values"], asked["values"])
    for env in (
        CoverageSwarmEnv(GROUND, flat_infos=True),
        make_vec(scenario=GROUND, flat_infos=True),
    ):
        _, info = env.reset(seed=0)
        assert "reward_terms_home" in info
        assert not any(isinstance(value, dict) for value in info.values())


@pytest.mark.parametrize("settings", [{}, WAYPOINT], ids=["velocities", "waypoints"])
@pytest.mark.parametrize("scenario", [GROUND, fleets], ids=["fixed", "drawn"])
@pytest.mark.parametrize("form", ["parallel", "turns", "raw turns", "back", "wrapped", "copied"])
def test_mappings_of_spaces_hold_the_spaces_themselves(form, scenario, settings):
    parallel = uas_coverage_v0.parallel_env(scenario, **settings)
    env: Any = {
        "parallel": lambda: parallel,
        "turns": lambda: uas_coverage_v0.env(scenario, **settings),
        "raw turns": lambda: uas_coverage_v0.raw_env(scenario, **settings),
        "back": lambda: aec_to_parallel(uas_coverage_v0.raw_env(scenario, **settings)),
        "wrapped": lambda: BaseParallelWrapper(parallel),
        "copied": lambda: copy.deepcopy(parallel),
    }[form]()
    for begun in (False, True):
        if begun:
            env.reset(seed=0)
        for mapping, space in (
            (env.observation_spaces, env.observation_space),
            (env.action_spaces, env.action_space),
        ):
            assert list(mapping) == env.possible_agents
            assert all(mapping[agent] is space(agent) for agent in env.possible_agents)


def test_a_swarm_whose_spaces_are_joined_by_the_mappings_flies_a_mission():
    # as EPyMARL joins them, in the order of the agents
    env = uas_coverage_v0.parallel_env(GROUND, action="waypoint")
    env.reset(seed=0)
    observed = Tuple([env.observation_spaces[agent] for agent in env.agents])
    acted = Tuple([env.action_spaces[agent] for agent in env.agents])
    acted.seed(0)
    agents = list(env.agents)
    while env.agents:
        seen, *_ = env.step(dict(zip(agents, acted.sample(), strict=True)))
        if len(seen) == len(agents):
            assert observed.contains(tuple(seen[agent] for agent in agents))


def test_what_an_agent_that_has_ended_is_asked_is_ignored_whatever_it_is():
    env, twin = (
        uas_coverage_v0.parallel_env(practice_ground(n_uas=3), action="waypoint") for _ in range(2)
    )
    env.reset()
    twin.reset()
    for each in (env, twin):
        each.step({"uas_1": 0, "uas_2": HOME_CHOICE, "uas_3": 1})
    assert env.agents == ["uas_1", "uas_3"]
    for wrong in (0, HOME_CHOICE, 99, np.nan, None, "up"):
        mine = env.step({"uas_1": 0, "uas_2": wrong, "uas_3": 1})
        theirs = twin.step({"uas_1": 0, "uas_3": 1})
        assert mine[1:4] == theirs[1:4]
        assert list(mine[0]) == ["uas_1", "uas_3"]
        np.testing.assert_array_equal(env.state(), twin.state())


def test_in_turns_too_what_an_agent_that_has_ended_is_asked_is_ignored():
    env: Any = uas_coverage_v0.env(practice_ground(), action="waypoint")
    env.reset()
    env.step(HOME_CHOICE)
    env.step(0)
    assert env.agent_selection == "uas_1"
    assert env.last()[2]
    assert env.last()[-1]["status"] == UasStatus.LANDED
    env.step(5)
    assert env.agents == ["uas_2"]
    env.step(0)
    assert env.swarm_state().step == 2


@pytest.mark.parametrize("ended", [False, True])
def test_an_action_for_an_agent_that_never_existed_is_refused_and_changes_nothing(ended):
    env = uas_coverage_v0.parallel_env(practice_ground(n_uas=3), action="waypoint")
    env.reset()
    actions = {"uas_1": 0, "uas_2": HOME_CHOICE, "uas_3": 1}
    if ended:
        env.step(actions)
    before = env.state()
    for given in ({**actions, "uas_9": 7}, {"uas_9": 7, "uas_1": 0}):
        with pytest.raises(ValueError, match="7 for 'uas_9': there is no such agent: uas_1"):
            env.step(given)
    np.testing.assert_array_equal(env.state(), before)


def test_the_last_info_of_an_agent_is_complete():
    env = uas_coverage_v0.parallel_env(practice_ground(), action="waypoint")
    _, first = env.reset()
    *_, infos = env.step({"uas_1": HOME_CHOICE, "uas_2": 0})
    assert env.agents == ["uas_2"]
    assert infos["uas_1"]["status"] == UasStatus.LANDED
    assert forms(infos["uas_1"]) == forms(first["uas_1"])
    assert infos["uas_1"]["action_mask"][HOME_CHOICE] == 1


def test_masks_can_be_in_the_observation_of_each_agent():
    env = uas_coverage_v0.parallel_env(GROUND, **WAYPOINT)
    twin = uas_coverage_v0.parallel_env(GROUND, action="waypoint")
    space: Any = env.observation_space("uas_1")
    assert isinstance(space, Dict)
    assert space["observation"] == twin.observation_space("uas_1")
    assert space["action_mask"] == Box(0, 1, (13,), np.int8)
    (mine, infos), (plain, told) = env.reset(seed=1), twin.reset(seed=1)
    while True:
        assert list(mine) == list(plain)
        for agent, seen in mine.items():
            assert space.contains(seen)
            np.testing.assert_array_equal(seen["observation"], plain[agent])
            np.testing.assert_array_equal(seen["action_mask"], told[agent]["action_mask"])
            assert "action_mask" not in infos[agent]
        if not env.agents:
            break
        masks = {agent: mine[agent]["action_mask"] for agent in env.agents}
        actions = {a: env.action_space(a).sample(masks[a]) for a in env.agents}
        mine, *_, infos = env.step(actions)
        plain, *_, told = twin.step(actions)


def test_of_an_agent_that_has_ended_the_last_mask_is_still_known():
    # TorchRL asks for the masks of all possible agents
    env = uas_coverage_v0.parallel_env(practice_ground(), **WAYPOINT)
    env.reset()
    last, *_ = env.step({"uas_1": HOME_CHOICE, "uas_2": 0})
    for _ in range(3):
        seen, *_, infos = env.step({"uas_2": 0})
        assert list(seen) == list(infos) == ["uas_2"]
        assert "uas_1" not in seen
        assert seen["uas_1"] is last["uas_1"]
        assert pickle.loads(pickle.dumps(infos))["uas_1"]["status"] == UasStatus.LANDED
    seen, infos = env.reset()
    assert infos["uas_1"]["status"] == UasStatus.FLYING
    assert env.step({"uas_1": 0, "uas_2": 0})[0].keys() == seen.keys()


def test_in_turns_masks_can_be_in_the_observation():
    env: Any = uas_coverage_v0.env(practice_ground(), **WAYPOINT)
    env.reset()
    observation, *_ = env.last()
    assert env.observation_space("uas_1").contains(observation)
    assert observation["action_mask"].sum() > 1


@pytest.mark.parametrize("mode", list(AutoresetMode))
def test_masks_in_observations_of_many_missions_are_those_of_single_ones(mode):
    settings: dict[str, Any] = {"scenario": fleets, **WAYPOINT}
    env = make_vec(3, autoreset_mode=mode, **settings)
    twin = SyncVectorEnv([lambda: CoverageSwarmEnv(**settings)] * 3, autoreset_mode=mode)
    assert env.observation_space == twin.observation_space
    assert env.single_observation_space == twin.single_observation_space
    (mine, infos), (theirs, _) = env.reset(seed=3), twin.reset(seed=3)
    env.action_space.seed(0)
    ends = 0
    for _ in range(30):
        assert env.observation_space.contains(mine)
        assert "action_mask" not in infos
        for name in ("observation", "action_mask"):
            np.testing.assert_array_equal(mine[name], theirs[name])
        actions = env.action_space.sample()
        mine, _, terminated, truncated, infos = env.step(actions)
        theirs, *_, told = twin.step(actions)
        ended = terminated | truncated
        ends += ended.sum()
        if ended.any() and mode == AutoresetMode.SAME_STEP:
            for lane in np.flatnonzero(ended):
                last, expected = infos["final_obs"][lane], told["final_obs"][lane]
                for name in ("observation", "action_mask"):
                    np.testing.assert_array_equal(last[name], expected[name])
        if ended.any() and mode == AutoresetMode.DISABLED:
            options = {"reset_mask": ended}
            mine, theirs = env.reset(options=options)[0], twin.reset(options=options.copy())[0]
    assert ends > 2


def test_actions_without_choices_have_no_masks_to_put_into_observations():
    with pytest.raises(ValueError, match="mask_in_observation is True, and action 'velocity'"):
        uas_coverage_v0.parallel_env(GROUND, mask_in_observation=True)
    with pytest.raises(ValueError, match="mask_in_observation is 'yes'"):
        uas_coverage_v0.parallel_env(GROUND, action="waypoint", mask_in_observation="yes")


def test_states_have_one_size_for_each_fleet_and_number_of_waypoints():
    def size(**ground):
        return uas_coverage_v0.parallel_env(practice_ground(**ground)).state_space.shape

    assert size() == size(n_moving=1) == size(n_moving=4, tower=True)
    assert size(n_uas=3) != size()
    env = uas_coverage_v0.parallel_env(fleets)
    for seed in range(4):
        env.reset(seed=seed)
        assert env.state().shape == env.state_space.shape


def test_an_argument_that_there_is_not_is_the_error_that_libraries_wait_for():
    with pytest.raises(TypeError, match="unexpected keyword argument 'frameskip'") as caught:
        gymnasium.make(ID, scenario=GROUND, frameskip=1)
    assert isinstance(caught.value, ValueError)


@pytest.mark.parametrize("scenario", ["open_field", GROUND], ids=["name", "object"])
def test_a_spec_goes_through_json_with_its_scenario(scenario):
    env = gymnasium.make(ID, scenario=scenario, action="waypoint")
    assert env.spec is not None
    copy = gymnasium.make(EnvSpec.from_json(env.spec.to_json()))
    inner: Any = copy.unwrapped
    assert inner.scenario == (load_scenario(scenario) if scenario == "open_field" else scenario)
    assert inner.action_space == env.action_space
    assert copy.spec is not None
    assert copy.spec.to_json() == gymnasium.make(copy.spec).spec.to_json()


def test_a_spec_goes_through_json_with_the_ranges_of_generated_scenarios():
    ranges = GeneratedScenarios(n_uas=(2, 2), n_waypoints=(8, 12), n_obstacles=(1, 3))
    env = gymnasium.make(ID, scenario=ranges)
    assert env.spec is not None
    copy = gymnasium.make(EnvSpec.from_json(env.spec.to_json()))
    assert (env.reset(seed=3)[0] == copy.reset(seed=3)[0]).all()
    inner: Any = copy.unwrapped
    assert len(inner.scenario.uas) == 2
    assert 8 <= len(inner.scenario.waypoints) <= 12


def test_a_spec_of_many_missions_goes_through_json():
    grounds = [GROUND, practice_ground(max_steps=25)]
    env = make_vec(3, scenario=grounds, autoreset_mode=AutoresetMode.SAME_STEP)
    copy: Any = gymnasium.make_vec(EnvSpec.from_json(env.spec.to_json()))
    assert list(copy.batch.pool.scenarios) == grounds
    assert (copy.num_envs, copy.autoreset_mode) == (3, AutoresetMode.SAME_STEP)
    assert copy.spec.max_episode_steps == 25


def test_what_is_wrong_in_plain_data_of_a_scenario_is_one_line():
    data = json.loads(GROUND.model_dump_json(by_alias=True))
    data["dt_s"] = "long"
    with pytest.raises(InputError, match=r'scenario: dt_s: .*"long"'):
        uas_coverage_v0.parallel_env(data)


def test_the_spec_says_how_long_missions_last_where_all_last_as_long():
    def limit(**settings):
        spec = gymnasium.make(ID, **settings).spec
        return spec and spec.max_episode_steps

    assert limit(scenario=GROUND) == 25
    assert limit(scenario=GROUND, max_cycles=7) == 7
    assert limit(scenario=fleets) is None
    assert limit(scenario=fleets, max_cycles=7) == 7
    assert make_vec(scenario=GROUND).spec.max_episode_steps == 25
    mixed = [GROUND, practice_ground(max_steps=9)]
    assert make_vec(scenario=mixed).spec.max_episode_steps is None
    timed = gymnasium.wrappers.TimeAwareObservation(gymnasium.make(ID, scenario=GROUND))
    assert timed.reset()[0].shape == (2 * 234 + 1,)


def test_many_missions_take_the_limit_under_gymnasiums_name():
    env = make_vec(scenario=GROUND, max_episode_steps=3)
    env.reset()
    for k in range(3):
        *_, truncated, _ = env.step(np.zeros(env.action_space.shape))
        assert truncated.all() == (k == 2)
    assert make_vec(scenario=GROUND, max_episode_steps=5, max_cycles=4).spec.max_episode_steps == 4


def test_a_window_is_offered_only_where_one_can_be_opened():
    code = (
        "import sys; sys.modules.update({});"
        "import uas_coverage_env.env as e;"
        "print(*['human' in c.metadata['render_modes'] for c in "
        "(e.CoverageParallelEnv, e.CoverageSwarmEnv, e.CoverageVectorEnv)])"
    )
    without = {k: v for k, v in os.environ.items() if "DISPLAY" not in k and "SDL" not in k}

    def asked(code, **environment):
        command = [sys.executable, "-c", code]
        run = subprocess.run(command, env=without | environment, capture_output=True, text=True)
        return run.stdout.split()

    pytest.importorskip("pygame")
    assert asked(code.format("{}"), SDL_VIDEODRIVER="dummy") == ["True"] * 3
    if sys.platform == "linux":
        assert asked(code.format("{}")) == ["False"] * 3
    hidden = "import importlib.util as u; u.find_spec = lambda name: None;"
    assert asked(hidden + code.format("{}"), SDL_VIDEODRIVER="dummy") == ["False"] * 3
