import sys
from pathlib import Path

import numpy as np
import pytest
from small_worlds import box, meadow, waypoint

from uas_coverage_env.autopilot.return_mode import seconds_home, seconds_to_keep
from uas_coverage_env.entities.state import FLYING, LANDED
from uas_coverage_env.scenario import generate_scenario
from uas_coverage_env.simulation import World
from uas_coverage_env.vehicle.layout import DOD, VX
from uas_coverage_env.world import GoTo, Velocity

sys.path.insert(0, str(Path(__file__).parents[2] / "benchmarks"))

from return_mode import FAMILIES, fly

AWAY = {"uas_1": Velocity(6.0, 6.0, 20.0)}
HOVER = {"uas_1": Velocity(0.0, 0.0, 20.0)}


def fly_until_done(world, commands, max_steps=600):
    for _ in range(max_steps):
        if world.done:
            return
        world.step({name: commands[name] for name in world.active})


@pytest.mark.parametrize("return_mode", [True, False])
def test_a_uas_comes_home_before_its_battery_is_empty(return_mode):
    world = World(meadow(soc_0=0.5, dod_max=0.6, max_steps=1000), return_mode=return_mode)
    for _ in range(10):
        world.step(AWAY)
    fly_until_done(world, HOVER)
    assert (world.state.uas[0].status == LANDED) == return_mode
    assert world.state.uas[0].returning == return_mode
    if return_mode:
        # the reserve is not so large that the battery is left unused
        assert 0.56 < world.state.x[0, DOD] < 0.6


def test_a_uas_comes_home_before_the_mission_ends():
    world = World(meadow(max_steps=120), return_mode=True)
    for _ in range(10):
        world.step(AWAY)
    fly_until_done(world, HOVER)
    assert world.state.uas[0].status == LANDED
    assert 80 < world.state.step[0] <= 120


def test_all_come_home_when_everything_is_covered():
    world = World(
        meadow([(100.0, 100.0, -1.0)], waypoints=[waypoint((130.0, 100.0, -10.0), 8.0)]),
        return_mode=True,
    )
    for _ in range(100):
        if world.done:
            break
        outcome = world.step({"uas_1": Velocity(6.0, 0.0, 10.0)})
        assert outcome["returning"][0] == world.state.uas[0].returning
    assert not world.state.uncovered.any()
    assert world.state.uas[0].status == LANDED


def test_return_mode_stays_on_and_overrides_the_planner():
    world = World(meadow(max_steps=120), return_mode=True)
    returning = []
    for _ in range(120):
        if world.done:
            break
        outcome = world.step(AWAY if world.state.step[0] < 10 else {"uas_1": GoTo(0)})
        returning.append(bool(outcome["returning"][0]))
    first = returning.index(True)
    assert all(returning[first:])
    assert world.state.uas[0].status == LANDED


def test_without_return_mode_only_the_planner_returns():
    world = World(meadow())
    outcome = world.step(AWAY)
    assert not outcome["returning"][0]
    outcome = world.step({"uas_1": GoTo(None)})
    assert outcome["returning"][0]
    assert not world.state.uas[0].returning


def test_the_time_home_grows_with_the_distance():
    world = World(meadow([(100.0, 100.0, -1.0)]))
    x = world.state.x[0].copy()
    times_s = []
    for away_m in (0.0, 20.0, 60.0):
        x[0] = 100.0 + away_m
        times_s.append(seconds_home(world.arena, 0, x))
    np.testing.assert_allclose(np.diff(times_s), [20.0 / 8.0, 40.0 / 8.0])


