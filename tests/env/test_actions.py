import functools
import math
import re
from dataclasses import fields

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from practice_grounds import practice_ground

from uas_coverage_env import GoTo, UasStatus, uas_coverage_v0
from uas_coverage_env.env import HOME_CHOICE, K_WAYPOINTS
from uas_coverage_env.env.actions import ACTIONS, ACTIONS_V1
from uas_coverage_env.env.actions.given import actions_of
from uas_coverage_env.env.actions.velocity import VELOCITY
from uas_coverage_env.env.actions.wrench import WRENCH
from uas_coverage_env.scenario import load_scenario
from uas_coverage_env.vehicle import load_vehicle


def env_of(action="velocity", **settings):
    env = uas_coverage_v0.parallel_env(practice_ground(), action=action, **settings)
    env.reset(seed=0)
    return env


def commands_after(action, kind="velocity"):
    """Values of the command that the action of uas_1 becomes."""
    env = env_of(kind, safety_filter=True)
    *_, infos = env.step({"uas_1": action, "uas_2": np.zeros_like(np.asarray(action))})
    return infos["uas_1"]["filter"]["asked"]["values"].tolist()


def snapshot(env):
    swarm = env.swarm_state()
    return [getattr(swarm, field.name) for field in fields(swarm)] + [env.state()]


def assert_unchanged(env, before):
    for array, old in zip(snapshot(env), before, strict=True):
        np.testing.assert_array_equal(array, old)


def test_velocity_is_scaled_to_the_speed_limit_and_the_fence():
    limit = load_vehicle("s500_v2").limits.v_xy_max_mps
    values = commands_after(np.array([1.0, -0.5, 0.0], np.float32))
    assert values[:3] == pytest.approx([limit, -limit / 2, 20.0])


@pytest.mark.parametrize(("share", "altitude_m"), [(-1.0, 1.5), (0.0, 20.0), (1.0, 38.5)])
def test_altitudes_run_from_margin_to_margin_of_the_fence(share, altitude_m):
    values = commands_after(np.array([0.0, 0.0, share]))
    assert values[2] == pytest.approx(altitude_m)


def test_acceleration_is_scaled_per_axis():
    vehicle = load_vehicle("s500_v2")
    level = vehicle.airframe.gravity_mps2 * vehicle.limits.tilt_max_rad
    up = vehicle.limits.lift_max_N / vehicle.airframe.mass_kg
    down = -vehicle.limits.lift_min_N / vehicle.airframe.mass_kg
    values = commands_after(np.array([1.0, -1.0, -1.0]), "acceleration")
    assert values[:3] == pytest.approx([level, -level, -up])
    values = commands_after(np.array([0.5, 0.0, 1.0]), "acceleration")
    assert values[:3] == pytest.approx([level / 2, 0.0, down])


def test_wrench_spans_the_uneven_limits_of_lift():
    vehicle = load_vehicle("s500_v2")
    limits = vehicle.limits
    tau_x = vehicle.airframe.inertia_kgm2[0] * limits.angular_acceleration_xy_max_radps2
    tau_z = vehicle.airframe.inertia_kgm2[2] * limits.angular_acceleration_z_max_radps2
    low = commands_after(np.array([-1.0, 1.0, 0.0, -1.0]), "wrench")
    assert low == pytest.approx([limits.lift_min_N, tau_x, 0.0, -tau_z])
    assert commands_after(np.zeros(4), "wrench") == [0.0, 0.0, 0.0, 0.0]
    high = commands_after(np.array([1.0, 0.0, 0.0, 0.0]), "wrench")
    assert high[0] == pytest.approx(limits.lift_max_N)


def test_every_vehicle_has_its_own_limits():
    scenario = practice_ground(vehicles=("s500_v2", "hexacopter"))
    ranges = actions_of(WRENCH, scenario).ranges
    lifts = [load_vehicle(name).limits.lift_max_N for name in ("s500_v2", "hexacopter")]
    assert ranges[:, 0, 2].tolist() == pytest.approx(lifts)
    assert lifts[0] != lifts[1]


def test_numbers_out_of_bounds_are_clipped():
    inside, outside = env_of(), env_of()
    for env, action in ((inside, [1.0, -1.0, 0.5]), (outside, [7.0, -1e30, 0.5])):
        env.step({"uas_1": np.array(action), "uas_2": np.zeros(3)})
    assert_unchanged(outside, snapshot(inside))


@pytest.mark.parametrize(
    "action",
    [
        np.array([0.25, 0.5, 0.0], np.float64),
        np.array([0.25, 0.5, 0.0], np.float16),
        [0.25, 0.5, 0],
        (0.25, 0.5, 0.0),
    ],
)
def test_other_number_types_fly_the_same(action):
    expected = commands_after(np.array([0.25, 0.5, 0.0], np.float32))
    assert commands_after(action) == pytest.approx(expected)


