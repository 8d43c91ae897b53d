"""A wrench may lead beyond the vehicle's limits: what that costs a learner, and no other player."""

import dataclasses

import gymnasium as gym
import numpy as np
import pytest
from practice_grounds import practice_ground

from uas_coverage_env import (
    ContactKind,
    UasStatus,
    Wrench,
    as_planner,
    evaluate,
    rollout,
    uas_coverage_v0,
)
from uas_coverage_env.compiled.kernels import kernel
from uas_coverage_env.env import CoverageBatch
from uas_coverage_env.env.actions.wrench import WRENCH
from uas_coverage_env.env.report import CONTACT
from uas_coverage_env.features.wind import Gust
from uas_coverage_env.scenario import Waypoint, Wind
from uas_coverage_env.vehicle import load_vehicle
from uas_coverage_env.vehicle.layout import PHI, THETA, VX, VY
from uas_coverage_env.vehicle.limits import LIMIT_NAMES
from uas_coverage_env.world import CommandKind

WIDE = {"n_uas": 2, "size_m": 2000.0}
LIMITS = load_vehicle("s500_v2").limits
TORQUES = [1.0, -1.0, 0.5, 0.2, 0.1, 0.05]


def pitching(share):
    return np.array([0.0, 0.0, share, 0.0], np.float32)


def speed_of(env):
    x = env.swarm_state().x[0]
    return float(np.hypot(x[VX], x[VY])), float(np.hypot(x[PHI], x[THETA]))


def flown(ground, share, **settings):
    """A UAS under a constant torque beside one that hovers, until it has ended: its infos."""
    env = uas_coverage_v0.parallel_env(ground, action="wrench", **settings)
    env.reset(seed=0)
    told = []
    while "uas_1" in env.agents:
        actions = {"uas_1": pitching(share), "uas_2": np.zeros(4, np.float32)}
        _, rewards, terminated, truncated, infos = env.step(actions)
        told.append((infos["uas_1"], rewards, (terminated, truncated), speed_of(env)))
        assert infos["uas_2"]["reward_terms"]["violation"] == 0.0
        assert infos["uas_2"]["contact"] == ContactKind.NONE
    return told


@pytest.mark.parametrize("dynamics", ["lpv", "nonlinear"])
@pytest.mark.parametrize("share", TORQUES)
def test_beyond_a_limit_each_step_is_paid_for_and_beyond_one_and_a_half_the_uas_is_lost(
    share, dynamics
):
    told = flown(practice_ground(**WIDE), share, dynamics=dynamics)
    tolerance = {"lpv": 1.01, "nonlinear": 1.15}[dynamics]
    for info, rewards, (terminated, truncated), (speed_mps, tilt_rad) in told:
        used = max(speed_mps / LIMITS.v_xy_max_mps, tilt_rad / LIMITS.tilt_max_rad)
        beyond, lost = info["limits_exceeded"] != 0, used > 1.5
        assert beyond or used <= tolerance
        assert info["reward_terms"]["violation"] == (-10.0 if beyond else 0.0)
        assert rewards["uas_1"] == pytest.approx(sum(info["reward_terms"].values()), abs=1e-12)
        assert info["contact"] == (ContactKind.LIMITS if lost else ContactKind.NONE)
        assert info["contact_with"] == -1
        assert info["status"] == (UasStatus.LOST if lost else UasStatus.FLYING)
        assert terminated["uas_1"] == lost
        assert not truncated["uas_1"]
    assert told[-1][0]["contact"] == ContactKind.LIMITS


