"""Agents whose UAS swap battery packs stay, land, and fly again."""

import warnings

import gymnasium
import numpy as np
import pytest
from practice_grounds import practice_ground

from uas_coverage_env import UasStatus, uas_coverage_v0
from uas_coverage_env.env import CoverageBatch
from uas_coverage_env.env.actions.waypoint import HOME_CHOICE
from uas_coverage_env.env.observation import observation_columns
from uas_coverage_env.scenario.packs import Sorties
from uas_coverage_env.vehicle.layout import DOD
from uas_coverage_env.world import GoTo

with warnings.catch_warnings():
    # its tests import one of pettingzoo's own environments in the way that it deprecates
    warnings.simplefilter("ignore", DeprecationWarning)
    from pettingzoo.test import api_test, parallel_api_test

PLAIN = practice_ground(n_uas=2, max_steps=110)
GROUND = PLAIN.model_copy(
    update={"sorties": Sorties(packs=2, swap_s=9.0, together=False), "name": "packs"}
)
FLYING = int(observation_columns("own", "flying")[0, 0])
NOWHERE = HOME_CHOICE - 1
"""There are fewer open waypoints: the former target stays, and without one a UAS hovers."""
OUT = {"uas_1": 0, "uas_2": NOWHERE}
BACK = {"uas_1": HOME_CHOICE, "uas_2": NOWHERE}


def fly(env, actions, status, n_steps=60):
    """Steps until the first agent has a status; what the last one gave."""
    for _ in range(n_steps):
        step = env.step({agent: actions[agent] for agent in env.agents})
        if step[4]["uas_1"]["status"] == status:
            return step
    raise AssertionError("it never had that status")


def covering(env):
    """The first agent covers a waypoint."""
    env.reset(seed=0)
    while env.step(OUT)[4]["uas_1"]["covered"] == 0:
        pass
    return env


def swapping(swap_s=9.0):
    sorties = GROUND.sorties.model_copy(update={"swap_s": swap_s})
    ground = GROUND.model_copy(update={"sorties": sorties})
    env = covering(uas_coverage_v0.parallel_env(ground, action="waypoint"))
    return env, fly(env, BACK, UasStatus.SWAPPING)


def test_an_agent_that_swaps_stays_and_its_observation_shows_it_landed():
    env, (seen, _, terminated, truncated, infos) = swapping()
    assert env.agents == ["uas_1", "uas_2"]
    assert not terminated["uas_1"]
    assert not truncated["uas_1"]
    assert seen["uas_1"][FLYING] == 0.0
    assert infos["uas_1"]["reward_terms"]["home"] == 0.0
    seen, rewards, *_ = env.step(BACK)
    assert seen["uas_1"][FLYING] == 0.0
    assert rewards["uas_1"] == 0.0


def test_what_it_is_asked_meanwhile_has_no_effect_and_may_be_left_out():
    ends = []
    for choice in (0, 1, HOME_CHOICE, None):
        env, _ = swapping()
        asked = {} if choice is None else {"uas_1": choice}
        asked["uas_2"] = NOWHERE
        while (step := env.step(asked))[4]["uas_1"]["status"] != UasStatus.FLYING:
            pass
        seen = step[0]
        assert seen["uas_1"][FLYING] == 1.0
        for _ in range(3):
            env.step({"uas_1": NOWHERE, "uas_2": NOWHERE})
        ends.append(env.swarm_state().x)
    for end in ends[1:]:
        np.testing.assert_array_equal(end, ends[0])


def test_one_that_flies_has_to_be_asked():
    env, _ = swapping()
    with pytest.raises(ValueError, match="uas_2 has no action"):
        env.step({"uas_1": 0})


