import math
from functools import reduce
from operator import add

import numpy as np
import pytest
from practice_grounds import practice_ground

from uas_coverage_env import CommandKind, ContactKind, UasStatus, uas_coverage_v0
from uas_coverage_env.env import HOME_CHOICE, REWARD
from uas_coverage_env.env.rewards.terms import REWARD_TERMS, rewards_table


def run(env, policy, limit=200):
    """Fly until no UAS flies any more; all steps as (rewards, terminations, truncations, infos)."""
    observations, infos = env.reset(seed=0)
    steps = []
    for _ in range(limit):
        if not env.agents:
            return steps
        actions = {agent: policy(agent, observations, infos) for agent in env.agents}
        observations, *rest = env.step(actions)
        infos = rest[-1]
        steps.append(tuple(rest))
    raise AssertionError("the mission does not end")


def apart(agent, observations, infos):
    """The nearest waypoint for one, the farthest for the other: so they do not meet."""
    choices = np.flatnonzero(infos[agent]["action_mask"])
    return choices[0] if agent == "uas_1" or len(choices) == 1 else choices[-2]


def term(steps, name, agent):
    return [infos[agent]["reward_terms"][name] for *_, infos in steps if agent in infos]


def test_a_mission_pays_for_what_happens_in_it():
    env = uas_coverage_v0.parallel_env(
        practice_ground(weights=[1.0, 3.0, 2.0], max_steps=200), action="waypoint"
    )
    steps = run(env, apart)
    paid = sum(sum(term(steps, "coverage", agent)) for agent in env.possible_agents)
    assert paid == pytest.approx(6.0)
    for agent in env.possible_agents:
        last = [infos[agent] for *_, infos in steps if agent in infos][-1]
        assert last["status"] == UasStatus.LANDED
        assert term(steps, "home", agent)[-1] == pytest.approx(5.0)
        assert sum(term(steps, "home", agent)) == pytest.approx(5.0)
        assert sum(term(steps, "energy", agent)) == pytest.approx(-0.2 * last["energy_Wh"])
        assert sum(term(steps, "time", agent)) == pytest.approx(
            -0.01 * len(term(steps, "time", agent))
        )
        for nothing in ("violation", "stranded", "filter", "team_coverage"):
            assert not any(term(steps, nothing, agent))


@pytest.mark.parametrize("dynamics", ["lpv", "nonlinear"])
@pytest.mark.parametrize("safety_filter", [False, True])
def test_rewards_are_the_sum_of_their_terms(dynamics, safety_filter):
    weights = {name: 1.0 + i for i, name in enumerate(REWARD_TERMS)}
    env = uas_coverage_v0.parallel_env(
        practice_ground(tower=True),
        dynamics=dynamics,
        safety_filter=safety_filter,
        reward_weights=weights,
    )
    rng = np.random.default_rng(1)
    for rewards, _, _, infos in run(env, lambda *_: rng.uniform(-1, 1, 3)):
        for agent, reward in rewards.items():
            terms = infos[agent]["reward_terms"]
            assert tuple(terms) == REWARD_TERMS
            # not sum(), which rounds in another way since Python 3.12
            assert reward == reduce(add, terms.values(), 0.0)
            assert type(reward) is float
            assert math.isfinite(reward)


def test_weights_multiply_their_terms_and_leave_the_others():
    plain = uas_coverage_v0.parallel_env(practice_ground(), action="waypoint")
    dear = uas_coverage_v0.parallel_env(
        practice_ground(), action="waypoint", reward_weights={"energy": 2.0, "coverage": 0}
    )
    for (*_, one), (*_, other) in zip(run(plain, apart), run(dear, apart), strict=True):
        for agent in one:
            a, b = one[agent]["reward_terms"], other[agent]["reward_terms"]
            assert b["energy"] == pytest.approx(10 * a["energy"])
            assert b["coverage"] == 0.0
            assert b["home"] == a["home"]


def test_what_others_cover_is_team_coverage():
    env = uas_coverage_v0.parallel_env(
        practice_ground(), action="waypoint", reward_weights={"team_coverage": 1.0}
    )
    for *_, infos in run(env, apart):
        if len(infos) == 2:
            a, b = (infos[agent]["reward_terms"] for agent in env.possible_agents)
            assert (a["coverage"], a["team_coverage"]) == (b["team_coverage"], b["coverage"])