@pytest.mark.parametrize("share", TORQUES)
def test_a_uas_that_is_out_of_control_covers_nothing(share):
    # all along the way, so that there is one within reach at every sample
    along = [
        Waypoint(position_m=(x, 100.0, -10.0), radius_m=1.5, weight=1.0)
        for x in map(float, range(30, 150))
    ]
    ground = practice_ground(**WIDE).model_copy(update={"waypoints": tuple(along)})
    env = uas_coverage_v0.parallel_env(ground, action="wrench")
    env.reset(seed=0)
    infos = {}
    while "uas_1" in env.agents:
        infos = env.step({"uas_1": pitching(share), "uas_2": pitching(0.0)})[-1]
    swarm = env.swarm_state()
    away_m = [np.linalg.norm(swarm.x[0, :3] - waypoint.position_m) for waypoint in along]
    assert (swarm.uncovered & (np.array(away_m) < 1.5)).any()
    assert infos["uas_1"]["contact"] == ContactKind.LIMITS
    assert infos["uas_1"]["reward_terms"]["coverage"] == 0.0


def test_the_weight_of_the_violation_is_that_of_the_term():
    told = flown(practice_ground(**WIDE), 0.1, reward_weights={"violation": 3.0})
    paid = [info["reward_terms"]["violation"] for info, *_ in told]
    assert paid == [0.0] * 4 + [-3.0] * 2


def test_a_climb_or_a_turn_beyond_the_limits_is_paid_for_and_flown():
    env = uas_coverage_v0.parallel_env(practice_ground(**WIDE), action="wrench")
    env.reset(seed=0)
    seen = set()
    for _ in range(6):
        turn = {"uas_1": np.array([0.0, 0, 0, 1.0]), "uas_2": np.array([1.0, 0, 0, 0])}
        infos = env.step({agent: turn[agent] for agent in env.agents})[-1]
        for info in infos.values():
            beyond = info["limits_exceeded"]
            seen |= {name for k, name in enumerate(LIMIT_NAMES) if beyond >> k & 1}
            assert info["contact"] != ContactKind.LIMITS
            assert info["reward_terms"]["violation"] == (-10.0 if beyond else 0.0)
    assert {"climb", "yaw_rate"} <= seen


@pytest.mark.parametrize("dynamics", ["lpv", "nonlinear"])
def test_what_an_assistant_flies_instead_of_a_wrench_is_not_paid_for(dynamics):
    settings = {"safety_filter": True, "return_mode": True, "dynamics": dynamics}
    env = uas_coverage_v0.parallel_env(practice_ground(tower=True), action="wrench", **settings)
    rng = np.random.default_rng(0)
    paid, spared = 0, 0
    for seed in range(12):
        env.reset(seed=seed)
        while env.agents:
            asked = {agent: rng.uniform(-0.4, 0.4, 4) for agent in env.agents}
            infos = env.step(asked)[-1]
            for info in infos.values():
                own = info["filter"]["applied"]["kind"] == CommandKind.WRENCH
                beyond = info["limits_exceeded"] != 0
                costs = info["contact"] != ContactKind.NONE or (own and beyond)
                assert info["reward_terms"]["violation"] == (-10.0 if costs else 0.0)
                assert own or info["contact"] != ContactKind.LIMITS
                paid, spared = paid + (own and beyond), spared + (beyond and not own)
    assert paid > 0
    assert spared > 0


@pytest.mark.parametrize("action", ["velocity", "acceleration"])
def test_other_actions_do_not_pay_for_a_gust_that_takes_them_beyond_a_limit(action):
    gust = Gust(at_s=2.0, lasts_s=4.0, peak_mps=20.0, from_deg=270.0)
    windy = practice_ground(**WIDE).model_copy(
        update={"wind": Wind(mean_mps=2.0, from_deg=270.0, gusts=(gust,))}
    )
    env = uas_coverage_v0.parallel_env(windy, action=action)
    env.reset(seed=0)
    beyond = 0
    for _ in range(25):
        infos = env.step(dict.fromkeys(env.agents, np.array([0.0, 1.0, 0.0])))[-1]
        for info in infos.values():
            beyond += info["limits_exceeded"] != 0
            lost = info["contact"] != ContactKind.NONE
            assert info["reward_terms"]["violation"] == (-10.0 if lost else 0.0)
            assert info["contact"] != ContactKind.LIMITS
    assert beyond > 0


