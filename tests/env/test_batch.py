"""Lanes of a batch are single missions, bit for bit."""

import numba
import numpy as np
import pytest
from gymnasium.error import ResetNeeded
from practice_grounds import practice_ground, with_roles

from uas_coverage_env.entities.state import ABSENT, FLYING, LOST
from uas_coverage_env.env import CoverageBatch, CoverageParallelEnv
from uas_coverage_env.env.actions.kinds import ACTION_NAMES
from uas_coverage_env.env.batch.lane import drawn
from uas_coverage_env.env.batch.memory import UAS_AT_ONCE, lanes_at_once
from uas_coverage_env.env.batch.pool import ScenarioPool
from uas_coverage_env.env.episode.settings import MissionSettings
from uas_coverage_env.env.report import CONTACT, ENERGY, FIRST_TERM, LIMITS, STATUS
from uas_coverage_env.env.rewards.terms import REWARD_TERMS
from uas_coverage_env.scenario import generate_scenario
from uas_coverage_env.simulation.pool import pool_worlds
from uas_coverage_env.world import build_arena
from uas_coverage_env.world.arena import ARENA

MIXED = (
    practice_ground(n_uas=3, tower=True, n_moving=2, max_steps=25),
    practice_ground(n_uas=1, n_moving=0, max_steps=18),
    generate_scenario(1_000_000, n_uas=2, n_waypoints=12, n_obstacles=4),
    with_roles(
        practice_ground(
            n_uas=2, weights=(1.0, 2.0, 0.5), n_moving=1, vehicles=("hexacopter",)
        ).model_copy(update={"min_height_m": 8.0, "from_ground": True})
    ),
)


LANES = 200
"""More than fly at once: see `test_many_lanes_fly_in_blocks`."""


def random_actions(batch, seed):
    rng = np.random.default_rng(seed)
    if batch.chooses:
        return rng.integers(0, 13, (batch.num_envs, batch.n_uas))
    # beyond ±1, too
    return rng.uniform(-1.3, 1.3, (batch.num_envs, batch.n_uas, batch.actions.size))


def assert_is(batch, lane, env, observations, rewards=None, infos=None):
    """What a lane shows is what a `CoverageParallelEnv` has just said."""
    scenario = batch.scenario_of(lane)
    assert env.possible_agents == [uas.name for uas in scenario.uas]
    for i, agent in enumerate(env.possible_agents):
        if agent not in observations:
            assert batch.lanes.rewards[lane, i] == 0.0
            continue
        np.testing.assert_array_equal(batch.observation[lane, i], observations[agent])
        report = batch.learners.report[lane, i]
        if rewards is not None:
            assert batch.lanes.rewards[lane, i] == pytest.approx(rewards[agent], abs=1e-12)
        if infos is not None:
            info = infos[agent]
            assert tuple(info["reward_terms"]) == REWARD_TERMS
            terms = batch.learners.amounts[lane, i, FIRST_TERM:].tolist()
            assert list(info["reward_terms"].values()) == terms
            assert info["energy_Wh"] == batch.learners.amounts[lane, i, ENERGY]
            assert info["status"] == report[STATUS]
            assert info["limits_exceeded"] == report[LIMITS]
            assert info["contact"] == report[CONTACT]
            if batch.chooses:
                mask = batch.action_masks()[lane, i]
                np.testing.assert_array_equal(info["action_mask"], mask)
    n_uas = len(scenario.uas)
    assert not batch.observation[lane, n_uas:].any()
    assert (batch.worlds.uas["status"][lane, n_uas:] == ABSENT).all()


@pytest.mark.parametrize(
    ("action", "dynamics", "assisted"),
    [(action, "lpv", False) for action in ACTION_NAMES]
    + [("velocity", "nonlinear", True), ("waypoint", "lpv", True)],
)
def test_every_lane_flies_what_a_single_environment_flies(action, dynamics, assisted):
    settings = {
        "action": action,
        "dynamics": dynamics,
        "return_mode": assisted,
        "safety_filter": assisted,
        "reward_weights": {"team_coverage": 0.3},
    }
    batch = CoverageBatch(7, MIXED, **settings)
    batch.reset(seed=5)
    assert len(set(batch.lanes.scenario.tolist())) > 1
    envs, missions = {}, np.full(7, -1)
    for step in range(45):
        actions = random_actions(batch, step)
        begun = batch.lanes.mission != missions
        missions = batch.lanes.mission.copy()
        for lane in range(7):
            if begun[lane]:
                envs[lane] = CoverageParallelEnv(batch.scenario_of(lane), **settings)
                assert_is(batch, lane, envs[lane], envs[lane].reset()[0])
        ended = batch.lanes.terminated | batch.lanes.truncated
        batch.step(actions)
        for lane, env in envs.items():
            if ended[lane]:
                continue
            asked = {
                name: actions[lane, i]
                for i, name in enumerate(env.possible_agents)
                if name in env.agents
            }
            observations, rewards, _, truncations, infos = env.step(asked)
            assert_is(batch, lane, env, observations, rewards, infos)
            over = not env.agents
            assert over == batch.lanes.terminated[lane] | batch.lanes.truncated[lane]
            assert batch.lanes.truncated[lane] == any(truncations.values())
            assert not (batch.lanes.terminated[lane] and batch.lanes.truncated[lane])
    assert missions.max() > 0


