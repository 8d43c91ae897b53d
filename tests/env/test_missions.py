"""Missions that are drawn at reset: by a family, or by any function rng -> Scenario."""

import copy
import pickle
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.error import ResetNeeded
from gymnasium.vector import AutoresetMode, SyncVectorEnv
from practice_grounds import practice_ground

from uas_coverage_env import generate_scenario, load_scenario, uas_coverage_v0
from uas_coverage_env.compiled.progress import COMPILATIONS
from uas_coverage_env.env import CoverageBatch, CoverageSwarmEnv, CoverageVectorEnv
from uas_coverage_env.env.batch.pool import ScenarioPool
from uas_coverage_env.files.strict_toml import InputError
from uas_coverage_env.leaderboard.scenario_sets import SETS
from uas_coverage_env.scenario import GeneratedScenarios, MissionSource

ID = "UASCoverage-v0"
SMALL = GeneratedScenarios(n_uas=(1, 3), n_waypoints=(4, 9), n_obstacles=(0, 3))


def grounds(rng):
    """A practice ground with one to three UAS, one to four waypoints, none to two balloons."""
    n_waypoints = int(rng.integers(1, 5))
    return practice_ground(
        n_uas=int(rng.integers(1, 4)),
        waypoints_m=tuple((60.0 + 20.0 * k, 140.0, -10.0) for k in range(n_waypoints)),
        n_moving=int(rng.integers(0, 3)),
        max_steps=int(rng.integers(4, 9)),
    )


def parallel(scenario=grounds, **settings):
    return uas_coverage_v0.parallel_env(scenario=scenario, **settings)


def make_vec(num_envs, scenario=grounds, **settings) -> Any:
    return gymnasium.make_vec(
        ID,
        num_envs=num_envs,
        vectorization_mode="vector_entry_point",
        scenario=scenario,
        **settings,
    )


def flown(env, steps=6):
    """What an environment says of some steps after a reset."""
    rng = np.random.default_rng(1)
    seen = []
    for _ in range(steps):
        actions = {a: rng.uniform(-1, 1, 3) for a in env.possible_agents}
        observations, rewards, *_ = env.step({a: actions[a] for a in env.agents})
        seen += [observations[a].tobytes() for a in observations]
        seen += [rewards, env.state().tobytes()]
    return seen


@pytest.mark.parametrize("scenario", [SMALL, grounds, "generated"])
def test_a_seed_repeats_the_mission_and_its_flight_in_a_fresh_environment_too(scenario):
    env, other = parallel(scenario), parallel(scenario)
    flights = []
    for each in (env, env, other):
        each.reset(seed=7)
        flights.append((each.scenario, flown(each)))
    assert flights[0] == flights[1] == flights[2]
    env.reset(seed=8)
    assert env.scenario != flights[0][0]


def test_without_a_seed_the_next_mission_is_drawn():
    env, other = parallel(), parallel()
    drawn = []
    for each in (env, other):
        each.reset(seed=3)
        drawn.append([each.scenario])
        for _ in range(5):
            each.reset()
            drawn[-1].append(each.scenario)
    assert drawn[0] == drawn[1]
    assert len({repr(scenario) for scenario in drawn[0]}) > 3


def test_a_fresh_environment_without_a_seed_draws_what_cannot_be_foreseen():
    envs = [parallel(SMALL) for _ in range(3)]
    for env in envs:
        env.reset()
    assert len({env.scenario.name for env in envs}) > 1


def test_a_mission_can_be_asked_for_by_name_by_file_and_as_a_scenario(tmp_path):
    env = parallel("generated")
    field = load_scenario("open_field")
    path = tmp_path / "mine.toml"
    field.to_file(path)
    for asked in ("open_field", path, str(path), field, "village"):
        env.reset(seed=2, options={"scenario": asked})
        assert env.scenario == (load_scenario("village") if asked == "village" else field)
        assert env.agents == ["uas_1", "uas_2"]
    env.reset()
    after = env.scenario
    env.reset(seed=2)
    assert env.scenario == after  # what is asked for is not drawn


def test_an_environment_of_one_scenario_flies_another_that_is_asked_for_and_comes_back():
    home, guest = practice_ground(n_uas=3), practice_ground(n_uas=1, tower=True)
    env = parallel(home)
    env.reset(options={"scenario": guest})
    assert env.scenario == guest
    assert env.agents == ["uas_1"]
    env.reset()
    assert env.scenario == home
    assert env.agents == env.possible_agents