def test_whole_numbers_are_numbers():
    assert commands_after(np.array([0, 1, 0])) == pytest.approx([0.0, 12.0, 20.0, 0.0])


@pytest.mark.parametrize(
    ("action", "named"),
    [
        (np.array([math.nan, 0.0, 0.0]), "nan"),
        (np.array([0.0, math.inf, 0.0], np.float32), "inf"),
        (np.zeros(2), "shape (2,)"),
        (np.zeros((1, 3)), "shape (1, 3)"),
        (np.array(0.0), "shape ()"),
        (np.array([True, False, True]), "bool"),
        (np.array(["a", "b", "c"]), "'a'"),
        ([0.0, "north", 0.0], "north"),
        ([[0.0], [1.0, 2.0], 3.0], "[[0.0], [1.0, 2.0], 3.0]"),
        (np.array([0.0, None, 0.0]), "None"),
        (np.zeros(3, complex), "complex"),
        (None, "None"),
        (object(), "object"),
    ],
)
def test_an_invalid_action_names_agent_and_value_and_changes_nothing(action, named):
    env = env_of()
    before = snapshot(env)
    with pytest.raises(ValueError, match="uas_2") as error:
        env.step({"uas_1": np.ones(3, np.float32), "uas_2": action})
    assert named in str(error.value)
    assert_unchanged(env, before)
    env.step({"uas_1": np.zeros(3), "uas_2": np.zeros(3)})
    assert env.swarm_state().step == 1


@pytest.mark.parametrize(
    ("actions", "named"),
    [
        ({"uas_1": np.zeros(3)}, "uas_2 has no action"),
        ({}, "uas_1 has no action"),
        ({"uas_1": np.zeros(3), "uas_3": np.zeros(3)}, "'uas_3'"),
        ({"uas_1": np.zeros(3), "uas_2": np.zeros(3), "pilot": np.ones(3)}, "'pilot'"),
        ([np.zeros(3), np.zeros(3)], "mapping"),
        (None, "None"),
    ],
)
def test_a_wrong_set_of_agents_is_refused(actions, named):
    env = env_of()
    before = snapshot(env)
    with pytest.raises(ValueError, match=re.escape(named)):
        env.step(actions)
    assert_unchanged(env, before)


def test_an_action_for_a_uas_that_has_landed_is_ignored():
    env, twin = env_of("waypoint"), env_of("waypoint")
    for each in (env, twin):
        each.step({"uas_1": HOME_CHOICE, "uas_2": 0})
        assert each.agents == ["uas_2"]
    results, expected = env.step({"uas_1": "anything", "uas_2": 0}), twin.step({"uas_2": 0})
    assert list(results[0]) == ["uas_2"]
    np.testing.assert_array_equal(results[0]["uas_2"], expected[0]["uas_2"])
    np.testing.assert_array_equal(env.state(), twin.state())
    with pytest.raises(ValueError, match="uas_2 has no action"):
        env.step({"uas_1": 0})


@pytest.mark.parametrize("choice", [-1, HOME_CHOICE + 1, 1.0, 0.5, True, None, "home", [1]])
def test_a_choice_that_does_not_exist_is_refused(choice):
    env = env_of("waypoint")
    before = snapshot(env)
    with pytest.raises(ValueError, match=f"uas_1.*from 0 to {HOME_CHOICE}"):
        env.step({"uas_1": choice, "uas_2": 0})
    assert_unchanged(env, before)


@pytest.mark.parametrize("choice", [1, np.int64(1), np.int32(1), np.uint8(1), np.array(1)])
def test_any_whole_number_is_a_choice(choice):
    env, usual, other = env_of("waypoint"), env_of("waypoint"), env_of("waypoint")
    env.step({"uas_1": choice, "uas_2": 0})
    usual.step({"uas_1": 1, "uas_2": 0})
    other.step({"uas_1": 0, "uas_2": 0})
    assert_unchanged(env, snapshot(usual))
    assert (env.swarm_state().x != other.swarm_state().x).any()


def test_the_mask_allows_open_waypoints_and_home():
    env = uas_coverage_v0.parallel_env(practice_ground(), action="waypoint")
    _, infos = env.reset()
    mask = infos["uas_1"]["action_mask"]
    assert mask.dtype == np.int8
    assert mask.tolist() == [1] * 3 + [0] * (K_WAYPOINTS - 3) + [1]


