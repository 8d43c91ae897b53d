import numpy as np
import pytest
from small_worlds import box, meadow, waypoint

from uas_coverage_env.entities.state import FLYING, LANDED, LOST
from uas_coverage_env.scenario import load_scenario
from uas_coverage_env.simulation import World
from uas_coverage_env.vehicle.layout import DOD, U_TH, VX, VZ
from uas_coverage_env.world import GoTo, Velocity


def test_what_lies_within_reach_of_a_start_is_covered_at_time_zero():
    near, far = waypoint((108.0, 100.0, -7.0)), waypoint((108.0, 100.0, -8.0))
    world = World(meadow([(100.0, 100.0, -1.0)], waypoints=[near, far]))
    # 3-4-5: 8 m to the north and 6 m up is just within 10 m, 7 m up is not
    assert world.state.uncovered.tolist() == [False, True]


def test_coverage_is_never_undone():
    world = World(load_scenario("village"))
    rng = np.random.default_rng(0)
    open_before = world.state.uncovered.copy()
    covered = 0
    for _ in range(80):
        if world.done:
            break
        swarm = world.swarm_state()
        targets = rng.integers(0, len(swarm.uncovered), len(swarm.names))
        commands = {
            name: GoTo(int(target))
            for name, target in zip(swarm.names, targets, strict=True)
            if name in swarm.active
        }
        outcome = world.step(commands)
        assert not (world.state.uncovered & ~open_before).any()
        assert outcome["newly_covered"].sum() == (open_before & ~world.state.uncovered).sum()
        covered += outcome["newly_covered"].sum()
        open_before = world.state.uncovered.copy()
    assert covered >= 1


def test_a_lost_uas_covers_nothing_at_the_sample_of_its_loss():
    wall = box("wall", (106.0, 80.0, -30.0), (107.0, 120.0, 0.0))
    beyond = waypoint((112.0, 100.0, -10.0), 3.0)
    for obstacles, status in (((), FLYING), ((wall,), LOST)):
        world = World(meadow([(100.0, 100.0, -10.0)], obstacles=obstacles, waypoints=[beyond]))
        world.state.x[0, VX] = 12.0
        world.state.uas[0].reference_mps[:] = 12.0, 0.0
        outcome = world.step({"uas_1": Velocity(12.0, 0.0, 10.0)})
        assert world.state.uas[0].status == status
        assert outcome["newly_covered"][0] == (status == FLYING)
        assert world.state.uncovered[0] == (status == LOST)


def test_a_waypoint_that_two_reach_at_once_counts_once():
    starts = [(100.0, 100.0, -10.0), (100.0, 110.0, -10.0)]
    both = waypoint((112.0, 105.0, -10.0), 7.0, weight=3.0)
    world = World(meadow(starts, waypoints=[both]))
    for i in range(2):
        world.state.x[i, VX] = 12.0
        world.state.uas[i].reference_mps[:] = 12.0, 0.0
    outcome = world.step({name: Velocity(12.0, 0.0, 10.0) for name in world.names})
    assert outcome["newly_covered"].tolist() == [1, 0]
    assert outcome["newly_covered_weight"].tolist() == [3.0, 0.0]


def hold(mode="covering"):
    return {"uas_1": Velocity(0.0, 0.0, 10.0, mode)}


def test_a_uas_that_has_not_left_does_not_land_by_itself():
    world = World(meadow([(100.0, 100.0, -10.0)]))
    for _ in range(3):
        world.step(hold())
    assert world.state.uas[0].status == FLYING


def test_a_uas_that_returns_lands_without_having_left():
    world = World(meadow([(100.0, 100.0, -10.0)]))
    outcome = world.step(hold("return"))
    assert world.state.uas[0].status == LANDED
    assert outcome["landed"][0]
    assert outcome["returning"][0]
    assert outcome["current_A"][0] > 10.0
    assert world.done


def test_a_uas_that_has_left_lands_when_it_is_back_and_slow():
    world = World(meadow([(100.0, 100.0, -10.0)]))
    world.state.uas[0].departed = True
    world.state.x[0, :3] = 101.0, 101.0, -10.0
    world.step(hold())
    assert world.state.uas[0].status == LANDED


@pytest.mark.parametrize(("offset_m", "speed_mps"), [(2.1, 0.0), (0.5, 0.9)])
def test_a_uas_too_far_or_too_fast_does_not_land(offset_m, speed_mps):
    world = World(meadow([(100.0, 100.0, -10.0)]))
    world.state.uas[0].departed = True
    world.state.x[0, 0] += offset_m
    world.state.x[0, VX] = speed_mps
    world.state.uas[0].reference_mps[:] = speed_mps, 0.0
    world.step({"uas_1": Velocity(speed_mps, 0.0, 10.0, "return")})
    assert world.state.uas[0].status == FLYING


def test_leaving_is_remembered():
    world = World(meadow([(100.0, 100.0, -10.0)]))
    world.step(hold())
    assert not world.state.uas[0].departed
    for _ in range(6):
        world.step({"uas_1": Velocity(3.0, 0.0, 10.0)})
    assert world.state.uas[0].departed


def test_a_landed_uas_rests_and_its_battery_stays_as_it_is():
    world = World(meadow([(100.0, 100.0, -10.0), (150.0, 150.0, -10.0)]))
    both = {"uas_1": Velocity(0.0, 0.0, 10.0, "return"), "uas_2": Velocity(0.0, 0.0, 10.0)}
    world.state.x[0, VZ] = 0.2
    world.step(both)
    rest = world.state.x[0].copy()
    assert not rest[3:12].any()
    assert rest[DOD] > 0.0
    assert rest[U_TH] > 0.0
    for _ in range(3):
        outcome = world.step({"uas_2": both["uas_2"]})
        np.testing.assert_array_equal(world.state.x[0], rest)
        assert not outcome["u"][0].any()
        assert outcome["current_A"][0] == outcome["voltage_V"][0] == outcome["energy_Wh"][0] == 0.0
    assert world.active == ("uas_2",)


def test_a_landed_uas_is_no_obstacle_to_others():
    world = World(meadow([(100.0, 100.0, -10.0), (100.0, 110.0, -10.0)]))
    both = {"uas_1": Velocity(0.0, 0.0, 10.0, "return"), "uas_2": Velocity(0.0, 0.0, 10.0)}
    world.step(both)
    world.state.x[1, :3] = world.state.x[0, :3]
    outcome = world.step({"uas_2": both["uas_2"]})
    assert world.state.uas["status"].tolist() == [LANDED, FLYING]
    assert outcome["breaches"][1] == 0