def test_spaces_stay_and_smaller_fleets_leave_agents_out():
    env = parallel()
    assert env.possible_agents == ["uas_1", "uas_2", "uas_3"]
    state_space = env.state_space
    fleets = set()
    for seed in range(12):
        observations, infos = env.reset(seed=seed)
        n_uas = len(env.scenario.uas)
        assert env.agents == env.possible_agents[:n_uas] == list(observations) == list(infos)
        assert state_space.contains(env.state())
        assert env.brief.uas == env.scenario.uas
        assert env.swarm_state().names == tuple(env.agents)
        fleets.add(n_uas)
        actions = {agent: np.full(3, np.nan) for agent in env.possible_agents}
        actions |= {agent: np.zeros(3) for agent in env.agents}
        results = env.step(actions)  # what is asked of agents that are missing is ignored
        assert all(list(result) == env.possible_agents[:n_uas] for result in results)
    assert fleets == {1, 2, 3}


def test_what_a_mission_lacks_is_zero_in_the_state():
    env = parallel()
    alone = practice_ground(n_uas=1)
    env.reset(options={"scenario": alone})
    own = parallel(alone)
    own.reset()
    state, expected = env.state(), own.state()
    n = len(alone.waypoints)
    np.testing.assert_array_equal(state[: len(expected) - n], expected[:-n])
    assert state.sum() == pytest.approx(expected.sum())


def test_uas_of_drawn_missions_have_the_names_of_the_agents():
    corridor = load_scenario("corridor")  # quadcopter and hexacopter
    env = parallel(lambda rng: corridor)
    env.reset(seed=0)
    assert env.agents == ["uas_1", "uas_2"]
    assert env.swarm_state().names == ("uas_1", "uas_2")
    assert env.scenario.vehicles == corridor.vehicles


def test_all_interfaces_fly_the_same_missions():
    env, turns, swarm = (
        parallel(),
        uas_coverage_v0.env(grounds),
        gymnasium.make(ID, scenario=grounds),
    )
    many = make_vec(4)
    observations, _ = many.reset(seed=20)
    for i, seed in enumerate(range(20, 24)):
        expected, _ = env.reset(seed=seed)
        turns.reset(seed=seed)
        observation, info = swarm.reset(seed=seed)
        inner: tuple[Any, ...] = (turns.unwrapped, swarm.unwrapped)
        scenarios = (*(each.scenario for each in inner), many.call("scenario")[i])
        assert all(scenario == env.scenario for scenario in scenarios)
        assert turns.agents == env.agents == [n for n, u in info["uas"].items() if not u["status"]]
        size = observation.size // 3
        for k, agent in enumerate(env.possible_agents):
            row = observation[k * size : (k + 1) * size]
            np.testing.assert_array_equal(row, expected.get(agent, np.zeros(size)))
        np.testing.assert_array_equal(observation, observations[i])


@pytest.mark.parametrize("action", ["velocity", "waypoint"])
@pytest.mark.parametrize("mode", list(AutoresetMode))
def test_many_missions_are_drawn_as_single_environments_draw_them(mode, action):
    settings = {"scenario": grounds, "action": action}
    many = make_vec(5, autoreset_mode=mode, **settings)
    twin = SyncVectorEnv([lambda: CoverageSwarmEnv(**settings)] * 5, autoreset_mode=mode)
    assert many.observation_space == twin.observation_space
    assert many.action_space == twin.action_space
    mine, its = many.reset(seed=1), twin.reset(seed=1)
    many.action_space.seed(0)
    told = ("covered", "energy_Wh", "action_mask")[: 3 if action == "waypoint" else 2]
    ends = 0
    for _ in range(40):
        np.testing.assert_array_equal(mine[0], its[0])
        for name in told:
            np.testing.assert_array_equal(mine[-1][name], its[-1][name])
        assert many.call("scenario") == twin.get_attr("scenario")
        actions = many.action_space.sample()
        mine, its = many.step(actions), twin.step(actions)
        np.testing.assert_allclose(mine[1], its[1], rtol=0, atol=1e-12)
        for k in (2, 3):
            np.testing.assert_array_equal(mine[k], its[k])
        ended = mine[2] | mine[3]
        ends += ended.sum()
        if ended.any() and mode == AutoresetMode.SAME_STEP:
            for name in told:
                final, expected = mine[4]["final_info"], its[4]["final_info"]
                np.testing.assert_array_equal(final[name], expected[name])
            for lane in np.flatnonzero(ended):
                final, expected = mine[4]["final_obs"][lane], its[4]["final_obs"][lane]
                np.testing.assert_array_equal(final, expected)
        if ended.any() and mode == AutoresetMode.DISABLED:
            options = {"reset_mask": ended}
            mine, its = many.reset(options=options), twin.reset(options=options.copy())
    assert ends > 10


def test_neither_lanes_nor_threads_change_what_is_drawn():
    one, many = CoverageBatch(1, grounds), CoverageBatch(6, grounds, threads=2)
    one.reset(seed=13)
    many.reset(seed=10)
    for _ in range(25):
        seen = many.step(np.full((6, 3, 3), 0.3))
        np.testing.assert_array_equal(one.step(np.full((1, 3, 3), 0.3))[0], seen[3])


