"""Blocks of observations and rewards: those of the package in another order, and a user's own."""

import math
import pickle
from dataclasses import replace
from typing import Any

import gymnasium
import numpy as np
import pytest
from own_blocks import SLOW, beacon
from practice_grounds import practice_ground

from uas_coverage_env import load_planner, uas_coverage_v0
from uas_coverage_env.env import (
    OBSERVATION,
    OBSERVATION_SIZE,
    REWARD,
    CoverageBatch,
    Feature,
    MissionInterface,
    MissionSettings,
    ObservationBlock,
    RewardTerm,
    observation_columns,
)
from uas_coverage_env.env.actions.velocity import VELOCITY
from uas_coverage_env.env.observation.layout import observation_bounds
from uas_coverage_env.features import constant_wind
from uas_coverage_env.mission import MissionBrief
from uas_coverage_env.vehicle.layout import VX, VY, X, Y

BEACON = beacon(30.0, -20.0)
OBSERVED = (*OBSERVATION, BEACON)
PAID = (*REWARD, SLOW)


def strength(x):
    return 1.0 / (1.0 + math.hypot(30.0 - x[X], -20.0 - x[Y]) / 100.0)


def flown(env, steps=12, seed=3) -> list[Any]:
    """Observations and infos of random steps."""
    rng = np.random.default_rng(seed)
    rows = [env.reset(seed=0)]
    for _ in range(steps):
        if not env.agents:
            break
        rows.append(env.step({agent: rng.uniform(-0.4, 0.4, 3) for agent in env.agents}))
    return rows


def test_an_own_sensor_is_observed_behind_the_usual_blocks():
    env = uas_coverage_v0.parallel_env(practice_ground(n_uas=2), observation=OBSERVED)
    usual = uas_coverage_v0.parallel_env(practice_ground(n_uas=2))
    size = OBSERVATION_SIZE + 2
    assert env.observation_space("uas_1").shape == (size,)
    for mine, theirs in zip(flown(env), flown(usual), strict=True):
        for agent, observation in mine[0].items():
            np.testing.assert_array_equal(observation[:OBSERVATION_SIZE], theirs[0][agent])
    x = env.swarm_state().x
    for i, agent in enumerate(env.agents):
        assert mine[0][agent][-2] == pytest.approx(strength(x[i]), rel=1e-6)
        assert mine[0][agent][-1] == (strength(x[i]) > 0.5)


def test_an_own_reward_term_is_paid_besides_the_usual_ones():
    env = uas_coverage_v0.parallel_env(practice_ground(n_uas=2), reward=PAID)
    usual = uas_coverage_v0.parallel_env(practice_ground(n_uas=2))
    paid = False
    for mine, theirs in zip(flown(env, 25)[1:], flown(usual, 25)[1:], strict=True):
        for agent, reward in mine[1].items():
            terms = mine[4][agent]["reward_terms"]
            assert list(terms) == [term.name for term in PAID]
            assert reward == pytest.approx(theirs[1][agent] + terms["slow"])
            paid |= terms["slow"] < 0.0
    assert paid
    x = env.swarm_state().x
    slow = -0.5 * max(0.0, math.hypot(x[0, VX], x[0, VY]) - 2.0)
    assert mine[4]["uas_1"]["reward_terms"]["slow"] == pytest.approx(slow)


def test_own_blocks_fly_in_a_batch_as_in_single_missions():
    ground = practice_ground(n_uas=2)
    batch = CoverageBatch(3, ground, observation=OBSERVED, reward=PAID)
    observation = batch.reset(0)
    env = uas_coverage_v0.parallel_env(ground, observation=OBSERVED, reward=PAID)
    observations, _ = env.reset()
    rng = np.random.default_rng(5)
    for _ in range(15):
        np.testing.assert_array_equal(observation[1], list(observations.values()))
        actions = rng.uniform(-0.3, 0.3, (3, 2, 3))
        observation = batch.step(actions)
        observations, rewards, *_ = env.step(dict(zip(env.agents, actions[1], strict=True)))
        assert batch.lanes.rewards[1].tolist() == list(rewards.values())


def test_every_environment_takes_own_blocks():
    ground = practice_ground(n_uas=2)
    blocks = {"observation": OBSERVED, "reward": PAID}
    single = gymnasium.make("UASCoverage-v0", scenario=ground, **blocks)
    many = gymnasium.make_vec(
        "UASCoverage-v0",
        num_envs=2,
        vectorization_mode="vector_entry_point",
        scenario=ground,
        **blocks,
    )
    turns = uas_coverage_v0.env(ground, **blocks)
    size = OBSERVATION_SIZE + 2
    assert single.observation_space.shape == (2 * size,)
    assert many.single_observation_space.shape == (2 * size,)
    assert turns.observation_space("uas_2").shape == (size,)
    single.reset(seed=0)
    observation, reward, _, _, info = single.step(single.action_space.sample())
    many.reset(seed=0)
    seen, paid, _, _, infos = many.step(np.stack([single.action_space.sample()] * 2))
    assert single.observation_space.contains(observation)
    assert many.single_observation_space.contains(seen[0])
    assert "slow" in info["reward_terms"]
    assert infos["reward_terms"]["slow"].shape == (2,)
    assert reward == pytest.approx(sum(info["reward_terms"].values()))
    assert np.isfinite(paid).all()


