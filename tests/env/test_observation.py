import itertools
import math

import numpy as np
import pytest
from gymnasium import spaces
from practice_grounds import practice_ground

from uas_coverage_env import uas_coverage_v0
from uas_coverage_env.env import (
    K_WAYPOINTS,
    OBSERVATION,
    OBSERVATION_SIZE,
    CoverageParallelEnv,
    CoverageSwarmEnv,
    observation_columns,
)
from uas_coverage_env.env.observation.layout import layout_table, observation_bounds
from uas_coverage_env.env.observation.surroundings import free_way
from uas_coverage_env.scenario import generate_scenario, load_scenario
from uas_coverage_env.vehicle.layout import DOD, PHI, U_TH, VX, WX
from uas_coverage_env.world import build_arena


def flown(scenario, steps=12, seed=3, **settings):
    """An environment some random steps into its mission, and the last observations."""
    env = uas_coverage_v0.parallel_env(scenario, **settings)
    observations, _ = env.reset(seed=0)
    rng = np.random.default_rng(seed)
    for _ in range(steps):
        actions = {a: np.append(rng.uniform(-0.3, 0.3, 2), 0.3) for a in env.agents}
        observations, *_ = env.step(actions)
    assert env.agents == env.possible_agents
    return env, observations


def feature(observation, group, name):
    return observation[observation_columns(group, name)]


def close(distance_m):
    return 1 / (1 + distance_m / 30)


def test_the_space_has_the_size_and_bounds_of_the_layout():
    env = uas_coverage_v0.parallel_env(practice_ground())
    space = env.observation_space("uas_1")
    assert isinstance(space, spaces.Box)
    low, high = observation_bounds()
    assert space.shape == (OBSERVATION_SIZE,) == (234,)
    assert space.dtype == np.float32
    np.testing.assert_array_equal(space.low, low)
    np.testing.assert_array_equal(space.high, high)
    assert np.isfinite(low).all()
    assert (low < high).all()


def test_every_number_belongs_to_exactly_one_feature():
    columns = [
        observation_columns(group.name, feature.name).ravel()
        for group in OBSERVATION
        for feature in group.features
    ]
    assert sorted(np.concatenate(columns).tolist()) == list(range(OBSERVATION_SIZE))


def test_the_yaw_of_a_uas_that_looks_where_it_flies_is_shown_whole():
    ground = practice_ground()
    fleet = (ground.uas[0].model_copy(update={"heading": "course"}), ground.uas[1])
    env = CoverageParallelEnv(ground.model_copy(update={"uas": fleet}))
    env.reset(seed=0)
    for _ in range(14):
        south = {agent: np.array([-0.4, 0.1, 0.0]) for agent in env.agents}
        observations, *_ = env.step(south)
    yaw, other = (feature(observations[a], "own", "attitude")[0, 2] for a in env.agents)
    assert yaw == pytest.approx(env.swarm_state().heading_rad[0] / math.pi)
    assert 0.9 < yaw < 1.0
    assert other == 0.0


@pytest.mark.parametrize(("former", "name"), [("crowd", "density"), ("rival", "nearest_uas")])
def test_a_feature_is_found_under_its_former_name(former, name):
    found, wanted = (observation_columns("waypoints", each) for each in (former, name))
    np.testing.assert_array_equal(found, wanted)


def test_an_unknown_feature_is_refused_with_those_known():
    with pytest.raises(ValueError, match=r"own\.position"):
        observation_columns("own", "pozition")


@pytest.mark.parametrize("environment", [CoverageParallelEnv, CoverageSwarmEnv])
def test_the_documentation_shows_the_layout(environment):
    rows = [line.strip() for line in environment.__doc__.splitlines()]
    assert set(layout_table().splitlines()) <= set(rows)
    sections = ["Description", "Action Space", "Observation Space", "Rewards", "Starting State"]
    sections += ["Episode End", "Arguments", "Version History"]
    places = [rows.index(f"{section}:") for section in sections]
    assert places == sorted(places)


