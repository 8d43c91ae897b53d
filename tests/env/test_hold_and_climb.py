"""The waypoint action of v1: to hold, and to climb on the way."""

import numpy as np
import pytest
from practice_grounds import practice_ground

from uas_coverage_env import GoTo, UasStatus, Velocity, World, uas_coverage_v0
from uas_coverage_env.env import HOME_CHOICE, K_WAYPOINTS
from uas_coverage_env.env.actions import CLIMB_CHOICE, HOLD_CHOICE
from uas_coverage_env.env.actions.waypoint import CLIMB_M, WAYPOINT_V1
from uas_coverage_env.env.episode.settings import MissionSettings
from uas_coverage_env.env.policy.interface import MissionInterface
from uas_coverage_env.mission import MissionBrief
from uas_coverage_env.vehicle.layout import VX, VY, X, Y, Z

FAR = practice_ground(n_uas=1, waypoints_m=((180.0, 100.0, -10.0), (20.0, 100.0, -10.0)))


def env_of(ground=FAR, **settings):
    env = uas_coverage_v0.parallel_env(ground, action=WAYPOINT_V1, **settings)
    env.reset(seed=0)
    return env


def after(env, *choices):
    """The state of uas_1 after some choices."""
    for choice in choices:
        env.step(dict.fromkeys(env.agents, choice))
    return env.swarm_state().x[0]


def test_it_holds_and_climbs_whatever_is_open():
    env = uas_coverage_v0.parallel_env(practice_ground(), action=WAYPOINT_V1)
    _, infos = env.reset()
    assert env.action_space("uas_1").n == CLIMB_CHOICE + 1
    mask = infos["uas_1"]["action_mask"].tolist()
    assert mask == [1] * 3 + [0] * (K_WAYPOINTS - 3) + [1, 1, 1]


def test_to_hold_is_to_stop_and_to_keep_place_and_height():
    env = env_of()
    assert np.hypot(*after(env, *[0] * 5)[[VX, VY]]) > 5.0
    stopped = after(env, *[HOLD_CHOICE] * 8)
    stayed = after(env, *[HOLD_CHOICE] * 5)
    np.testing.assert_allclose(stayed[:3], stopped[:3], atol=0.1)


def test_what_it_held_or_climbed_for_is_still_its_target():
    usual = after(env_of(), 0, 0)
    for choice in (HOLD_CHOICE, CLIMB_CHOICE):
        env = env_of()
        after(env, 0, choice)
        # a choice that does not exist keeps the target
        assert after(env, *[K_WAYPOINTS - 1] * 4)[X] > usual[X] > 101.0


def test_it_climbs_on_the_way_and_comes_down_again():
    level, env = after(env_of(), *[0] * 6), env_of()
    above = after(env, 0, *[CLIMB_CHOICE] * 5)
    assert -above[Z] > -level[Z] + 6.0
    assert above[X] == pytest.approx(level[X], abs=3.0)
    for _ in range(15):
        infos = env.step(dict.fromkeys(env.agents, 0))[-1]
    assert infos["uas_1"]["covered"] == 1


def test_it_climbs_no_higher_than_the_fence_allows():
    env = env_of(practice_ground(n_uas=1, waypoints_m=((190.0, 190.0, -10.0),), size_m=200.0))
    after(env, 0, *[HOLD_CHOICE] * 3)
    highest = max(-after(env, CLIMB_CHOICE)[Z] for _ in range(25))
    assert "uas_1" in env.agents
    assert 36.0 < highest < 39.5


def test_without_a_target_it_climbs_where_it_is():
    start = env_of().swarm_state().x[0]
    above = after(env_of(), *[CLIMB_CHOICE] * 5)
    assert -above[Z] > -start[Z] + 6.0
    np.testing.assert_allclose(above[[X, Y]], start[[X, Y]], atol=0.01)


def test_one_that_holds_at_its_start_does_not_land_and_one_sent_home_does():
    env = env_of()
    after(env, HOME_CHOICE)
    assert env.agents == []
    env = env_of()
    after(env, *[HOLD_CHOICE] * 5)
    assert env.agents == ["uas_1"]
    *_, infos = env.step({"uas_1": HOME_CHOICE})
    assert infos["uas_1"]["status"] == UasStatus.LANDED