def test_many_missions_that_are_asked_for():
    many = make_vec(3, SMALL)
    ground, crowd = practice_ground(n_uas=1), practice_ground(n_uas=4)
    many.reset(seed=0, options={"scenario": ground})
    assert many.call("scenario") == (ground,) * 3
    many.reset(seed=0)
    drawn = many.call("scenario")
    many.reset(seed=0, options={"scenario": [ground, None, practice_ground(n_uas=2)]})
    assert many.call("scenario") == (ground, drawn[1], practice_ground(n_uas=2))
    assert many.call("brief")[0].waypoints == ground.waypoints
    with pytest.raises(ValueError, match="'practice' has 4 UAS"):
        many.reset(options={"scenario": [crowd] * 3})
    with pytest.raises(ValueError, match="a sequence of 3"):
        many.reset(options={"scenario": np.array([0, 1, 0])})
    assert many.call("scenario")[0] == ground  # what is refused changes nothing
    many.step(many.action_space.sample())


def test_an_action_that_is_refused_draws_nothing():
    batch, twin = CoverageBatch(3, grounds), CoverageBatch(3, grounds)
    batch.reset(seed=4)
    twin.reset(seed=4)
    actions = np.zeros((3, 3, 3))
    for _ in range(30):
        with pytest.raises(ValueError, match="finite"):
            batch.step(actions * np.nan)
        np.testing.assert_array_equal(batch.step(actions), twin.step(actions))


@pytest.mark.parametrize("mode", ["next_step", "same_step"])
def test_a_batch_that_was_kept_goes_on_with_the_same_missions(mode):
    actions = np.random.default_rng(0).uniform(-1, 1, (60, 4, 3, 3))
    batch = CoverageBatch(4, grounds, autoreset=mode)
    batch.reset(seed=9)
    for asked in actions[:30]:
        batch.step(asked)
    kept = batch.state_dict()
    travelled = pickle.loads(pickle.dumps(batch))
    copied = copy.deepcopy(batch)
    fresh = CoverageBatch(4, grounds, autoreset=mode)
    fresh.load_state_dict(kept)
    for asked in actions[30:]:
        expected = batch.step(asked).copy()
        for other in (travelled, copied, fresh):
            np.testing.assert_array_equal(other.step(asked), expected)
            assert other.pool.scenarios == batch.pool.scenarios


def test_states_that_no_batch_can_have_are_refused_and_change_nothing():
    batch = CoverageBatch(2, grounds)
    batch.reset(seed=1)
    state = batch.state_dict()
    before = list(batch.pool.scenarios)
    for name, wrong, said in (
        ("scenario", np.array([1, 1]), "scenario"),
        ("drawn_from", np.zeros((2, 6), np.uint64), "was not drawn"),
        ("drawn_from", np.full((2, 6), 2**63, np.uint64), "drawn_from"),
        ("uncovered", np.ones((2, 99), bool), "uncovered"),
    ):
        with pytest.raises(ValueError, match=said):
            batch.load_state_dict({**state, name: wrong})
        assert batch.pool.scenarios == before
    batch.reset(scenarios=practice_ground(n_uas=1))
    with pytest.raises(ValueError, match="environment 0 was given"):
        batch.state_dict()


def test_a_copy_of_an_environment_draws_what_the_original_draws():
    env = parallel()
    env.reset(seed=5)
    travelled, copied = pickle.loads(pickle.dumps(env)), copy.deepcopy(env)
    expected = flown(env, 2)
    env.reset()
    for other in (travelled, copied):
        assert flown(other, 2) == expected
        other.reset()
        assert other.scenario == env.scenario


def test_nothing_is_compiled_for_another_mission():
    env, many = parallel(SMALL), make_vec(3, SMALL)
    for seed in range(2):
        env.reset(seed=seed)
        env.step({agent: np.zeros(3) for agent in env.agents})
        many.reset(seed=seed)
        many.step(many.action_space.sample())
        if seed == 0:
            before = COMPILATIONS.n_compiled
    assert COMPILATIONS.n_compiled == before


def test_pictures_follow_the_mission():
    env = parallel(render_mode="rgb_array")
    pictures = []
    for ground in (practice_ground(n_uas=1, tower=True), practice_ground(n_uas=3, n_moving=1)):
        env.reset(options={"scenario": ground})
        own = parallel(ground, render_mode="rgb_array")
        own.reset()
        pictures.append(env.render())
        np.testing.assert_array_equal(pictures[-1], own.render())
    assert (pictures[0] != pictures[1]).any()