def test_the_usual_blocks_write_the_same_in_another_order():
    ground = practice_ground(n_uas=3, tower=True, n_moving=1)
    order = (*reversed(OBSERVATION),)
    env = uas_coverage_v0.parallel_env(ground, observation=order, reward=(*reversed(REWARD),))
    usual = uas_coverage_v0.parallel_env(ground)
    for mine, theirs in zip(flown(env), flown(usual), strict=True):
        for agent, observation in mine[0].items():
            for block in OBSERVATION:
                for feature in block.features:
                    at = observation_columns(block.name, feature.name, order)
                    there = observation_columns(block.name, feature.name)
                    np.testing.assert_array_equal(observation[at], theirs[0][agent][there])
        if len(mine) > 2:
            for agent, info in mine[4].items():
                assert info["reward_terms"] == theirs[4][agent]["reward_terms"]
    np.testing.assert_array_equal(env.state(), usual.state())


def test_an_observation_may_leave_out_what_is_not_needed():
    ground = practice_ground(n_uas=2)
    env = uas_coverage_v0.parallel_env(ground, observation=(BEACON,), reward=(SLOW,))
    observations, _ = env.reset(seed=0)
    assert observations["uas_1"].shape == (2,)
    usual = uas_coverage_v0.parallel_env(ground)
    usual.reset(seed=0)
    np.testing.assert_array_equal(env.state(), usual.state())


def test_a_planner_gets_the_same_observation_from_an_observer():
    ground = practice_ground(n_uas=2)
    env = uas_coverage_v0.parallel_env(ground, observation=OBSERVED)
    observations, _ = env.reset(seed=0)
    observer = MissionInterface(MissionBrief.of(ground), MissionSettings(observation=OBSERVED))
    np.testing.assert_array_equal(observer.observe(env.swarm_state()), list(observations.values()))


def test_an_environment_with_own_blocks_can_be_pickled():
    env = uas_coverage_v0.parallel_env(practice_ground(n_uas=2), observation=OBSERVED, reward=PAID)
    env.reset(seed=0)
    copy = pickle.loads(pickle.dumps(env))
    actions = {agent: np.full(3, 0.2) for agent in env.agents}
    mine, its = env.step(actions)[0], copy.step(actions)[0]
    for agent, observation in mine.items():
        np.testing.assert_array_equal(observation, its[agent])


def test_bounds_of_own_blocks_are_those_of_their_tables():
    low, high = observation_bounds(OBSERVED)
    assert low[-2:].tolist() == [0.0, 0.0]
    assert high[-2:].tolist() == [1.0, 1.0]
    assert observation_columns("beacon", "heard", OBSERVED).tolist() == [[OBSERVATION_SIZE + 1]]


def not_compiled(arena, state, tables, learners, i, parameters, row):
    row[0] = 0.0


PLAIN = ObservationBlock("plain", 1, (Feature("zero", 1, 0, 1, "always 0"),), not_compiled)


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"observation": BEACON}, "give a tuple of blocks"),
        ({"observation": (*OBSERVATION, "wind")}, "'wind' is no ObservationBlock"),
        ({"observation": (BEACON, BEACON)}, "give each a name of its own"),
        ({"observation": ()}, "give each a name of its own"),
        ({"reward": SLOW}, "give a tuple of terms"),
        ({"reward": "coverage"}, "reward is 'coverage'; give a tuple of terms"),
        ({"reward": (*REWARD, 3.0)}, "3.0 is no RewardTerm"),
        ({"reward": (SLOW, SLOW)}, "give each a name of its own"),
        ({"reward_weights": {"slow": 1.0}}, "no reward term 'slow'"),
        ({"rewards": PAID}, "unexpected keyword argument 'rewards'; there are action"),
        (
            {"observation": (*OBSERVATION, PLAIN)},
            "not_compiled is no compiled function; decorate it with",
        ),
        (
            {"reward": (RewardTerm("x", 1.0, "x", beacon),)},
            "beacon is no compiled function",
        ),
    ],
)
def test_what_is_no_block_is_refused_in_one_line(settings, message):
    with pytest.raises(ValueError, match=message) as error:
        uas_coverage_v0.parallel_env(practice_ground(), **settings)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize("dynamics", ["lpv", "nonlinear"])
def test_a_planner_flies_inside_of_an_environment(dynamics):
    ground = practice_ground(n_uas=2)
    env = uas_coverage_v0.parallel_env(ground, dynamics=dynamics)
    env.reset(seed=0)
    planner: Any = load_planner("nearest-waypoint")
    planner.reset(env.brief, 0)
    limit_mps = env.scenario.vehicles[0].limits.v_xy_max_mps
    for _ in range(20):
        commands = planner.act(env.swarm_state())
        assert set(commands) == set(env.agents)
        target = ground.waypoints[commands["uas_1"].waypoint].position_m
        away = np.array(target[:2]) - env.swarm_state().x[0, :2]
        towards = away / max(np.linalg.norm(away), limit_mps)
        env.step({agent: np.array([*towards, 0.0]) for agent in env.agents})
    assert np.linalg.norm(env.swarm_state().x[0, :2] - ground.uas[0].start_m[:2]) > 5.0


@pytest.mark.parametrize("given", [np.nan, np.inf, "1", True])
@pytest.mark.parametrize("block", [BEACON, SLOW, VELOCITY, constant_wind(1.0, 0.0)])
def test_a_kernel_is_handed_finite_parameters(block, given):
    with pytest.raises(ValueError, match=rf"{block.name}: parameters\[1\] is .*; give a finite"):
        replace(block, parameters=(1.0, given))