def test_one_that_holds_on_its_way_home_does_not_count_as_flying_home():
    env = env_of()
    after(env, 0, 0, HOME_CHOICE)
    *_, infos = env.step({"uas_1": HOLD_CHOICE})
    assert not infos["uas_1"]["returning"]
    *_, infos = env.step({"uas_1": CLIMB_CHOICE})
    assert infos["uas_1"]["returning"]


def test_return_mode_flies_home_at_its_own_height_whatever_climbs():
    one = practice_ground(n_uas=1, waypoints_m=((150.0, 100.0, -10.0),))
    climbs, usual = (env_of(one, return_mode=True) for _ in range(2))
    for env in (climbs, usual):
        while not env.step({"uas_1": 0})[-1]["uas_1"]["covered"]:
            pass
    # nothing is left to do: it is called home
    for _ in range(5):
        infos = climbs.step({"uas_1": CLIMB_CHOICE})[-1]
        usual.step({"uas_1": HOME_CHOICE})
        assert infos["uas_1"]["returning"]
        np.testing.assert_array_equal(climbs.swarm_state().x, usual.swarm_state().x)


def test_a_planner_that_holds_and_climbs_is_expressed():
    env = env_of()
    to = next(GoTo(w) for w in range(2) if env.action_of("uas_1", GoTo(w)) == 0)
    after(env, 0, 0)
    altitude_m = -env.swarm_state().x[0, Z]
    assert env.action_of("uas_1", Velocity(0.0, 0.0, altitude_m)) == HOLD_CHOICE
    assert env.action_of("uas_1", GoTo(to.waypoint, climb_m=CLIMB_M)) == CLIMB_CHOICE
    assert env.action_of("uas_1", GoTo(None)) == HOME_CHOICE
    for wrong, why in (
        (Velocity(1.0, 0.0, altitude_m), "holds still"),
        (Velocity(0.0, 0.0, altitude_m, "return"), "holds still"),
        (Velocity(0.0, 0.0, altitude_m + 1.0), "holds at its altitude"),
        (GoTo(to.waypoint, climb_m=3.0), "climbs by 10 m"),
        (GoTo(1 - to.waypoint, climb_m=CLIMB_M), "flying already"),
    ):
        with pytest.raises(ValueError, match=why):
            env.action_of("uas_1", wrong)


def test_what_is_expressed_flies_the_command():
    env, world = env_of(), World(FAR)
    for given in (
        GoTo(0), GoTo(0, climb_m=CLIMB_M), GoTo(0, climb_m=CLIMB_M), "hold", GoTo(None),
        GoTo(None, climb_m=CLIMB_M), GoTo(1), "hold",
    ):  # fmt: skip
        altitude_m = -world.state.x[0, Z]
        command = Velocity(0.0, 0.0, altitude_m) if given == "hold" else given
        env.step({"uas_1": env.action_of("uas_1", command)})
        world.step({"uas_1": command})
        np.testing.assert_array_equal(env.swarm_state().x, world.state.x)


def test_a_policy_that_is_flown_as_a_planner_flies_the_same():
    world = World(FAR)
    flown = MissionInterface(MissionBrief.of(FAR), MissionSettings(action=WAYPOINT_V1))
    env = env_of()
    for choice in (0, CLIMB_CHOICE, CLIMB_CHOICE, HOLD_CHOICE, HOME_CHOICE, CLIMB_CHOICE):
        flown.observe(world.swarm_state())
        world.step(flown.commands({"uas_1": choice}))
        np.testing.assert_array_equal(after(env, choice), world.state.x[0])


def test_a_planner_cannot_climb_downwards():
    world = World(FAR)
    with pytest.raises(ValueError, match="uas_1: climb_m is -1; give 0 or more"):
        world.step({"uas_1": GoTo(0, climb_m=-1.0)})


def test_the_kind_of_v0_does_not_climb():
    env = uas_coverage_v0.parallel_env(FAR, action="waypoint")
    env.reset()
    assert env.action_space("uas_1").n == HOME_CHOICE + 1
    with pytest.raises(ValueError, match="does not climb"):
        env.action_of("uas_1", GoTo(0, climb_m=CLIMB_M))