def flown(num_envs, seed, threads=1):
    """Everything that 30 steps leave behind in lanes that are seeded one after the other."""
    batch = CoverageBatch(num_envs, MIXED, autoreset="same_step", max_cycles=9, threads=threads)
    batch.reset(seed=seed)
    rng = np.random.default_rng(0)
    for _ in range(30):
        # the same actions for the same lanes, however many there are
        actions = rng.uniform(-1, 1, (LANES, 3, 3))
        batch.step(actions[seed : seed + num_envs])
    return batch.state_dict()


@pytest.mark.parametrize("num_envs", [8, LANES])
def test_a_mission_does_not_depend_on_the_lanes_beside_it(num_envs):
    together = flown(num_envs, 0)
    assert (together["mission"] > 0).all()
    assert len(set(together["scenario"].tolist())) > 1
    for lane in range(0, num_envs, 3 if num_envs == 8 else 18):
        alone = flown(1, lane)
        for name, array in alone.items():
            np.testing.assert_array_equal(array[0], together[name][lane])


def test_many_lanes_fly_in_blocks():
    assert 1 < LANES / lanes_at_once(LANES, n_uas=3, threads=1) < LANES
    assert lanes_at_once(1024, n_uas=2, threads=1) == UAS_AT_ONCE / 2
    # a fleet that is larger flies alone
    assert lanes_at_once(4, n_uas=UAS_AT_ONCE + 1, threads=1) == 1


@pytest.mark.parametrize("num_envs", [1, 2, 7, 64, 100_000])
def test_threads_share_few_lanes_too(num_envs):
    at_once = lanes_at_once(num_envs, n_uas=2, threads=2)
    assert 1 <= at_once <= UAS_AT_ONCE / 2
    assert -(-num_envs // at_once) >= min(num_envs, 4)


@pytest.mark.skipif(numba.get_num_threads() == 1, reason="numba has one thread here")
@pytest.mark.parametrize("num_envs", [8, LANES])
def test_two_threads_fly_the_missions_of_one(num_envs):
    together = flown(num_envs, 0)
    shared = flown(num_envs, 0, threads=2)
    for name, array in together.items():
        np.testing.assert_array_equal(shared[name], array)


@pytest.mark.skipif(numba.get_num_threads() == 1, reason="numba has one thread here")
def test_two_threads_share_no_memory_with_the_filter_in_wind():
    """Once the braking that the filter tries was written to for a moment, by all lanes."""
    town = generate_scenario(3, n_uas=2, n_waypoints=6, n_obstacles=2, disturbances="moderate")
    actions = np.random.default_rng(0).uniform(-1.0, 1.0, (40, 4, 2, 3))

    def observed(threads):
        batch = CoverageBatch(4, town, threads=threads, safety_filter=True)
        batch.reset(seed=0)
        for action in actions:
            batch.step(action)
            yield batch.observation.copy()

    for step, (alone, shared) in enumerate(zip(observed(1), observed(2), strict=True)):
        np.testing.assert_array_equal(shared, alone, err_msg=f"step {step}")


def test_all_scenarios_are_drawn_about_equally_often():
    draws = [drawn(np.uint64(seed), mission, 5) for seed in range(100) for mission in range(20)]
    counts = np.bincount(draws, minlength=5)
    assert counts.min() > 340
    assert counts.max() < 460


def test_a_pool_holds_every_arena_as_it_is_built():
    pool = pool_worlds(MIXED).arenas
    for s, scenario in enumerate(MIXED):
        for mine, its in zip(ARENA.mission(pool, s), build_arena(scenario), strict=True):
            assert mine.dtype == its.dtype
            np.testing.assert_array_equal(mine, its)


def test_equal_vehicles_are_stored_once():
    grounds = [practice_ground(size_m=size_m) for size_m in (180.0, 200.0, 220.0)]
    pool = pool_worlds([*grounds, practice_ground(vehicles=("hexacopter",))]).arenas
    assert pool.first[:, ARENA.declaration._fields.index("vehicles")].tolist() == [0, 0, 0, 2]
    assert len(pool.arrays.vehicles) == 4


def test_what_a_lost_uas_saw_last_stays_also_after_going_on_from_a_state():
    batch = CoverageBatch(8, MIXED)
    batch.reset(seed=3)
    for step in range(14):
        batch.step(random_actions(batch, step))
    status = batch.worlds.uas["status"]
    waits = (status == LOST) & (status == FLYING).any(axis=1, keepdims=True)
    assert waits.any()
    last, mission = batch.observation.copy(), batch.lanes.mission.copy()
    other = CoverageBatch(8, MIXED)
    other.reset(seed=4)
    other.load_state_dict(batch.state_dict())
    for step in range(3):
        actions = random_actions(batch, 100 + step)
        np.testing.assert_array_equal(other.step(actions), batch.step(actions))
        stays = waits & (batch.lanes.mission == mission)[:, None]
        assert stays.any()
        np.testing.assert_array_equal(batch.observation[stays], last[stays])


def test_an_action_that_is_refused_changes_nothing():
    batch = CoverageBatch(3, MIXED)
    batch.reset(seed=5)
    batch.step(random_actions(batch, 0))
    before = batch.state_dict()
    actions = random_actions(batch, 1)
    n_uas = len(batch.scenario_of(1).uas)
    actions[1, n_uas - 1, 2] = np.inf
    with pytest.raises(ValueError, match=f"UAS {n_uas - 1} in environment 1"):
        batch.step(actions)
    after = batch.state_dict()
    del before["asked"], after["asked"]
    for name, array in before.items():
        np.testing.assert_array_equal(after[name], array)


def test_what_is_asked_of_a_uas_that_a_scenario_does_not_have_has_no_effect():
    batch, twin = (CoverageBatch(2, MIXED) for _ in range(2))
    for one in (batch, twin):
        one.reset(scenarios=[1, 1])
    actions = random_actions(batch, 0)
    batch.step(actions)
    actions[:, 1:] = np.nan
    np.testing.assert_array_equal(twin.step(actions), batch.observation)


@pytest.mark.parametrize(
    ("actions", "message"),
    [
        (np.zeros((2, 3, 2)), "shape"),
        (np.zeros((3, 3, 3)), "shape"),
        (np.zeros(18), "shape"),
        (np.zeros((2, 3, 3), dtype=bool), "real numbers"),
        (np.full((2, 3, 3), "north"), "real numbers"),
    ],
)
def test_actions_of_a_wrong_form_are_refused(actions, message):
    batch = CoverageBatch(2, MIXED)
    batch.reset()
    with pytest.raises(ValueError, match=message):
        batch.step(actions)


@pytest.mark.parametrize("choice", [-1, 13, 0.5])
def test_choices_that_do_not_exist_are_refused(choice):
    batch = CoverageBatch(2, MIXED, action="waypoint")
    batch.reset()
    with pytest.raises(ValueError, match="whole numbers"):
        batch.step(np.full((2, 3), choice))


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"scenario": []}, "no scenario"),
        ({"scenario": ["nowhere"]}, "nowhere"),
        ({"action": "teleport"}, "velocity"),
        ({"dynamics": "magic"}, "nonlinear"),
        ({"autoreset": "sometimes"}, "same_step"),
        ({"return_mode": 1}, "True or False"),
        ({"threads": 0}, "threads is 0"),
        ({"max_cycles": 0}, "max_cycles"),
        ({"reward_weights": {"glory": 1.0}}, "glory"),
    ],
)
def test_wrong_arguments_are_refused_with_what_is_allowed(settings, message):
    with pytest.raises(ValueError, match=message):
        CoverageBatch(2, **{"scenario": MIXED, **settings})


