"""Events and sensors in the environments: the same in single and batched missions."""

import numpy as np
import pytest
from practice_grounds import practice_ground

from uas_coverage_env import ContactKind, UasStatus, uas_coverage_v0
from uas_coverage_env.env import CoverageBatch
from uas_coverage_env.env.cuda import CudaMissions

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
                assert infos[agent]["status"] == batch.worlds.status[lane, i]
    assert (batch.worlds.status == UasStatus.LOST).any()


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


def test_an_event_that_changes_the_scene_is_refused_in_one_line():
    closed = {"kind": "home_closed", "at_s": 5.0, "uas": "uas_1"}
    start_m = np.add(GROUND.uas[0].start_m, (0.0, 3.0, 0.0)).tolist()
    scenario = GROUND.model_copy(update={"events": ({**closed, "alternative_m": start_m},)})
    for make in (uas_coverage_v0.parallel_env, lambda s: CoverageBatch(2, s)):
        with pytest.raises(ValueError, match="'home_closed', which changes the scene") as caught:
            make(scenario)
        assert "\n" not in str(caught.value)


def test_what_takes_guidance_is_refused_on_a_gpu():
    scenario = GROUND.model_copy(update={"events": ({"kind": "planner_lost", "at_s": 5.0},)})
    with pytest.raises(ValueError, match=r"sends UAS home.*\(then = \"hover\"\)"):
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