def test_it_flies_again_with_a_full_battery_and_ends_when_its_packs_are_used():
    env, _ = swapping()
    fly(env, BACK, UasStatus.FLYING)
    assert env.swarm_state().x[0, DOD] == 0.0
    *_, terminated, _, infos = fly(env, BACK, UasStatus.LANDED)
    assert terminated["uas_1"]
    assert infos["uas_1"]["reward_terms"]["home"] > 0.0
    assert env.agents == ["uas_2"]
    assert infos["uas_1"]["energy_Wh"] > 0.0


def test_one_that_has_landed_for_good_while_it_waited_is_paid_for_coming_home():
    env, _ = swapping(swap_s=60.0)  # meanwhile the second covers the rest
    step = fly(env, {"uas_1": HOME_CHOICE, "uas_2": 0}, UasStatus.LANDED)
    assert step[4]["uas_1"]["reward_terms"]["home"] == 5.0
    assert step[1]["uas_1"] == 5.0
    assert env.agents == ["uas_2"]


@pytest.mark.parametrize("action", ["waypoint", "velocity"])
def test_a_lane_flies_what_a_single_mission_flies(action):
    pool = [GROUND, PLAIN]
    batch = CoverageBatch(3, pool, action=action, return_mode=True, autoreset="disabled")
    order = (0, 1, 0)
    batch.reset(7, scenarios=list(order))
    envs = [uas_coverage_v0.parallel_env(pool[s], action=action, return_mode=True) for s in order]
    for env in envs:
        env.reset(seed=7)
    rng = np.random.default_rng(3)
    statuses = set()
    lines = rng.choice([-0.3, 0.0, 0.3], (12, 3, 2, 3))
    for k in range(108):
        if action == "waypoint":
            out = (k // 16) % 2 == 0
            actions = np.where(out, rng.integers(0, 3, (3, 2)), HOME_CHOICE)
        else:
            actions = lines[k // 9] * np.where(k % 9 < 4, 1.0, -1.0)
            actions[..., 2] = -0.5
        observation = batch.step(actions)
        for lane, env in enumerate(envs):
            if not env.agents:
                assert batch.lanes.terminated[lane]
                continue
            asked = dict(zip(env.possible_agents, actions[lane], strict=True))
            seen, rewards, _, _, infos = env.step({a: asked[a] for a in env.agents})
            np.testing.assert_array_equal(batch.swarm_state(lane).x, env.swarm_state().x)
            for agent, row in seen.items():
                i = env.possible_agents.index(agent)
                np.testing.assert_array_equal(observation[lane, i], row)
                assert infos[agent]["status"] == batch.learners.report[lane, i, 3]
                assert rewards[agent] == batch.lanes.rewards[lane, i]
                statuses.add(infos[agent]["status"])
        if (batch.lanes.terminated | batch.lanes.truncated).any():
            break
    if action == "waypoint":
        assert UasStatus.SWAPPING in statuses


def test_one_agent_for_the_swarm_goes_on_while_all_swap():
    env = gymnasium.make("UASCoverage-v0", scenario=GROUND, action="waypoint")
    env.reset(seed=0)
    found = set()
    for k in range(60):
        choice = 0 if k < 8 else HOME_CHOICE
        _, _, terminated, truncated, info = env.step([choice, choice])
        statuses = tuple(info["uas"][name]["status"] for name in ("uas_1", "uas_2"))
        found.add(statuses)
        assert not truncated
        if terminated:
            break
    assert (UasStatus.SWAPPING, UasStatus.SWAPPING) in found
    assert terminated
    assert statuses == (UasStatus.LANDED, UasStatus.LANDED)


def test_pettingzoo_finds_nothing_wrong(capsys):
    parallel_api_test(uas_coverage_v0.parallel_env(GROUND, action="waypoint"), num_cycles=150)
    api_test(uas_coverage_v0.env(GROUND, action="waypoint"), num_cycles=150)


def test_a_planner_gives_no_command_to_one_that_swaps():
    env, _ = swapping()
    actions = env.actions_of({"uas_2": GoTo(None)})
    env.step(actions)
    assert env.agents == ["uas_1", "uas_2"]
