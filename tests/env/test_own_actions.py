"""Kinds of action from outside of the package, in every environment."""

import math
import pickle
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium import spaces
from own_actions import (
    BRAKE,
    CLIMB_RATE,
    GO_HOME,
    MANOEUVRES,
    faulty,
    heading_and_speed,
    write_climb,
)
from practice_grounds import practice_ground

from uas_coverage_env import UasStatus, uas_coverage_v0
from uas_coverage_env.env import ActionKind, CoverageBatch
from uas_coverage_env.env.actions import ACTIONS, ACTIONS_V1
from uas_coverage_env.env.actions.planar import PLANAR
from uas_coverage_env.env.actions.velocity import VELOCITY_V1
from uas_coverage_env.env.actions.waypoint import WAYPOINT_V1
from uas_coverage_env.vehicle import load_vehicle
from uas_coverage_env.vehicle.layout import VX, VY, VZ

# those of another version are own kinds to v0
OWN = [CLIMB_RATE, heading_and_speed(5.0), MANOEUVRES, VELOCITY_V1, PLANAR, WAYPOINT_V1]
NAMES = [kind.name for kind in OWN]
LIMITS = load_vehicle("s500_v2").limits


def drawn(kind, rng, shape):
    if kind.choices:
        return rng.integers(0, kind.choices, shape)
    return rng.uniform(-1.0, 1.0, (*shape, kind.size))


def many_of(ground, kind, **settings):
    return gymnasium.make_vec(
        "UASCoverage-v0",
        num_envs=3,
        vectorization_mode="vector_entry_point",
        scenario=ground,
        action=kind,
        **settings,
    )


def test_an_own_kind_flies_as_its_kernel_says():
    env = uas_coverage_v0.parallel_env(practice_ground(), action=CLIMB_RATE)
    env.reset(seed=0)
    for _ in range(6):
        env.step({"uas_1": np.array([0.5, 0.0, 1.0]), "uas_2": np.array([0.0, -0.25, -0.5])})
    first, second = env.swarm_state().x
    assert first[VX] == pytest.approx(0.5 * LIMITS.v_xy_max_mps, rel=0.02)
    assert first[VZ] == pytest.approx(-LIMITS.v_up_max_mps, rel=1e-6)
    assert second[VY] == pytest.approx(-0.25 * LIMITS.v_xy_max_mps, rel=0.02)
    assert second[VZ] == pytest.approx(0.5 * LIMITS.v_down_max_mps, rel=1e-6)


def test_its_space_follows_from_its_numbers():
    env = uas_coverage_v0.parallel_env(practice_ground(), action=heading_and_speed(5.0))
    assert env.action_space("uas_1") == spaces.Box(-1.0, 1.0, (5,), np.float32)
    choices = uas_coverage_v0.parallel_env(practice_ground(), action=MANOEUVRES)
    assert choices.action_space("uas_2") == spaces.Discrete(3)


@pytest.mark.parametrize("kind", OWN, ids=NAMES)
@pytest.mark.parametrize("helped", [False, True])
def test_it_flies_in_a_batch_as_in_single_missions(kind, helped):
    ground = practice_ground(n_uas=2, tower=True, n_moving=1)
    settings = {"action": kind, "return_mode": helped, "safety_filter": helped}
    env = uas_coverage_v0.parallel_env(ground, **settings)
    observations, _ = env.reset()
    batch = CoverageBatch(3, ground, **settings)
    observation = batch.reset(0)
    rng = np.random.default_rng(1)
    for _ in range(20):
        for i, agent in enumerate(env.possible_agents):
            if agent in env.agents:
                np.testing.assert_array_equal(observation[1, i], observations[agent])
        actions = drawn(kind, rng, (3, 2))
        observation = batch.step(actions)
        given = dict(zip(env.possible_agents, actions[1], strict=True))
        observations, *_ = env.step({agent: given[agent] for agent in env.agents})
        if not env.agents:
            break


@pytest.mark.parametrize("kind", OWN, ids=NAMES)
def test_every_environment_takes_it(kind):
    ground = practice_ground(n_uas=2)
    single: Any = gymnasium.make("UASCoverage-v0", scenario=ground, action=kind)
    many = many_of(ground, kind)
    turns: Any = uas_coverage_v0.env(ground, action=kind)
    assert many.single_action_space == single.action_space
    single.reset(seed=0)
    many.reset(seed=0)
    turns.reset(seed=0)
    single.action_space.seed(0)
    action = single.action_space.sample()
    alone, *_ = single.step(action)
    together, *_ = many.step(np.stack([action] * 3))
    np.testing.assert_array_equal(together[2], alone)
    for row in np.reshape(action, (2, -1)):
        turns.step(row[0] if kind.choices else row)
    np.testing.assert_array_equal(turns.swarm_state().x, single.unwrapped.swarm_state().x)


