"""What `uas_coverage_v1` observes and pays; what it has in common with `uas_coverage_v0`."""

import json
import math
import os
import subprocess
import sys

import numpy as np
import pytest
from practice_grounds import box, practice_ground

from uas_coverage_env import uas_coverage_v0, uas_coverage_v1
from uas_coverage_env.env import OBSERVATION_SIZE, CoverageBatch, observation_columns
from uas_coverage_env.env.observation.scales import K_WAYPOINTS
from uas_coverage_env.env.versions import V1
from uas_coverage_env.scenario import Obstacle

POTENTIALS = {"to_waypoint": 1.0, "to_home": 1.0}


def walled(**settings):
    """A wall that is too high to pass over stands east of the two starts."""
    ground = practice_ground(**settings)
    corners = box((60.0, 125.0, -39.9), (130.0, 130.0, 0.0))
    wall = Obstacle(name="wall", safe_distance_m=2.0, vertices_m=corners)
    return ground.model_copy(update={"obstacles": (wall,)})


BEHIND = walled(n_uas=1, waypoints_m=((100.0, 160.0, -10.0), (40.0, 60.0, -10.0)))


def ways_of(row):
    """(K, 4) the rows of the block: direction, closeness, leg."""
    columns = [
        observation_columns("ways", name, V1.observation)
        for name in ("direction", "closeness", "leg")
    ]
    return row[np.concatenate(columns, axis=1)]


def flown(steps=6, weights=POTENTIALS, door=uas_coverage_v1.parallel_env):
    env = door(walled(n_uas=2), reward_weights=weights)
    rng = np.random.default_rng(3)
    seen, _ = env.reset(seed=1)
    every, paid = [seen], []
    for _ in range(steps):
        actions = {a: rng.uniform(-1, 1, 3).astype(np.float32) for a in env.agents}
        seen, rewards, *_ = env.step(actions)
        every.append(seen)
        paid.append(rewards)
    return every, paid


def test_the_direction_to_a_waypoint_behind_a_wall_is_that_of_the_first_leg_round_it():
    env = uas_coverage_v1.parallel_env(BEHIND)
    seen = env.reset(seed=0)[0]["uas_1"]
    straight = seen[observation_columns("waypoints", "direction", V1.observation)]
    north, east, closeness, leg = ways_of(seen)[0]
    assert np.allclose(straight[0], [0.0, 1.0], atol=1e-6)
    assert abs(north) > 0.3
    assert math.isclose(math.hypot(north, east), 1.0, rel_tol=1e-6)
    way_m, leg_m = 30.0 / closeness - 30.0, 30.0 / leg - 30.0
    assert 60.0 + 10.0 < way_m < 160.0
    assert 25.0 < leg_m < 0.8 * way_m


def test_the_way_to_a_waypoint_in_sight_is_straight():
    seen = uas_coverage_v1.parallel_env(BEHIND).reset(seed=0)[0]["uas_1"]
    north, east, closeness, leg = ways_of(seen)[1]
    away_m = math.hypot(60.0, 40.0)
    assert np.allclose([north, east], [-60.0 / away_m, -40.0 / away_m], atol=1e-6)
    assert math.isclose(closeness, 30.0 / (30.0 + away_m), rel_tol=1e-6)
    assert closeness == leg
    assert not ways_of(seen)[2:].any()


def test_the_way_to_a_waypoint_above_its_start_is_the_way_home():
    ground = walled(n_uas=1, waypoints_m=((100.0, 100.0, -35.0), (20.0, 20.0, -35.0)))
    env = uas_coverage_v1.parallel_env(ground, action="acceleration")
    env.reset(seed=0)
    for _ in range(6):
        seen, *_ = env.step({"uas_1": np.array([0.3, -0.4, 0.0], np.float32)})
    row = seen["uas_1"]
    home = [
        row[observation_columns("home", name)].ravel().tolist()
        for name in ("direction", "closeness")
    ]
    to = ways_of(row)
    assert [to[0, :2].tolist(), to[0, 2:3].tolist()] == home
    assert 0.1 < to[0, 2] < 0.95


def test_the_first_numbers_are_those_of_v0():
    one, _ = flown(0)
    other, _ = flown(0, None, uas_coverage_v0.parallel_env)
    for agent, row in one[0].items():
        assert row.size == OBSERVATION_SIZE + 4 * K_WAYPOINTS
        assert np.array_equal(row[:OBSERVATION_SIZE], other[0][agent])


def test_a_batch_sees_and_pays_the_same():
    every, paid = flown()
    batch = CoverageBatch(2, walled(n_uas=2), version="v1", reward_weights=POTENTIALS)
    rng = np.random.default_rng(3)
    rows = batch.reset(1)
    for k, rewards in enumerate(paid):
        assert all(np.array_equal(rows[1, i], row) for i, row in enumerate(every[k].values()))
        asked = np.stack([rng.uniform(-1, 1, 3).astype(np.float32) for _ in rewards])
        rows = batch.step(np.stack([asked] * 2))
        assert batch.lanes.rewards[1, : len(rewards)].tolist() == list(rewards.values())


def test_what_python_alone_flies_is_the_same():
    code = (
        "import json; from test_version_1 import flown; seen, paid = flown(2);"
        "print(json.dumps([{a: r.tolist() for a, r in seen[-1].items()}, paid[-1]]))"
    )
    path = os.pathsep.join([os.path.dirname(__file__), *sys.path])
    environment = {**os.environ, "NUMBA_DISABLE_JIT": "1", "PYTHONPATH": path}
    ran = subprocess.run(
        [sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=True
    )
    there, pay = json.loads(ran.stdout)
    seen, paid = flown(2)
    assert {agent: row.tolist() for agent, row in seen[-1].items()} == there
    assert paid[-1] == pytest.approx(pay, rel=1e-12)


def test_infos_are_flat():
    env = uas_coverage_v1.parallel_env(walled(n_uas=1))
    _, infos = env.reset(seed=0)
    assert "reward_terms_left_open" in infos["uas_1"]
    assert not any(isinstance(value, dict) for value in infos["uas_1"].values())
