import numpy as np
import pytest
from small_worlds import box, meadow, mover, waypoint

from uas_coverage_env.entities.outcome import CONTACT_NAMES
from uas_coverage_env.entities.state import FLYING, LOST
from uas_coverage_env.simulation import World
from uas_coverage_env.vehicle.layout import DOD, VX, VY, X
from uas_coverage_env.world import GoTo, Velocity


def hover(world):
    """Every UAS that flies holds its place."""
    state = world.swarm_state()
    return {
        name: Velocity(0.0, 0.0, -state.x[i, 2])
        for i, name in enumerate(state.names)
        if name in state.active
    }


def contacts(outcome):
    return [CONTACT_NAMES[code] for code in outcome["contact"]]


def test_a_fast_uas_does_not_jump_through_a_thin_wall():
    wall = box("wall", (106.0, 80.0, -30.0), (106.01, 120.0, 0.0))
    world = World(meadow([(100.0, 100.0, -10.0)], obstacles=[wall]))
    world.state.x[0, VX] = 12.0
    world.state.uas[0].reference_mps[:] = 12.0, 0.0
    outcome = world.step({"uas_1": Velocity(12.0, 0.0, 10.0)})
    assert world.state.x[0, X] > 106.01 + 0.36
    assert contacts(outcome) == ["obstacle"]
    assert outcome["contact_with"][0] == 0
    assert world.state.uas[0].status == LOST


def test_the_same_flight_beside_the_wall_is_no_contact():
    wall = box("wall", (106.0, 100.4, -30.0), (106.01, 140.0, 0.0))
    world = World(meadow([(100.0, 90.0, -10.0)], obstacles=[wall]))
    world.state.x[0, :2] = 100.0, 100.0
    world.state.x[0, VX] = 12.0
    world.state.uas[0].reference_mps[:] = 12.0, 0.0
    outcome = world.step({"uas_1": Velocity(12.0, 0.0, 10.0)})
    assert contacts(outcome) == ["none"]
    assert outcome["obstacle_clearance_m"][0] == pytest.approx(0.4, abs=1e-6)
    assert world.state.uas[0].status == FLYING


def test_two_uas_that_swap_places_collide():
    world = World(meadow([(96.0, 100.0, -10.0), (104.0, 100.0, -10.0)]))
    for i, speed in enumerate((8.0, -8.0)):
        world.state.x[i, VX] = speed
        world.state.uas[i].reference_mps[:] = speed, 0.0
    outcome = world.step({"uas_1": Velocity(8.0, 0.0, 10.0), "uas_2": Velocity(-8.0, 0.0, 10.0)})
    assert world.state.x[0, X] > world.state.x[1, X] + 5.0
    assert contacts(outcome) == ["uas", "uas"]
    assert outcome["contact_with"].tolist() == [1, 0]
    np.testing.assert_allclose(outcome["separation_m"], 0.0, atol=1e-6)
    assert world.done


def test_a_moving_cylinder_that_passes_between_samples_hits():
    fast = mover((100.0, 60.0, -10.0), (0.0, (0.0, 80.0, 0.0)), safe_distance_m=1.0)
    world = World(meadow([(100.0, 100.0, -10.0)], moving_obstacles=[fast]))
    outcome = world.step(hover(world))
    assert contacts(outcome) == ["moving_obstacle"]
    assert outcome["contact_with"][0] == 0


def test_a_moving_cylinder_that_passes_below_does_not_hit():
    fast = mover((100.0, 60.0, -6.0), (0.0, (0.0, 80.0, 0.0)), safe_distance_m=1.0)
    world = World(meadow([(100.0, 100.0, -10.0)], moving_obstacles=[fast]))
    outcome = world.step(hover(world))
    assert contacts(outcome) == ["none"]
    assert outcome["obstacle_clearance_m"][0] == pytest.approx(1.0)


def test_a_lost_uas_is_out_and_the_others_go_on():
    starts = [(100.0, 100.0, -10.0), (150.0, 150.0, -10.0)]
    world = World(meadow(starts, waypoints=[waypoint((150.0, 170.0, -10.0))]))
    world.state.x[0, 2] = 0.5
    outcome = world.step(hover(world))
    assert contacts(outcome) == ["geofence", "none"]
    assert world.active == ("uas_2",)
    frozen = world.state.x[0].copy()
    for _ in range(4):
        outcome = world.step({"uas_2": GoTo(0)})
    np.testing.assert_array_equal(world.state.x[0], frozen)
    assert contacts(outcome) == ["none", "none"]
    assert not outcome["u"][0].any()
    assert outcome["current_A"][0] == 0.0
    assert np.isinf(outcome["separation_m"]).all()
    assert np.hypot(*world.state.x[1, [VX, VY]]) > 1.0


def test_more_than_the_allowed_depth_of_discharge_loses_the_uas():
    world = World(meadow(dod_max=0.5, soc_0=0.9))
    world.state.x[0, DOD] = 0.5 - 1e-4
    world.step(hover(world))
    assert world.state.x[0, DOD] > 0.5
    assert world.state.uas[0].status == LOST
    world.reset()
    world.state.x[0, DOD] = 0.5 - 2e-3
    outcome = world.step(hover(world))
    assert contacts(outcome) == ["none"]
    assert world.state.uas[0].status == FLYING


def test_a_breach_is_counted_and_no_uas_is_lost():
    starts = [(100.0, 100.0, -10.0), (100.0, 140.0, -10.0)]
    house = box("house", (60.0, 60.0, -9.0), (90.0, 90.0, 0.0))
    world = World(meadow(starts, obstacles=[house]))
    world.state.x[0, :3] = 75.0, 75.0, -10.5
    world.state.x[1, :3] = 75.0, 79.0, -10.5
    outcome = world.step(hover(world))
    # each is 1.5 m over the roof, nearer than 2.36 m, and 4 m from the other, nearer than 5.72 m
    assert outcome["breaches"].tolist() == [2, 2]
    assert contacts(outcome) == ["none", "none"]
    world.state.x[1, 1] = 86.0
    assert world.step(hover(world))["breaches"].tolist() == [1, 1]


def test_nearer_to_the_fence_than_its_margin_is_a_breach():
    world = World(meadow([(100.0, 100.0, -10.0)]))
    world.state.x[0, 2] = -0.3
    outcome = world.step(hover(world))
    assert outcome["breaches"][0] == 1
    assert contacts(outcome) == ["none"]


def test_held_exactly_at_the_margin_is_no_breach_whatever_the_last_digit_is():
    world = World(meadow([(100.0, 100.0, -10.0)]))
    margin_m = world.scenario.geofence.margin_m
    for within_m, breaches in ((1e-10, 0), (1e-8, 1)):
        world.reset()
        world.state.x[0, 2] = -margin_m + within_m
        outcome = world.step(hover(world))
        assert outcome["fence_clearance_m"][0] < margin_m
        assert outcome["breaches"][0] == breaches


def test_the_clearance_is_exact_however_far_the_obstacles_are():
    hut = box("hut", (150.0, 150.0, -4.0), (154.0, 160.0, 0.0))
    world = World(meadow([(10.0, 20.0, -2.0)], obstacles=[hut]))
    outcome = world.step(hover(world))
    assert outcome["obstacle_clearance_m"][0] == pytest.approx(140.0, abs=0.01)
