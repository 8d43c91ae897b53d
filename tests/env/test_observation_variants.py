"""Observations of other kinds: local with a limited range, a picture, the whole mission."""

import json
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium import spaces
from practice_grounds import practice_ground

from uas_coverage_env import uas_coverage_v0
from uas_coverage_env.env import (
    OBSERVATION,
    CoverageBatch,
    ObservationBlock,
    full_state,
    full_state_of,
    grid,
    local,
    observation_columns,
)
from uas_coverage_env.env.observation.named import OBSERVATIONS
from uas_coverage_env.env.observation.surroundings import SURROUNDINGS
from uas_coverage_env.env.observation.waypoints import WAYPOINTS
from uas_coverage_env.flight import as_planner, rollout
from uas_coverage_env.vehicle.layout import X, Y

GROUND = practice_ground(n_uas=3, tower=True, n_moving=1, weights=[1.0, 2.0, 4.0])
SMALL = grid(8, 80.0)  # cells of 10 m


def first_seen(blocks, scenario=GROUND, **settings) -> Any:
    """What UAS 1 observes first: it is 20 m south of UAS 2, and 40 m of UAS 3."""
    env = uas_coverage_v0.parallel_env(scenario, observation=blocks, **settings)
    observations, _ = env.reset(seed=0)
    return observations["uas_1"]


def of(row, group, feature, blocks):
    return row[observation_columns(group, feature, blocks)]


def test_what_is_beyond_the_range_is_not_there_and_the_rest_is_as_usual():
    usual = first_seen(OBSERVATION)
    for range_m, others in ((30.0, [1, 0, 0]), (50.0, [1, 1, 0])):
        blocks = local(range_m)
        seen = first_seen(blocks)
        assert of(seen, "others", "valid", blocks).ravel().tolist() == others
        for group, feature in (("others", "direction"), ("others", "velocity")):
            there = of(usual, group, feature, OBSERVATION)
            expected = np.where(np.array(others)[:, None], there, 0.0)
            np.testing.assert_array_equal(of(seen, group, feature, blocks), expected)
    blocks = local(50.0)
    seen = first_seen(blocks)
    distances_m = [np.hypot(60.0 - 80.0, 0.0), 60.0, np.hypot(50.0, 20.0)]
    assert of(seen, "waypoints", "valid", blocks).sum() == sum(d <= 50.0 for d in distances_m)
    assert not of(seen, "moving_obstacles", "valid", blocks).any(), "it is some 80 m away"
    assert of(first_seen(local(100.0)), "moving_obstacles", "valid", blocks).sum() == 1
    for group in ("home", "surroundings"):
        block = next(each for each in OBSERVATION if each.name == group)
        for feature in block.features:
            np.testing.assert_array_equal(
                of(seen, group, feature.name, blocks), of(usual, group, feature.name, OBSERVATION)
            )
    for feature in ("position", "velocity", "flying", "charge_left", "time_left"):
        np.testing.assert_array_equal(
            of(seen, "own", feature, blocks), of(usual, "own", feature, OBSERVATION)
        )


def test_what_others_do_out_of_range_changes_nothing_of_a_local_observation():
    blocks = local(15.0)
    env = uas_coverage_v0.parallel_env(GROUND, observation=blocks)
    rows = []
    for east in (0.0, 1.0):
        env.reset(seed=0)
        for _ in range(6):
            actions = {agent: np.array([0.0, east, -0.5]) for agent in env.agents}
            actions["uas_1"] = np.array([0.0, 0.0, -0.5])
            seen, *_ = env.step(actions)
        rows.append(seen["uas_1"])
    np.testing.assert_array_equal(rows[0], rows[1])