def test_a_whole_town_comes_home_from_a_random_walk():
    scenario = generate_scenario(7, n_uas=3, n_waypoints=16, n_obstacles=6)
    scenario = scenario.model_copy(update={"max_steps": 140})
    world = World(scenario, return_mode=True, safety_filter=True)
    rng = np.random.default_rng(1)
    commands = {}
    while not world.done and world.state.step[0] < 140:
        if world.state.step[0] % 5 == 0:
            commands = {
                name: Velocity(*rng.uniform([-10, -10, 5], [10, 10, 30])) for name in world.names
            }
        world.step({name: commands[name] for name in world.active})
    assert (world.state.uas["status"] == LANDED).all()
    assert FLYING not in world.state.uas["status"]


def budgeted(world, seconds):
    """Leave the only UAS charge for so long."""
    uas = world.arena.uas[0]
    world.state.x[0, DOD] = uas["dod_max"] - seconds * uas["dod_per_s"]


def comes_home(world, command, max_steps=400):
    for _ in range(max_steps):
        if world.done:
            break
        world.step({"uas_1": command})
    return world.state.uas[0].status == LANDED


@pytest.mark.parametrize("budget_s", np.arange(18.0, 34.0, 0.25))
def test_a_uas_that_flies_off_at_full_speed_is_called_while_it_can_still_turn(budget_s):
    world = World(meadow([(30.0, 100.0, -1.0)], max_steps=600), return_mode=True)
    budgeted(world, budget_s)
    assert comes_home(world, Velocity(12.0, 0.0, 2.0))


@pytest.mark.parametrize("budget_s", np.arange(60.0, 100.0, 2.5))
def test_a_uas_low_behind_a_high_roof_is_called_in_time_to_climb_over_it(budget_s):
    wall = box("wall", (60.0, 0.5, -30.0), (66.0, 199.5, 0.0))
    target = waypoint((180.0, 180.0, -40.0), 4.0)
    world = World(
        meadow([(30.0, 100.0, -1.0)], obstacles=[wall], waypoints=[target], max_steps=600),
        return_mode=True,
        safety_filter=True,
    )
    assert not world.arena.obstacles["tall"].any()
    world.state.x[0, :3] = (90.0, 100.0, -3.0)
    world.state.uas[0].departed = True
    budgeted(world, budget_s)
    assert comes_home(world, Velocity(12.0, 3.0, 3.0))


def test_what_has_to_be_kept_grows_with_speed_away_from_home_and_with_roofs():
    wall = box("wall", (60.0, 0.5, -30.0), (66.0, 199.5, 0.0))
    free, walled = (
        World(meadow([(30.0, 100.0, -1.0)], obstacles=obstacles), return_mode=True)
        for obstacles in ([], [wall])
    )
    x = free.state.x[0].copy()
    x[:3] = (90.0, 100.0, -3.0)
    left_s = 60.0
    at_rest_s = seconds_to_keep(free.arena, 0, x, left_s)
    x[VX] = 12.0
    away_s = seconds_to_keep(free.arena, 0, x, left_s)
    assert away_s > at_rest_s + 3.0
    # 27 m up and 29 m down
    assert seconds_to_keep(walled.arena, 0, x, left_s) > away_s + 20.0


FORMERLY_LOST = (
    ("towns", "fast", 50_015),
    ("crowd", "fast", 50_033),
    ("hexacopters", "fast", 50_088),
    ("short_steps", "fast", 50_083),
    ("hexagon", "fast", 50_037),
    ("clutter", "away", 50_049),
    ("clutter", "fast", 50_002),
    ("overhangs", "fast", 50_046),
)


@pytest.mark.parametrize(("family", "policy", "seed"), FORMERLY_LOST)
def test_random_policies_on_which_uas_were_lost_bring_them_home(family, policy, seed):
    tally = fly(family, policy, seed)
    assert tally["battery"] == tally["still flying"] == tally["breaches"] == 0
    assert tally["charge left"] > 0


@pytest.mark.parametrize("family", FAMILIES)
def test_a_flight_for_the_benchmark_ends_with_all_at_home(family):
    tally = fly(family, "away", 60_000)
    assert tally["flights"] >= 1
    assert sum(tally[name] for name in ("battery", "obstacle", "uas", "geofence")) == 0