def test_a_batch_has_to_be_reset_first():
    batch = CoverageBatch(2, MIXED)
    with pytest.raises(ResetNeeded):
        batch.step(np.zeros((2, 9)))
    with pytest.raises(ResetNeeded):
        batch.reset(mask=np.array([True, False]))


def test_a_pool_takes_names_and_cuts_missions():
    pool = ScenarioPool(["open_field", MIXED[0]], MissionSettings(max_steps=7))
    assert [scenario.max_steps for scenario in pool.scenarios] == [7, 7]
    assert len(pool) == 2
    np.testing.assert_array_equal(pool.n_uas, [2, 3])


def test_lanes_tell_which_uas_fly():
    batch = CoverageBatch(1, MIXED)
    batch.reset(scenarios=[1])
    np.testing.assert_array_equal(batch.flying, [[True, False, False]])
    assert (batch.worlds.uas["status"][0] == [FLYING, ABSENT, ABSENT]).all()
    assert batch.swarm_state(0).names == ("uas_1",)


@pytest.mark.parametrize("step", [1, 3])
@pytest.mark.parametrize("autoreset", ["rest", "next_step", "same_step"])
def test_a_uas_decides_where_its_action_changes_what_comes(autoreset, step):
    # after three steps every mission is cut, while all fly
    batches = [CoverageBatch(3, MIXED, autoreset=autoreset, max_cycles=3) for _ in range(2)]
    for batch in batches:
        batch.reset(seed=0)
        for _ in range(step):
            batch.step(np.zeros((3, batch.n_uas, 3)))
    decided = batches[0].deciding
    for batch, asked in zip(batches, (0.0, 0.5), strict=True):
        batch.step(np.full((3, batch.n_uas, 3), asked))
    one, other = (batch.worlds.x for batch in batches)
    np.testing.assert_array_equal((one != other).any(axis=2), decided)
    assert decided.any() == (step == 1 or autoreset == "same_step")