def test_a_picture_shows_north_up_and_itself_in_the_middle():
    row = first_seen((SMALL,))
    image = row.reshape(SMALL.shape)
    opened, blocked, others, moving, home = image
    # uas_1 is at (80, 100): rows are 10 m each from 120 m north down, columns from 60 m east on
    assert np.argwhere(opened).tolist() == [[6, 4]], "the waypoint 20 m south of it"
    assert opened[6, 4] == pytest.approx(0.25), "and a quarter of the heaviest"
    assert np.argwhere(others).tolist() == [[0, 4], [2, 4]], "40 m and 20 m north of it"
    assert home[4, 4] == 1.0
    assert home.sum() == 1.0
    assert not moving.any()
    assert blocked[2, 0] == 1.0, "the tower at (95 to 105, 60 to 70)"
    assert not blocked[:, 3:].any()


def test_a_picture_marks_what_is_outside_of_the_fence_and_what_moves():
    wide = grid(10, 400.0)  # cells of 40 m, from 280 m to -120 m north
    image = first_seen((wide,)).reshape(wide.shape)
    blocked, moving = image[1], image[3]
    assert blocked[0].all()
    assert blocked[:, 0].all()
    assert not blocked[5, 5]
    assert (moving > 0).any()
    assert set(np.unique(moving)) <= {0.0, 0.5, 1.0}
    assert moving.max() == 0.5, "10 m above it"


def test_the_full_state_is_that_of_the_world_in_the_order_of_the_scenario():
    blocks = full_state(4, 5, 1)
    env = uas_coverage_v0.parallel_env(GROUND, observation=blocks)
    env.reset(seed=0)
    for _ in range(3):
        observations, *_ = env.step(dict.fromkeys(env.agents, np.array([0.5, 0.2, 0.0])))
    swarm, row = env.swarm_state(), observations["uas_2"]
    assert of(row, "all_uas", "valid", blocks).ravel().tolist() == [1, 1, 1, 0]
    assert of(row, "all_uas", "itself", blocks).ravel().tolist() == [0, 1, 0, 0]
    place = of(row, "all_uas", "position", blocks)
    np.testing.assert_allclose(place[:3, 0], swarm.x[:, X] / 100.0 - 1.0, atol=1e-6)
    np.testing.assert_allclose(place[:3, 1], swarm.x[:, Y] / 100.0 - 1.0, atol=1e-6)
    assert of(row, "all_waypoints", "valid", blocks).sum() == 3
    opened = of(row, "all_waypoints", "open", blocks).ravel()[:3]
    np.testing.assert_array_equal(opened, swarm.uncovered)
    assert of(row, "all_waypoints", "weight", blocks).ravel()[:3].tolist() == [0.25, 0.5, 1.0]
    assert of(row, "all_moving_obstacles", "velocity", blocks).ravel()[0] == pytest.approx(0.025)
    other = observations["uas_1"].copy()
    columns = observation_columns("all_uas", "itself", blocks)
    other[columns], row[columns] = 0, 0
    np.testing.assert_array_equal(other, row)
    assert [block.repeats for block in full_state_of(GROUND)] == [3, 3, 4], "the room of state()"


@pytest.mark.parametrize(
    "make",
    [
        lambda: local(0.0),
        lambda: local("far"),
        lambda: grid(3),
        lambda: grid(36.0),
        lambda: grid(36, -1.0),
        lambda: full_state(0, 3),
        lambda: full_state(1, 2.5),
        lambda: ObservationBlock("picture", 1, SMALL.features, SMALL.write, shape=(8, 8)),
        lambda: uas_coverage_v0.parallel_env(GROUND, observation="lokal"),
        lambda: uas_coverage_v0.parallel_env(GROUND, images_apart=True),
    ],
)
def test_what_makes_no_observation_is_refused_in_a_line(make):
    with pytest.raises(ValueError, match=r"give|take") as caught:
        make()
    assert "\n" not in str(caught.value)