@pytest.mark.parametrize(
    "scenario",
    [
        practice_ground(n_uas=1, waypoints_m=((60.0, 100.0, -10.0),)),
        practice_ground(n_uas=5, tower=True, n_moving=3),
        generate_scenario(1, n_uas=8, n_waypoints=60, n_obstacles=12),
        load_scenario("corridor"),
    ],
    ids=["bare", "full", "generated", "corridor"],
)
def test_observations_have_the_same_space_in_every_scenario(scenario):
    env, observations = flown(scenario, steps=3)
    assert set(observations) == set(env.possible_agents)
    for agent, observation in observations.items():
        assert observation.shape == (OBSERVATION_SIZE,)
        assert observation.dtype == np.float32
        assert env.observation_space(agent).contains(observation)
        assert observation.any()


def test_own_state_is_scaled_by_fence_and_limits():
    scenario = practice_ground(vehicles=("s500_v2", "hexacopter"), soc_0=0.8)
    env, observations = flown(scenario)
    state = env.swarm_state()
    for i, agent in enumerate(env.agents):
        limits = scenario.vehicles[i].limits
        x, seen = state.x[i], observations[agent]
        place = [x[0] / 100 - 1, x[1] / 100 - 1, -x[2] / 20 - 1]
        fast = max(limits.v_up_max_mps, limits.v_down_max_mps)
        speeds = x[VX : VX + 3] / [limits.v_xy_max_mps, limits.v_xy_max_mps, fast]
        angles = x[PHI : PHI + 3] / [limits.tilt_max_rad, limits.tilt_max_rad, limits.yaw_max_rad]
        rates = [limits.rate_max_radps, limits.rate_max_radps, limits.yaw_rate_max_radps]
        expected = {
            "position": place,
            "velocity": speeds,
            "attitude": angles,
            "rates": x[WX : WX + 3] / rates,
            "reference": state.reference_mps[i] / limits.v_xy_max_mps,
            "flying": 1.0,
            "departed": state.departed[i],
            "returning": 0.0,
            "rank": float(i),
            "dod": x[DOD],
            "polarisation": x[U_TH],
            "charge_left": (0.75 - x[DOD]) / 0.75,
            "time_left": 1 - 12 / 60,
            "uncovered": 1.0,
        }
        for name, value in expected.items():
            actual = feature(seen, "own", name)[0]
            np.testing.assert_allclose(actual, value, atol=1e-6, err_msg=name)


def test_home_is_seen_where_it_is():
    env, observations = flown(practice_ground())
    state = env.swarm_state()
    for i, agent in enumerate(env.agents):
        way = env.scenario.uas[i].start_m - state.x[i, :3]
        level_m = math.hypot(way[0], way[1])
        seen = observations[agent]
        np.testing.assert_allclose(
            feature(seen, "home", "direction")[0], way[:2] / level_m, atol=1e-5
        )
        assert feature(seen, "home", "closeness").item() == pytest.approx(close(level_m), abs=1e-5)
        assert feature(seen, "home", "below").item() == pytest.approx(way[2] / 20, abs=1e-5)


def test_the_nearest_open_waypoints_come_first():
    env, observations = flown(load_scenario("village"), steps=8)
    state = env.swarm_state()
    scenario = env.scenario
    places = np.array([w.position_m for w in scenario.waypoints])
    weights = np.array([w.weight for w in scenario.waypoints])
    spaces = np.linalg.norm(places[:, None] - places[None], axis=2)
    for i, agent in enumerate(env.agents):
        seen = observations[agent]
        to = places - state.x[i, :3]
        away_m = np.linalg.norm(to, axis=1)
        order = np.argsort(away_m)[:K_WAYPOINTS]
        np.testing.assert_array_equal(feature(seen, "waypoints", "valid"), np.ones((12, 1)))
        columns = {
            "closeness": close(away_m[order]),
            "below": np.clip(to[order, 2] / 20, -1, 1),
            "weight": weights[order] / 2,
        }
        near = np.where(np.eye(len(places), dtype=bool), np.inf, spaces)
        columns["neighbour"] = close(near.min(axis=1)[order])
        columns["density"] = np.minimum((near < 100).sum(axis=1), 8)[order] / 8
        other_m = np.linalg.norm(places - state.x[1 - i, :3], axis=1)
        columns["nearest_uas"] = close(other_m[order])
        home_m = np.linalg.norm(places - scenario.uas[i].start_m, axis=1)
        columns["from_home"] = close(home_m[order])
        for name, expected in columns.items():
            actual = feature(seen, "waypoints", name)[:, 0]
            np.testing.assert_allclose(actual, expected, atol=1e-5, err_msg=name)
        directions = to[order, :2] / np.linalg.norm(to[order, :2], axis=1, keepdims=True)
        np.testing.assert_allclose(feature(seen, "waypoints", "direction"), directions, atol=1e-5)