def test_a_masked_choice_keeps_the_former_target():
    env, twin = env_of("waypoint"), env_of("waypoint")
    target = next(GoTo(w) for w in range(3) if env.action_of("uas_1", GoTo(w)) == 1)
    env.step({"uas_1": 1, "uas_2": 0})
    twin.step({"uas_1": 1, "uas_2": 0})
    for _ in range(3):
        env.step({"uas_1": 7, "uas_2": 0})
        twin.step({"uas_1": twin.action_of("uas_1", target), "uas_2": 0})
    assert_unchanged(env, snapshot(twin))


def test_a_masked_choice_without_a_target_stays_in_place():
    env = env_of("waypoint")
    start_m = env.swarm_state().x[0, :3]
    for _ in range(5):
        env.step({"uas_1": 7, "uas_2": 0})
    np.testing.assert_allclose(env.swarm_state().x[0, :3], start_m, atol=1e-6)
    assert "uas_1" in env.agents


def test_choosing_the_nearest_waypoint_covers_it_and_home_lands():
    env = env_of("waypoint")
    covered = 0
    while covered < 1:
        *_, infos = env.step(dict.fromkeys(env.agents, 0))
        covered = infos["uas_1"]["covered"]
    for _ in range(60):
        if not env.agents:
            break
        *_, infos = env.step(dict.fromkeys(env.agents, HOME_CHOICE))
    assert {info["status"] for info in infos.values()} == {UasStatus.LANDED}


@pytest.mark.parametrize("name", ["Velocity", "goto", "", None])
def test_an_unknown_kind_of_action_is_refused_with_those_known(name):
    with pytest.raises(ValueError, match="velocity, acceleration, wrench, waypoint"):
        uas_coverage_v0.parallel_env(practice_ground(), action=name)


NUMBERS = st.one_of(
    st.floats(width=32, allow_nan=True, allow_infinity=True),
    st.sampled_from([0.0, 1.0, -1.0, 1e38, -1e38, math.nan, math.inf, -math.inf, 1e-45]),
)
ANYTHING = st.one_of(
    st.lists(NUMBERS, min_size=0, max_size=5),
    st.lists(NUMBERS, min_size=0, max_size=5).map(np.array),
    st.lists(NUMBERS, min_size=4, max_size=4).map(lambda v: np.array(v, np.float32)),
    st.integers(-3, 20),
    st.none(),
    st.text(max_size=3),
    st.booleans(),
    st.dictionaries(st.text(max_size=2), NUMBERS, max_size=2),
)


@functools.cache
def fuzzed(kind):
    return uas_coverage_v0.parallel_env("village", action=kind)


KINDS = [
    pytest.param(kind, id=f"{kind.name} {version}")
    for version, kinds in (("v0", ACTIONS), ("v1", ACTIONS_V1))
    for kind in kinds
    if version == "v0" or kind not in ACTIONS
]
NUMBERS_OF_A_BOX = [kind for kind in KINDS if not kind.values[0].choices]


@pytest.mark.parametrize("kind", KINDS)
@settings(max_examples=60, deadline=None, derandomize=True)
@given(data=st.data())
def test_whatever_is_given_is_flown_or_refused_and_nothing_becomes_nan(kind, data):
    env = fuzzed(kind)
    env.reset()
    for _ in range(3):
        before = snapshot(env)
        actions = {agent: data.draw(ANYTHING) for agent in env.agents}
        refusal = None
        try:
            observations, rewards, *_ = env.step(actions)
        except ValueError as error:
            refusal = str(error)
        if refusal is not None:
            assert any(agent in refusal for agent in env.agents)
            assert_unchanged(env, before)
        else:
            assert all(np.isfinite(row).all() for row in observations.values())
            assert all(math.isfinite(reward) for reward in rewards.values())
            assert np.isfinite(env.swarm_state().x).all()
            assert np.isfinite(env.state()).all()


@pytest.mark.parametrize("kind", NUMBERS_OF_A_BOX)
@settings(max_examples=15, deadline=None, derandomize=True)
@given(seed=st.integers(0, 2**32 - 1))
def test_extreme_but_valid_actions_never_leave_the_observation_space(kind, seed):
    env = fuzzed(kind)
    rng = np.random.default_rng(seed)
    env.reset()
    size = env.action_space("uas_1").shape
    for _ in range(40):
        if not env.agents:
            break
        actions = {agent: rng.choice([-1.0, 0.0, 1.0, 1e6], size) for agent in env.agents}
        observations, *_ = env.step(actions)
        for agent, observation in observations.items():
            assert env.observation_space(agent).contains(observation)
        assert env.state_space.contains(env.state())


def test_the_village_has_the_altitudes_that_the_documentation_says():
    scenario = load_scenario("village")
    ranges = actions_of(VELOCITY, scenario).ranges
    assert (ranges[0, 2, 0], ranges[0, 2, 2]) == pytest.approx((1.5, 48.5))