def test_pictures_stand_apart_in_every_environment_and_are_the_same_numbers():
    # 236 numbers, as in test_blocks.py: a batch is compiled once for each size
    picture = grid(4, 80.0)
    blocks = (WAYPOINTS, SURROUNDINGS, picture)
    settings: dict[str, Any] = {"observation": blocks, "images_apart": True}
    flat = uas_coverage_v0.parallel_env(GROUND, observation=blocks)
    each = uas_coverage_v0.parallel_env(GROUND, **settings)
    swarm = gymnasium.make("UASCoverage-v0", scenario=GROUND, **settings)
    many = gymnasium.make_vec(
        "UASCoverage-v0",
        num_envs=2,
        vectorization_mode="vector_entry_point",
        scenario=GROUND,
        autoreset_mode="SameStep",
        max_cycles=3,
        **settings,
    )
    rows, _ = flat.reset(seed=0)
    seen, _ = each.reset(seed=0)
    joint, _ = swarm.reset(seed=0)
    batch, _ = many.reset(seed=0)
    space = each.observation_space("uas_1")
    assert isinstance(space, spaces.Dict)
    assert space["grid"] == spaces.Box(0, 255, (5, 4, 4), np.uint8)
    n = picture.size
    for i, agent in enumerate(each.agents):
        assert space.contains(seen[agent])
        np.testing.assert_array_equal(seen[agent]["observation"], rows[agent][:-n])
        image = np.rint(255.0 * rows[agent][-n:]).reshape(5, 4, 4)
        np.testing.assert_array_equal(seen[agent]["grid"], image)
        np.testing.assert_array_equal(joint["grid"][5 * i : 5 * i + 5], image)
    np.testing.assert_array_equal(joint["observation"], np.ravel([r[:-n] for r in rows.values()]))
    assert swarm.observation_space.contains(joint)
    for k in ("observation", "grid"):
        np.testing.assert_array_equal(batch[k][1], joint[k])
    for _ in range(3):
        batch, _, _, ended, infos = many.step(np.zeros((2, 9)))
    assert ended.all()
    assert many.single_observation_space.contains(infos["final_obs"][0])


def test_a_picture_alone_is_the_observation_and_a_mask_stands_beside_it():
    alone = uas_coverage_v0.parallel_env(GROUND, observation=(SMALL,), images_apart=True)
    seen, _ = alone.reset(seed=0)
    assert alone.observation_space("uas_1") == spaces.Box(0, 255, (5, 8, 8), np.uint8)
    assert seen["uas_2"].dtype == np.uint8
    masked = uas_coverage_v0.parallel_env(
        GROUND,
        observation=(SMALL,),
        images_apart=True,
        mask_in_observation=True,
        action="waypoint",
    )
    seen, _ = masked.reset(seed=0)
    assert set(seen["uas_1"]) == {"grid", "action_mask"}
    assert masked.observation_space("uas_1").contains(seen["uas_1"])


def test_a_policy_is_shown_as_a_planner_what_the_environment_shows():
    told = []

    def policy(seen):
        told.append(seen)
        return np.zeros(3, np.float32)

    settings: dict[str, Any] = {"observation": (*local(), SMALL), "images_apart": True}
    rollout(GROUND, as_planner(policy, **settings), max_steps=1)
    env = uas_coverage_v0.parallel_env(GROUND, **settings)
    observations, _ = env.reset(seed=0)
    for seen, expected in zip(told[-3:], observations.values(), strict=True):
        for key in ("observation", "grid"):
            np.testing.assert_array_equal(seen[key], expected[key])


def test_observations_have_names_that_a_spec_can_hold():
    env = gymnasium.make("UASCoverage-v0", scenario="open_field", observation="local")
    size = sum(block.size for block in OBSERVATIONS["local"])
    assert env.observation_space.shape == (size * len(env.unwrapped.scenario.uas),)
    assert env.spec is not None
    assert json.loads(env.spec.to_json())["kwargs"]["observation"] == "local"
    batch = CoverageBatch(1, "open_field", observation="default")
    assert batch.settings.observation == OBSERVATION
