"""The velocity and planar actions of v1: fine near rest, so that what is noisy can land."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from practice_grounds import practice_ground
from small_worlds import meadow, waypoint

from uas_coverage_env import GoTo, UasStatus, Velocity, World, uas_coverage_v0, uas_coverage_v1
from uas_coverage_env.entities.state import LANDED
from uas_coverage_env.env import CoverageBatch
from uas_coverage_env.env.actions.planar import PLANAR
from uas_coverage_env.env.actions.velocity import (
    SLOPE_AT_REST,
    VELOCITY,
    VELOCITY_V1,
    _on_straight_line,
    finely,
)
from uas_coverage_env.vehicle import load_vehicle
from uas_coverage_env.vehicle.layout import VX, VY, X, Y, Z

LIMIT = load_vehicle("s500_v2").limits.v_xy_max_mps
LOW = meadow(starts_m=((100.0, 100.0, -1.0),), waypoints=[waypoint((150.0, 100.0, -8.0), 4.0)])
STILL = np.array([0.0, 0.0, -1.0])


def asked(action, kind="velocity", ground=None):
    """Numbers of the command that the action of uas_1 becomes."""
    env = uas_coverage_v1.parallel_env(ground or practice_ground(), action=kind, safety_filter=True)
    env.reset(seed=0)
    *_, infos = env.step(dict.fromkeys(env.agents, np.asarray(action)))
    return infos["uas_1"]["filter_asked_values"].tolist()


def after(env, action, n=1):
    """The last info of uas_1, which flies one action."""
    infos = {}
    for _ in range(n):
        if env.agents:
            *_, infos = env.step(dict.fromkeys(env.agents, np.asarray(action)))
    return infos["uas_1"]


def env_of(ground=LOW, version=uas_coverage_v1, **settings):
    env = version.parallel_env(ground, **settings)
    env.reset(seed=0)
    return env


@pytest.mark.parametrize(
    ("share", "velocity_share"),
    [(0.0, 0.0), (0.01, 0.0010009), (-0.1, -0.0109), (0.5, 0.1625), (1.0, 1.0), (-3.0, -1.0)],
)
def test_velocities_are_fine_near_rest_and_end_at_the_limit(share, velocity_share):
    for kind in ("velocity", "planar"):
        given_ = [share, 0.5, 0.0][: 3 if kind == "velocity" else 2]
        north, east, *_ = asked(given_, kind)
        assert north == pytest.approx(velocity_share * LIMIT)
        assert east == pytest.approx(0.1625 * LIMIT)


@pytest.mark.parametrize(
    ("share", "altitude_m"),
    [(-1.0, 1.5), (0.0, 1.5 + 37.0 / 6), (-0.5, 1.5 + 37.0 / 12), (1, 38.5)],
)
def test_the_lower_half_of_the_numbers_is_the_lowest_sixth_of_the_altitudes(share, altitude_m):
    assert asked([0.0, 0.0, share])[2] == pytest.approx(altitude_m)


@given(st.floats(-12.0, 12.0))
def test_the_number_of_a_velocity_is_found_again(velocity_mps):
    straight = _on_straight_line(velocity_mps, 12.0, SLOPE_AT_REST)
    assert abs(straight) <= 12.0 * (1 + 1e-12)
    assert finely(straight, 12.0, SLOPE_AT_REST) == pytest.approx(velocity_mps, abs=1e-12)


def home_flyers(kind, sigma, n=64):
    """Share of noisy flights home from 30 m away that land within 60 s."""
    batch = CoverageBatch(n, LOW, action=kind, autoreset="rest")
    batch.reset(0)
    rng = np.random.default_rng(0)
    fine = kind is VELOCITY_V1
    for k in range(75):
        x = batch.worlds.x[:, 0]
        north = 0.5 if k < 8 else np.clip(0.12 * (100.0 - x[:, X]) / LIMIT, -0.4, 0.4)
        level = np.stack([np.broadcast_to(north, n), 0.12 * (100.0 - x[:, Y]) / LIMIT], axis=1)
        altitude = -1.0 if k >= 8 else 0.0
        if fine:
            level = np.vectorize(_on_straight_line)(level, 1.0, SLOPE_AT_REST)
        actions = np.column_stack([level, np.full(n, altitude)])
        if k >= 8:
            actions = actions + sigma * rng.standard_normal(actions.shape)
        if (batch.lanes.terminated | batch.lanes.truncated).all():
            break
        batch.step(np.clip(actions, -1.0, 1.0)[:, np.newaxis])
    return (batch.worlds.uas["status"][:, 0] == LANDED).mean()


def test_what_is_noisy_lands_with_it_and_not_on_a_straight_line():
    assert home_flyers(VELOCITY_V1, 0.0) == home_flyers(VELOCITY, 0.0) == 1.0
    assert home_flyers(VELOCITY_V1, 0.2) > 0.8
    assert home_flyers(VELOCITY, 0.2) < 0.2


def test_one_that_holds_still_at_the_bottom_of_its_start_lands():
    assert after(env_of(), STILL)["status"] == UasStatus.LANDED
    assert after(env_of(action="planar"), STILL[:2])["status"] == UasStatus.LANDED


@pytest.mark.parametrize(
    "action",
    [
        [0.0, 0.0, -0.5],  # not at the bottom
        [0.4, 0.0, -1.0],  # not still: it asks for more than the speed of landing
    ],
)
def test_one_that_asks_for_anything_else_does_not_land_at_its_start(action):
    assert after(env_of(), action)["status"] == UasStatus.FLYING


def test_in_v0_it_still_hovers():
    env = env_of(version=uas_coverage_v0)
    assert after(env, STILL, 20)["status"] == UasStatus.FLYING


def test_a_policy_that_goes_home_when_little_is_left_and_is_at_its_start_lands():
    def lands(version, soc_0):
        env = env_of(meadow(waypoints=[waypoint((190.0, 190.0, -8.0), 4.0)], soc_0=soc_0), version)
        info = {}
        while env.agents:
            low = env.swarm_state().x[0, 12] > 0.6
            info = after(env, STILL if low else [0.4, 0.4, 0.0])
        return info["status"] == UasStatus.LANDED

    assert lands(uas_coverage_v1, 0.35)
    assert not lands(uas_coverage_v0, 0.35)


def test_holding_still_at_the_bottom_away_from_home_does_not_count_as_flying_home():
    env = env_of()
    after(env, [1.0, 0.0, -1.0], 6)
    info = after(env, STILL, 6)
    assert info["status"] == UasStatus.FLYING
    assert not info["returning"]


def test_the_landing_place_is_the_bottom_where_it_is_higher():
    on_roof = meadow(starts_m=((100.0, 100.0, -20.0),))
    low_m = 1.5 + 47.0 / 6
    at_start = (20.0 - low_m) / (48.5 - low_m)
    assert after(env_of(on_roof), [0.0, 0.0, at_start])["status"] == UasStatus.LANDED
    assert after(env_of(on_roof), [0.0, 0.0, at_start + 0.01])["status"] == UasStatus.FLYING


def test_a_planner_that_lands_where_it_has_not_left_is_expressed():
    for command in (Velocity(0.0, 0.0, 1.5, "return"), GoTo(None)):
        env = env_of(practice_ground(n_uas=1) if isinstance(command, GoTo) else LOW)
        env.step({"uas_1": env.action_of("uas_1", command)})
        assert env.agents == []


@pytest.mark.parametrize(
    "command",
    [
        Velocity(0.0, 0.0, 1.5),
        Velocity(3.0, 0.0, 1.5, "return"),
        Velocity(0.0, 0.0, 9.0, "return"),
    ],
)
def test_a_command_of_which_it_would_land_otherwise_is_refused(command):
    with pytest.raises(ValueError, match="lands there if it asks to hold still at the bottom"):
        env_of().action_of("uas_1", command)


def test_planar_flies_at_the_mean_height_of_the_waypoints():
    heights = [(60.0, 100.0, -12.0), (140.0, 100.0, -18.0)]
    ground = practice_ground(n_uas=1, waypoints_m=heights)
    env = env_of(ground, action=PLANAR)
    after(env, [0.8, 0.0], 15)
    assert -env.swarm_state().x[0, Z] == pytest.approx(15.0, abs=0.3)


def test_planar_comes_home_and_lands():
    env, info = env_of(action=PLANAR), {"status": UasStatus.FLYING}
    for k in range(80):
        if not env.agents:
            break
        x = env.swarm_state().x[0]
        wish = 0.4 if k < 12 else np.clip(0.02 * (100.0 - x[X]), -0.4, 0.4)
        north = _on_straight_line(float(wish), 1.0, SLOPE_AT_REST)
        info = after(env, [north, 0.0])
    assert info["covered"] == 1
    assert info["status"] == UasStatus.LANDED


def test_a_planner_flies_velocities_of_v1_as_it_flies_by_itself():
    env, world = env_of(practice_ground(n_uas=1)), World(practice_ground(n_uas=1))
    commands = [Velocity(3.0, -2.0, 12.0), Velocity(-20.0, 15.0, 8.0), Velocity(0.0, 0.0, 30.0)]
    for command in [*commands * 3, GoTo(0), GoTo(1), GoTo(None)]:
        env.step({"uas_1": env.action_of("uas_1", command)})
        world.step({"uas_1": command})
        np.testing.assert_allclose(env.swarm_state().x, world.state.x, atol=1e-4)
    assert math.hypot(*world.state.x[0, [VX, VY]]) > 1.0