def test_leaving_the_fence_is_a_violation():
    env = uas_coverage_v0.parallel_env(practice_ground())
    steps = run(env, lambda *_: np.array([0.0, 1.0, 0.0]))
    rewards, terminations, truncations, infos = steps[-1]
    for agent in env.possible_agents:
        assert infos[agent]["contact"] == ContactKind.GEOFENCE
        assert infos[agent]["contact_with"] == -1
        assert infos[agent]["status"] == UasStatus.LOST
        assert infos[agent]["reward_terms"]["violation"] == -10.0
        assert terminations[agent]
        assert not truncations[agent]
        assert rewards[agent] < -10.0


def test_a_contact_names_what_was_hit():
    env = uas_coverage_v0.parallel_env(practice_ground(n_uas=1, tower=True))
    *_, infos = run(env, lambda *_: np.array([0.0, -0.5, -0.5]))[-1]
    hit = infos["uas_1"]
    assert hit["contact"] == ContactKind.OBSTACLE
    assert env.scenario.obstacles[hit["contact_with"]].name == "tower"


def test_two_that_meet_name_each_other():
    env = uas_coverage_v0.parallel_env(practice_ground())
    speed = {"uas_1": 0.3, "uas_2": -0.3}
    *_, infos = run(env, lambda agent, *_: np.array([speed[agent], 0.0, -0.5]))[-1]
    assert env.possible_agents[infos["uas_1"]["contact_with"]] == "uas_2"
    assert env.possible_agents[infos["uas_2"]["contact_with"]] == "uas_1"
    assert infos["uas_1"]["contact"] == infos["uas_2"]["contact"] == ContactKind.UAS


def test_a_battery_that_is_overdrawn_costs_the_uas():
    env = uas_coverage_v0.parallel_env(practice_ground(n_uas=1, soc_0=0.26))
    *_, infos = run(env, lambda *_: np.zeros(3))[-1]
    assert infos["uas_1"]["contact"] == ContactKind.BATTERY


def test_a_uas_that_still_flies_at_the_end_is_stranded():
    env = uas_coverage_v0.parallel_env(practice_ground(), max_cycles=5)
    steps = run(env, lambda *_: np.zeros(3))
    assert len(steps) == 5
    for k, (_, terminations, truncations, infos) in enumerate(steps):
        for agent in env.possible_agents:
            assert not terminations[agent]
            assert truncations[agent] == (k == 4)
            assert infos[agent]["reward_terms"]["stranded"] == (-5.0 if k == 4 else 0.0)


def test_landing_with_half_of_the_area_covered_pays_half():
    waypoints_m = ((110.0, 100.0, -10.0), (20.0, 20.0, -10.0))
    env = uas_coverage_v0.parallel_env(practice_ground(waypoints_m=waypoints_m), action="waypoint")
    env.reset()
    *_, infos = env.step({"uas_1": HOME_CHOICE, "uas_2": HOME_CHOICE})
    assert [infos[a]["reward_terms"]["home"] for a in env.possible_agents] == [2.5, 2.5]


def test_what_the_filter_changes_has_a_price():
    env = uas_coverage_v0.parallel_env(practice_ground(n_uas=1), safety_filter=True)
    env.reset()
    changed = []
    for _ in range(12):
        *_, infos = env.step({"uas_1": np.array([0.0, 1.0, 0.0])})
        info = infos["uas_1"]
        asked, applied = info["filter"]["asked"], info["filter"]["applied"]
        assert asked["kind"] == CommandKind.VELOCITY
        assert asked["values"].tolist() == [0.0, 12.0, 20.0, 0.0]
        price = info["reward_terms"]["filter"]
        if info["filter"]["changed"]:
            changed.append(price)
            away = np.hypot(*(applied["values"] - asked["values"])[:2])
            assert price == pytest.approx(-0.1 * away / 12.0)
        else:
            assert price == 0.0
            assert applied["kind"] == asked["kind"]
            np.testing.assert_array_equal(applied["values"], asked["values"])
    assert any(price < 0 for price in changed)
    assert env.agents == ["uas_1"]


@pytest.mark.parametrize(
    ("weights", "named"),
    [
        ({"enrgy": 1.0}, "coverage, team_coverage, energy"),
        ({"energy": math.nan}, "energy is nan"),
        ({"energy": math.inf}, "energy is inf"),
        ({"energy": "1"}, "energy is '1'"),
        ({"energy": True}, "energy is True"),
        ([1.0], "mapping"),
    ],
)
def test_wrong_weights_are_refused(weights, named):
    with pytest.raises(ValueError, match=named):
        uas_coverage_v0.parallel_env(practice_ground(), reward_weights=weights)


def test_the_documentation_shows_all_terms_and_weights():
    rows = [line.strip() for line in uas_coverage_v0.parallel_env.__doc__.splitlines()]
    assert set(rewards_table().splitlines()) <= set(rows)
    assert len(rewards_table().splitlines()) == len(REWARD) + 2