def test_places_without_a_waypoint_are_zero():
    _, observations = flown(practice_ground())
    start = observation_columns("waypoints", "valid")[3, 0]
    end = observation_columns("others", "valid")[0, 0]
    assert not observations["uas_1"][start:end].any()
    assert feature(observations["uas_1"], "waypoints", "valid")[:3].all()


def test_a_covered_waypoint_is_no_longer_seen():
    scenario = practice_ground(waypoints_m=((130.0, 100.0, -10.0), (60.0, 150.0, -10.0)))
    env = uas_coverage_v0.parallel_env(scenario)
    observations, _ = env.reset()
    assert feature(observations["uas_2"], "waypoints", "valid").sum() == 2
    infos = {}
    while not infos or infos["uas_2"]["covered"] == 0:
        actions = {"uas_1": np.array([0, 0, -0.5]), "uas_2": np.array([0.3, 0, -0.5])}
        observations, _, _, _, infos = env.step(actions)
    for observation in observations.values():
        assert feature(observation, "waypoints", "valid").sum() == 1
        assert feature(observation, "own", "uncovered").item() == pytest.approx(0.5)


def test_a_waypoint_that_another_flies_to_is_taken():
    env = uas_coverage_v0.parallel_env(practice_ground(), action="waypoint")
    env.reset()
    places = np.array([waypoint.position_m for waypoint in env.scenario.waypoints])
    before = np.linalg.norm(places - env.swarm_state().x[0, :3], axis=1)
    observations, *_ = env.step({"uas_1": 0, "uas_2": 12})
    own, other = (
        feature(observations[a], "waypoints", "taken")[:3, 0] for a in env.possible_agents
    )
    assert not own.any()
    order = np.argsort(np.linalg.norm(places - env.swarm_state().x[1, :3], axis=1))
    assert other.tolist() == (order == before.argmin()).tolist()


def test_sectors_and_centre_describe_all_that_is_open():
    waypoints_m = ((160.0, 110.0, -10.0), (160.0, 100.0, -10.0), (90.0, 20.0, -10.0))
    env = uas_coverage_v0.parallel_env(
        practice_ground(n_uas=1, waypoints_m=waypoints_m, weights=[1.0, 2.0, 1.0])
    )
    observations, _ = env.reset()
    seen = observations["uas_1"]
    expected = [0.75, 0, 0, 0, 0, 0.25, 0, 0]
    np.testing.assert_allclose(feature(seen, "remaining", "sectors")[0], expected, atol=1e-6)
    centre = np.average(np.array(waypoints_m), axis=0, weights=[1, 2, 1])[:2] - [100, 100]
    np.testing.assert_allclose(feature(seen, "remaining", "centre")[0], centre / 250, atol=1e-6)


@pytest.mark.parametrize("degrees", range(0, 360, 15))
def test_a_sector_holds_an_eighth_of_the_horizon(degrees):
    angle = math.radians(degrees + 1)
    place = (100 + 50 * math.cos(angle), 100 + 50 * math.sin(angle), -10.0)
    env = uas_coverage_v0.parallel_env(practice_ground(n_uas=1, waypoints_m=(place,)))
    observations, _ = env.reset()
    sectors = feature(observations["uas_1"], "remaining", "sectors")[0]
    assert int(sectors.argmax()) == degrees // 45
    assert sectors.sum() == pytest.approx(1.0)


