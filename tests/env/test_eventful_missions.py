"""Events and sensors in the environments: the same in single and batched missions."""

import gymnasium
import numpy as np
import pytest
from practice_grounds import box, practice_ground

from uas_coverage_env import ContactKind, UasStatus, World, uas_coverage_v0
from uas_coverage_env.env import CoverageBatch
from uas_coverage_env.env.gpu.missions import CudaMissions
from uas_coverage_env.scenario import Scenario
from uas_coverage_env.world import Wrench

GROUND = practice_ground(n_uas=2, max_steps=16)
SENSING = {"position_noise_m": 0.5, "velocity_bias_mps": 0.1, "delay_steps": 2}
EVENTS = (
    {"kind": "uas_lost", "rate_per_h": 300.0},
    {"kind": "radio_lost", "rate_per_h": 600.0, "for_s": 4.0, "then": "return"},
    {"kind": "gnss_lost", "at_s": 3.0, "for_s": 5.0, "drift_mps": 1.0},
    {"kind": "late_start", "at_s": 4.0, "uas": "uas_2"},
    {"kind": "charge_lost", "rate_per_h": 300.0, "share": 0.1},
    {"kind": "motor_degraded", "at_s": 5.0, "thrust_share": 0.9, "power_factor": 1.3},
    {"kind": "waypoint_dropped", "at_s": 6.0, "waypoint": 1},
)
EVENTFUL = GROUND.model_copy(update={"events": EVENTS, "sensing": SENSING})


@pytest.mark.parametrize("action", ["velocity", "waypoint"])
def test_what_happens_in_a_lane_happens_in_a_single_mission_of_its_seed(action):
    pool = [EVENTFUL, practice_ground(n_uas=1, max_steps=16)]
    batch = CoverageBatch(3, pool, action=action, safety_filter=True)
    batch.reset(40, scenarios=[0, 1, 0])
    envs = [
        uas_coverage_v0.parallel_env(pool[s], action=action, safety_filter=True) for s in (0, 1, 0)
    ]
    for lane, env in enumerate(envs):
        env.reset(seed=40 + lane)
    rng = np.random.default_rng(1)
    for _ in range(14):
        if action == "velocity":
            actions = rng.uniform(-0.4, 0.4, (3, 2, 3))
        else:
            actions = rng.integers(0, 2, (3, 2))
        observation = batch.step(actions)
        for lane, env in enumerate(envs):
            asked = dict(zip(env.possible_agents, actions[lane], strict=False))
            seen, *_, infos = env.step({agent: asked[agent] for agent in env.agents})
            told, single = batch.swarm_state(lane), env.swarm_state()
            np.testing.assert_array_equal(told.x, single.x)
            np.testing.assert_array_equal(told.status, single.status)
            np.testing.assert_array_equal(told.responds, single.responds)
            for agent, row in seen.items():
                i = env.possible_agents.index(agent)
                np.testing.assert_array_equal(observation[lane, i], row)
                assert infos[agent]["status"] == batch.worlds.uas[lane, i].status
    assert (batch.worlds.uas["status"] == UasStatus.LOST).any()


def test_a_uas_that_an_event_takes_ends_with_a_fault_and_no_violation():
    env = uas_coverage_v0.parallel_env(
        GROUND.model_copy(update={"events": ({"kind": "uas_lost", "at_s": 1.0, "uas": "uas_1"},)})
    )
    env.reset(seed=0)
    *_, terminated, _, infos = env.step({agent: np.zeros(3) for agent in env.agents})
    assert infos["uas_1"]["contact"] == ContactKind.FAULT
    assert terminated == {"uas_1": True, "uas_2": False}
    assert env.agents == ["uas_2"]


def test_observations_show_what_is_sensed():
    rough = {"position_noise_m": 20.0}
    env, blurred = (
        uas_coverage_v0.parallel_env(GROUND.model_copy(update={"sensing": sensing}))
        for sensing in (None, rough)
    )
    for each in (env, blurred):
        each.reset(seed=0)
    rows = []
    for each in (env, blurred):
        actions = {agent: np.zeros(3) for agent in each.agents}
        rows.append(np.concatenate(list(each.step(actions)[0].values())))
    assert (rows[0] != rows[1]).any()
    assert (env.state() != blurred.state()).any()


CORNERS_M = box((70.0, 20.0, -30.0), (80.0, 30.0, 0.0))
SCENE_EVENTS = (
    {"kind": "waypoint_added", "at_s": 2.0, "position_m": (150.0, 150.0, -10.0), "radius_m": 8.0},
    {"kind": "obstacle_added", "at_s": 3.0, "name": "crane", "safe_distance_m": 2.0,
     "vertices_m": CORNERS_M},
    {"kind": "no_fly_zone", "at_s": 4.0, "name": "zone", "safe_distance_m": 2.0,
     "vertices_m": box((95.0, 140.0, -40.0), (115.0, 160.0, 0.0))},
    {"kind": "moving_obstacle_added", "at_s": 5.0, "name": "kite", "radius_m": 3.0,
     "height_m": 5.0, "safe_distance_m": 2.0, "position_m": (20.0, 180.0, -20.0),
     "velocity_mps": (1.0, 0.0, 0.0)},
    {"kind": "moving_obstacle_turns", "at_s": 6.0, "moving_obstacle": "balloon_0",
     "velocity_mps": (0.0, -2.0, 0.0)},
    {"kind": "home_closed", "at_s": 7.0, "uas": "uas_1", "alternative_m": (90.0, 112.0, -10.0)},
)  # fmt: skip