def test_choices_have_the_mask_that_the_kind_says():
    ground = practice_ground(n_uas=2)
    _, infos = uas_coverage_v0.parallel_env(ground, action=MANOEUVRES).reset()
    assert infos["uas_1"]["action_mask"].tolist() == [1, 1, 1]
    everywhere = practice_ground(waypoints_m=[(20.0 + 10 * k, 30.0, -10.0) for k in range(12)])
    env = uas_coverage_v0.parallel_env(everywhere, action=MANOEUVRES)
    _, infos = env.reset()
    assert infos["uas_1"]["action_mask"].tolist() == [1, 0, 1]
    many = many_of(everywhere, MANOEUVRES)
    _, told = many.reset()
    assert told["action_mask"].tolist() == [[1, 0, 1] * 2] * 3


def test_a_kind_that_goes_to_places_has_guidance():
    env = uas_coverage_v0.parallel_env(practice_ground(tower=True), action=MANOEUVRES)
    env.reset()
    for _ in range(6):
        env.step(dict.fromkeys(env.agents, 2))
    env.step(dict.fromkeys(env.agents, BRAKE))
    infos = {}
    for _ in range(40):
        if env.agents:
            *_, infos = env.step(dict.fromkeys(env.agents, GO_HOME))
    assert {info["status"] for info in infos.values()} == {UasStatus.LANDED}


def test_it_runs_on_a_simulated_gpu(flown_on_gpu):
    flown = dict(flown_on_gpu["actions"])
    for kind in ("numbers", "choices"):
        result = flown.pop(kind)
        assert result["different"] == []
        assert result["apart"]
        assert result["restarts"] >= 2
    # a command that cannot be flown is braked, and reported after the step
    assert flown.pop("not flyable") == {"refused": [True, False], "moved": [True, True]}
    assert flown.pop("half a choice") == {"refused": [False, True], "moved": [True, False]}
    for result in flown.values():
        assert result == {"refused": [True, False], "moved": [False, True]}


@pytest.mark.parametrize("fault", [0, 1, 2], ids=["not finite", "no guidance", "no kind"])
def test_a_command_that_cannot_be_flown_is_an_error_and_never_flown(fault):
    env = uas_coverage_v0.parallel_env(practice_ground(), action=faulty(fault))
    env.reset()
    env.step({"uas_1": np.array([0.2]), "uas_2": np.array([0.3])})
    with pytest.raises(ValueError, match="kind 'faulty' wrote a command for uas_2 that cannot"):
        env.step({"uas_1": np.array([0.2]), "uas_2": np.array([0.9])})
    assert np.isfinite(env.swarm_state().x).all()
    batch = CoverageBatch(2, practice_ground(), action=faulty(fault))
    batch.reset(0)
    with pytest.raises(ValueError, match="kind 'faulty' wrote a command for UAS 1 that cannot"):
        batch.step(np.array([[[0.0], [0.0]], [[0.0], [0.9]]]))
    assert np.isfinite(batch.worlds.x).all()


def test_an_environment_with_an_own_kind_can_be_pickled():
    env = uas_coverage_v0.parallel_env(practice_ground(), action=CLIMB_RATE)
    env.reset(seed=0)
    copy = pickle.loads(pickle.dumps(env))
    actions = {agent: np.full(3, 0.2) for agent in env.agents}
    mine, its = env.step(actions)[0], copy.step(actions)[0]
    for agent, observation in mine.items():
        np.testing.assert_array_equal(observation, its[agent])


def test_every_kind_of_the_package_says_what_it_is():
    for kind in (*ACTIONS, *ACTIONS_V1):
        assert kind.meaning.endswith(".")
        assert bool(kind.numbers) != bool(kind.choices)


def ranges_of(*rows):
    return lambda vehicle, scenario: rows


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({}, "give numbers and ranges, or choices"),
        ({"numbers": ("a",)}, "give numbers and ranges, or choices"),
        ({"choices": -1}, "give numbers and ranges, or choices"),
        (
            {"numbers": ("a",), "ranges": ranges_of((0.0, 0.0, 1.0)), "choices": 2},
            "give numbers and ranges, or choices",
        ),
        (
            {"numbers": ("a", "b"), "ranges": ranges_of((0.0, 0.0, 1.0))},
            "ranges have shape .1, 3.; give lowest, middle and highest of 2 numbers",
        ),
        (
            {"numbers": ("a",), "ranges": ranges_of((1.0, 0.0, 2.0))},
            "ranges of uas_1 are .*lowest ≤ middle ≤ highest",
        ),
        (
            {"numbers": ("a",), "ranges": ranges_of((0.0, 0.0, math.nan))},
            "ranges of uas_1 are .*give finite numbers",
        ),
        (
            {"numbers": ("a",), "ranges": ranges_of((0.0, 0.0, 1.0)), "write": print},
            "print is no compiled function; decorate it with",
        ),
    ],
)
def test_what_is_no_kind_is_refused_in_one_line(given, message):
    with pytest.raises(ValueError, match=message) as error:
        uas_coverage_v0.parallel_env(
            practice_ground(),
            action=ActionKind(**{"name": "mine", "meaning": "", "write": write_climb, **given}),
        )
    assert "\n" not in str(error.value)


def test_what_is_neither_a_name_nor_a_kind_is_refused():
    with pytest.raises(ValueError, match="waypoint, or an ActionKind"):
        uas_coverage_v0.parallel_env(practice_ground(), action=write_climb)