def test_before_the_first_mission_there_is_nothing_to_plan_for():
    env, swarm = parallel(), CoverageSwarmEnv(grounds)
    for each in (env, swarm):
        with pytest.raises(ResetNeeded, match="reset"):
            _ = each.brief
    env.reset(seed=0)
    env.max_cycles = 3
    assert env.max_cycles == 3
    env.reset()
    for _ in range(3):
        assert env.agents
        env.step({agent: np.zeros(3) for agent in env.agents})
    assert not env.agents


def test_what_generators_may_not_do_is_said_in_one_line():
    def grows(rng):
        return practice_ground(n_uas=9 if rng.bit_generator.seed_seq.entropy == 77 else 2)

    with pytest.raises(ValueError, match=r"returned 3 of type int; it should return a Scenario"):
        parallel(lambda rng: 3)
    env, many = parallel(grows), make_vec(2, grows)
    for each in (env, many):
        with pytest.raises(ValueError, match=r"has 9 UAS.*room for 2.*n_uas=9\)"):
            each.reset(seed=77)
        each.reset(seed=1)
    roomy = parallel(MissionSource(grows, n_uas=9))
    assert len(roomy.possible_agents) == 9
    roomy.reset(seed=77)
    assert len(roomy.agents) == 9
    narrow = parallel(MissionSource(lambda rng: practice_ground(), n_waypoints=3))
    long = practice_ground(waypoints_m=[(20.0 * k, 20.0, -10.0) for k in range(2, 6)])
    with pytest.raises(ValueError, match=r"has 4 waypoints.*n_waypoints=4\)"):
        narrow.reset(options={"scenario": long})


@pytest.mark.parametrize("make", [parallel, CoverageSwarmEnv, lambda name: make_vec(1, name)])
def test_unknown_names_are_refused_with_those_that_exist(make):
    with pytest.raises(InputError, match=r"'vilage'; take .*village.* family .*generated"):
        make("vilage")
    env = make("generated")
    with pytest.raises(ValueError, match="no option 'scenarios'; did you mean 'scenario'"):
        env.reset(options={"scenarios": "village"})
    with pytest.raises(InputError, match="unknown scenario 'streets'; did you mean streets:SEED"):
        env.reset(options={"scenario": "streets"})
    with pytest.raises(ValueError, match=r"are 'village'; give a mapping"):
        env.reset(options="village")


@pytest.mark.parametrize("wrong", [{"n_uas": 0}, {"n_uas": 2.0}, {"n_waypoints": "3"}])
def test_bounds_are_whole_numbers(wrong):
    with pytest.raises(ValueError, match=next(iter(wrong))):
        MissionSource(grounds, **wrong)


def test_a_pool_holds_scenarios_and_nothing_that_draws_them():
    with pytest.raises(ValueError, match="nothing that draws"):
        ScenarioPool(grounds)


def test_families_never_draw_what_planners_are_compared_on():
    scenario = GeneratedScenarios()(np.random.default_rng(0))
    seed = int(scenario.name.split("-")[1][1:])
    assert seed > max(max(seeds) for seeds in SETS.values())


def windy(rng):
    """A small mission in a wind that is drawn, too."""
    town = generate_scenario(int(rng.integers(100)), n_uas=2, n_waypoints=4, n_obstacles=2)
    wind = {"mean_mps": float(rng.uniform(1.0, 5.0)), "from_deg": float(rng.uniform(0.0, 360.0))}
    return type(town).model_validate({**town.model_dump(by_alias=True), "wind": wind})


def test_a_wind_that_is_drawn_blows_in_single_and_batched_missions():
    single: Any = CoverageSwarmEnv(windy)
    many = make_vec(2, windy)
    seen, rows = single.reset(seed=3)[0], many.reset(seed=2)[0]
    np.testing.assert_array_equal(seen, rows[1])
    assert single.scenario.wind == many.call("scenario")[1].wind
    action = np.zeros(single.action_space.shape, np.float32)
    for _ in range(5):
        seen, rows = single.step(action)[0], many.step(np.stack([action] * 2))[0]
        np.testing.assert_array_equal(seen, rows[1])
    calm = CoverageSwarmEnv(single.scenario.model_copy(update={"wind": None}))
    calm.reset()
    still = [calm.step(action)[0] for _ in range(5)][-1]
    assert not np.array_equal(still, seen)


def test_a_disturbance_that_no_example_had_is_refused_in_a_batch():
    drawn = []

    def surprising(rng):
        drawn.append(None)
        town = generate_scenario(1, n_uas=1, n_waypoints=4, n_obstacles=0)
        if len(drawn) <= 32:
            return town
        wind = {"mean_mps": 3.0, "from_deg": 0.0}
        return type(town).model_validate({**town.model_dump(by_alias=True), "wind": wind})

    with pytest.raises(ValueError, match="wind is new"):
        CoverageVectorEnv(2, surprising).reset(seed=0)