def changing(*events):
    """A field whose scene changes."""
    ground = practice_ground(n_uas=2, n_moving=1, max_steps=16)
    return Scenario.model_validate(ground.model_dump(by_alias=True) | {"events": events})


@pytest.mark.parametrize("action", ["velocity", "waypoint"])
def test_a_scene_that_changes_is_flown_and_seen_with_the_same_spaces(action):
    env = uas_coverage_v0.parallel_env(changing(*SCENE_EVENTS), action=action, safety_filter=True)
    env.reset(seed=3)
    n_waypoints, first = len(env.brief.waypoints), None
    for again in range(2):
        observations, _ = env.reset(seed=3)
        assert len(env.brief.waypoints) == n_waypoints  # as at first
        rows = []
        for _ in range(10):
            actions = {agent: np.ones(3) * 0.1 for agent in env.agents}
            if action == "waypoint":
                actions = dict.fromkeys(env.agents, 0)
            observations, *_ = env.step(actions)
            assert all(row in env.observation_space(agent) for agent, row in observations.items())
            assert env.state() in env.state_space
            rows.append(np.concatenate([*observations.values(), env.state()]))
        first = rows if first is None else first
        np.testing.assert_array_equal(rows, first)
        assert again in (0, 1)
    brief, swarm = env.brief, env.swarm_state()
    assert len(brief.waypoints) == n_waypoints + 1
    assert [obstacle.name for obstacle in brief.obstacles] == ["crane", "zone"]
    assert not swarm.uncovered[2]  # it lies in the zone
    assert len(swarm.moving_position_m) == 2
    assert swarm.moving_velocity_mps[0].tolist() == [0.0, -2.0, 0.0]
    assert swarm.home_m[0].tolist() == [90.0, 112.0, -10.0]


def test_an_environment_flies_a_changed_scene_as_the_world_does():
    scenario = changing(*SCENE_EVENTS)
    env = uas_coverage_v0.parallel_env(scenario, action="wrench")
    env.reset(seed=5)
    world = World(scenario, seed=5)
    for _ in range(12):
        world.step({name: Wrench(0.0, 0.0, 0.0, 0.0) for name in world.active})
        env.step({agent: np.zeros(4) for agent in env.agents})
        swarm = env.swarm_state()
        np.testing.assert_array_equal(swarm.x, world.state.x)
        np.testing.assert_array_equal(swarm.uncovered, world.state.uncovered)
    assert world.revisions == len(SCENE_EVENTS)


def test_what_comes_is_seen_in_the_sample_in_which_it_comes():
    far, near = (
        changing({**SCENE_EVENTS[0], "position_m": (place_m, 95.0, -10.0)})
        for place_m in (199.0, 105.0)
    )
    rows = []
    for scenario in (far, near):
        env = uas_coverage_v0.parallel_env(scenario)
        env.reset(seed=0)
        seen = [env.step({a: np.zeros(3) for a in env.agents})[0]["uas_1"] for _ in range(2)]
        rows.append(seen)
    np.testing.assert_array_equal(rows[0][0], rows[1][0])
    assert (rows[0][1] != rows[1][1]).any()


def test_one_agent_for_the_swarm_flies_a_changed_scene_and_its_picture_shows_it():
    env = gymnasium.make(
        "UASCoverage-v0", scenario=changing(*SCENE_EVENTS), render_mode="rgb_array"
    )
    env.reset(seed=0)
    before = env.render()
    for _ in range(8):
        observation, *_ = env.step(np.zeros(6, np.float32))
        assert observation in env.observation_space
    assert (np.asarray(env.render()) != np.asarray(before)).mean() > 0.001


def test_an_event_that_sends_home_past_overhangs_is_refused_on_a_gpu():
    corners = box((40.0, 40.0, -20.0), (60.0, 60.0, -10.0))
    canopy = {"name": "canopy", "safe_distance_m": 2.0, "vertices_m": corners}
    lost = {"kind": "planner_lost", "at_s": 5.0}
    scenario = GROUND.model_copy(update={"events": (lost,), "obstacles": (canopy,)})
    with pytest.raises(ValueError, match="an event that sends UAS home, where obstacles overhang"):
        CudaMissions(1, scenario)


def test_a_batch_that_is_put_aside_goes_on_with_its_events():
    batch, other = (CoverageBatch(2, EVENTFUL) for _ in range(2))
    batch.reset(3)
    other.reset(9)
    actions = np.full((2, 2, 3), 0.2)
    for _ in range(4):
        batch.step(actions)
    other.load_state_dict(batch.state_dict())
    for _ in range(8):
        np.testing.assert_array_equal(batch.step(actions), other.step(actions))