def marched(scenario, position_m, direction, limit_m=80.0, step_m=0.02):
    """Length of a ray by walking along it."""
    along = np.arange(0.0, limit_m, step_m)
    points = position_m + along[:, None] * np.asarray(direction)
    free = scenario.fence.signed_distance(points) <= 0
    for hull in scenario.hulls:
        free &= hull.signed_distance(points) > 0
    return limit_m if free.all() else along[int(np.argmin(free))]


def test_rays_end_at_obstacles_and_fence():
    scenario = load_scenario("village")
    env = uas_coverage_v0.parallel_env(scenario)
    env.reset()
    for _ in range(16):
        # towards the north-western forest and the western houses
        north = {"uas_1": np.array([0.7, 0.4, -0.2]), "uas_2": np.array([-0.1, 0.5, -0.9])}
        observations, *_ = env.step(north)
    arena = build_arena(scenario)
    half = math.sqrt(0.5)
    level = [(1, 0), (half, half), (0, 1), (-half, half), (-1, 0), (-half, -half), (0, -1)]
    level.append((half, -half))
    directions = [(*d, 0.0) for d in level] + [(0, 0, -1.0), (0, 0, 1.0)]
    for i, agent in enumerate(env.agents):
        position_m = env.swarm_state().x[i, :3]
        rays = feature(observations[agent], "surroundings", "rays")[0]
        for ray, direction in zip(rays, directions, strict=True):
            free_m = marched(scenario, position_m, direction)
            assert 80 * (1 - ray) == pytest.approx(free_m, abs=0.03)
            for look_m in (80.0, 5.0):
                found_m = free_way(arena, *position_m, *direction, look_m)
                assert found_m == pytest.approx(min(80 * (1 - ray), look_m), abs=1e-3)
        inside_m = -scenario.fence.signed_distance(position_m) - 0.5
        fence = feature(observations[agent], "surroundings", "fence").item()
        assert fence == pytest.approx(np.clip(inside_m / 20, -1, 1), abs=1e-5)


def test_a_ray_and_the_clearance_see_the_tower():
    scenario = practice_ground(n_uas=1, tower=True)
    env = uas_coverage_v0.parallel_env(scenario)
    observations, _ = env.reset()
    seen = observations["uas_1"]
    rays = feature(seen, "surroundings", "rays")[0]
    assert 80 * (1 - rays[6]) == pytest.approx(30.0, abs=1e-4)
    assert feature(seen, "surroundings", "clearance").item() == 1.0
    for _ in range(9):
        observations, *_ = env.step({"uas_1": np.array([0.0, -0.25, -0.5])})
    clearance_m = scenario.hulls[0].signed_distance(env.swarm_state().x[0, :3])
    assert 3 < clearance_m < 15
    seen = feature(observations["uas_1"], "surroundings", "clearance").item()
    assert seen == pytest.approx(clearance_m / 20, abs=1e-5)


def test_the_nearest_other_uas_come_first():
    env, observations = flown(practice_ground(n_uas=5), steps=6)
    x = env.swarm_state().x
    limit = env.scenario.vehicles[0].limits.v_xy_max_mps
    for i, agent in enumerate(env.agents):
        to = x[:, :3] - x[i, :3]
        away_m = np.linalg.norm(to, axis=1)
        order = np.argsort(away_m)[1:4]
        seen = observations[agent]
        closeness = feature(seen, "others", "closeness")[:, 0]
        np.testing.assert_allclose(closeness, close(away_m[order]), atol=1e-5)
        relative = (x[order, 3:5] - x[i, 3:5]) / limit
        np.testing.assert_allclose(feature(seen, "others", "velocity"), relative, atol=1e-5)
        charge = (0.75 - x[order, DOD]) / 0.75
        np.testing.assert_allclose(feature(seen, "others", "charge_left")[:, 0], charge, atol=1e-5)


def test_equally_distant_uas_are_all_seen():
    scenario = practice_ground(n_uas=3)
    env = uas_coverage_v0.parallel_env(scenario)
    observations, _ = env.reset()
    seen = observations["uas_2"]
    assert feature(seen, "others", "valid")[:, 0].tolist() == [1.0, 1.0, 0.0]
    assert feature(seen, "others", "direction")[:2].tolist() == [[-1.0, 0.0], [1.0, 0.0]]