@kernel
def write_torque(arena, state, tables, learners, i, parameters, values, command):
    command.kind = 2
    command.values[2] = values[0]


def test_a_kind_of_action_of_ones_own_that_writes_wrenches_is_judged_alike():
    torque = (-LIMITS.angular_acceleration_xy_max_radps2, 0.0, 1.0)
    own = dataclasses.replace(
        WRENCH,
        name="torque",
        write=write_torque,
        numbers=("tau_y_Nm",),
        ranges=lambda vehicle, scenario: (torque,),
        express=None,
    )
    env = uas_coverage_v0.parallel_env(practice_ground(**WIDE), action=own)
    env.reset(seed=0)
    contacts = set()
    while "uas_1" in env.agents:
        infos = env.step(dict.fromkeys(env.agents, np.ones(1)))[-1]
        contacts.add(infos["uas_1"]["contact"])
    assert contacts == {ContactKind.NONE, ContactKind.LIMITS}


@pytest.mark.parametrize("dynamics", ["lpv", "nonlinear"])
def test_lanes_of_a_batch_lose_what_single_environments_lose(dynamics):
    ground = practice_ground(**WIDE)
    batch = CoverageBatch(len(TORQUES), ground, action="wrench", dynamics=dynamics)
    batch.reset(seed=0)
    expected = [flown(ground, share, dynamics=dynamics) for share in TORQUES]
    actions = np.zeros((len(TORQUES), 2, 4), np.float32)
    actions[:, 0, 2] = TORQUES
    for step in range(max(map(len, expected))):
        batch.step(actions)
        for lane, told in enumerate(expected):
            if step < len(told):
                info, rewards, *_ = told[step]
                assert batch.learners.report[lane, 0, CONTACT] == info["contact"]
                assert batch.lanes.rewards[lane, 0] == rewards["uas_1"]


def test_the_swarm_as_one_agent_pays_for_each_uas():
    swarm = gym.make("UASCoverage-v0", scenario=practice_ground(**WIDE), action="wrench")
    swarm.reset(seed=0)
    action = np.concatenate([pitching(1.0), pitching(1.0)])
    paid = [swarm.step(action)[-1]["reward_terms"]["violation"] for _ in range(2)]
    assert paid == [0.0, -20.0]


class Tumbles:
    """Commands what `pitching(1.0)` does."""

    def reset(self, brief, seed):
        self.torque_Nm = brief.vehicles[0].torque_max_Nm[1]

    def act(self, swarm):
        return {name: Wrench(0.0, 0.0, self.torque_Nm, 0.0) for name in swarm.active}


def test_a_policy_is_judged_in_a_rollout_as_in_its_environment():
    ground = practice_ground(**WIDE)
    policy = as_planner(lambda seen: pitching(1.0), action="wrench")
    (episode,) = evaluate(policy, ground, seeds=[0], action="wrench").episodes
    assert episode.lost == 2
    assert episode.reward_terms["violation"] == -20.0
    flight = rollout(ground, policy)
    assert flight.steps == len(flown(ground, 1.0)) == 2
    lost = {str(violation) for violation in flight.violations if violation.kind == "limits"}
    assert lost == {f"uas_{u}, out of control beyond its limits at 2 s" for u in (1, 2)}


def test_a_planner_that_commands_the_same_flies_on_with_a_violation():
    ground = practice_ground(**WIDE)
    flight = rollout(ground, Tumbles(), max_steps=4)
    assert flight.steps == 4
    assert {violation.kind for violation in flight.violations} == {"limit"}
    (episode,) = evaluate(Tumbles(), ground, seeds=[0], max_cycles=4).episodes
    assert episode.reward_terms["violation"] == 0.0
    # the same flight to the last bit, for as long as the policy flies
    policy = as_planner(lambda seen: pitching(1.0), action="wrench")
    np.testing.assert_array_equal(flight.x[:2], rollout(ground, policy).x[:2])