def test_a_uas_that_has_ended_is_no_longer_seen_and_sees_itself_ended():
    env = uas_coverage_v0.parallel_env(practice_ground(), action="waypoint")
    env.reset()
    observations, *_ = env.step({"uas_1": 12, "uas_2": 0})
    assert feature(observations["uas_1"], "own", "flying").item() == 0.0
    assert not feature(observations["uas_2"], "others", "valid").any()
    assert not feature(observations["uas_2"], "waypoints", "nearest_uas").any()


def test_the_nearest_moving_obstacles_come_first():
    env, observations = flown(practice_ground(n_moving=4), steps=4)
    step = env.swarm_state().step
    centres = env.scenario.moving_positions(float(step))
    x = env.swarm_state().x
    for i, agent in enumerate(env.agents):
        to = centres - x[i, :3]
        level_m = np.hypot(to[:, 0], to[:, 1])
        clearance_m = np.maximum(level_m - 4, np.abs(to[:, 2]) - 3)
        order = np.argsort(clearance_m)[:2]
        seen = observations[agent]
        closeness = feature(seen, "moving_obstacles", "closeness")[:, 0]
        np.testing.assert_allclose(closeness, close(clearance_m[order] - 0.4), atol=1e-5)
        directions = to[order, :2] / level_m[order, None]
        seen_directions = feature(seen, "moving_obstacles", "direction")
        np.testing.assert_allclose(seen_directions, directions, atol=1e-5)
        limits = env.scenario.vehicles[i].limits
        relative = (np.array([0.5, 0, 0]) - x[i, 3:6]) / [
            limits.v_xy_max_mps,
            limits.v_xy_max_mps,
            max(limits.v_up_max_mps, limits.v_down_max_mps),
        ]
        for velocity in feature(seen, "moving_obstacles", "velocity"):
            np.testing.assert_allclose(velocity, relative, atol=1e-5)


def test_planners_do_not_see_where_a_moving_obstacle_will_go():
    scenario = load_scenario("village")
    later = scenario.moving_obstacles[0].model_copy(
        update={"schedule": scenario.moving_obstacles[0].schedule[:1]}
    )
    other = scenario.model_copy(update={"moving_obstacles": (later,)})
    for first, second in itertools.pairwise([flown(s, steps=4)[1] for s in (scenario, other)]):
        for agent, observation in first.items():
            np.testing.assert_array_equal(observation, second[agent])


def test_the_global_state_lists_uas_moving_obstacles_and_waypoints():
    env, observations = flown(practice_ground(n_moving=2), steps=4)
    state = env.state()
    assert state.shape == env.state_space.shape == (2 * 26 + 4 * 6 + 3,)
    assert state.dtype == np.float32
    assert env.state_space.contains(state)
    np.testing.assert_array_equal(state[:24], observations["uas_1"][:24])
    np.testing.assert_array_equal(state[26:50], observations["uas_2"][:24])
    centre = env.scenario.moving_positions(4.0)[0]
    np.testing.assert_allclose(
        state[52:55], [centre[0] / 100 - 1, centre[1] / 100 - 1, 0.0], atol=1e-6
    )
    np.testing.assert_allclose(state[55:58], [0.025, 0, 0], atol=1e-6)
    assert not state[64:76].any()  # there is room for two more
    assert state[-3:].tolist() == [1.0, 1.0, 1.0]


def test_observations_of_earlier_steps_are_never_written_again():
    env = uas_coverage_v0.parallel_env(practice_ground())
    kept, copies = [], []
    observations, _ = env.reset()
    for _ in range(5):
        kept.append(observations["uas_1"])
        copies.append(observations["uas_1"].copy())
        observations, *_ = env.step({a: np.array([0.5, 0.1, 0.2]) for a in env.agents})
    for array, copy in zip(kept, copies, strict=True):
        np.testing.assert_array_equal(array, copy)
