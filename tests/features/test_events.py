"""What each kind of event does to a mission, and that the swarm comes out of it as defined."""

import numpy as np
import pytest
from eventful import STARTS_M, WAYPOINTS, after, corners_m, event, field, hovering
from small_worlds import mover

from uas_coverage_env import MissionBrief, World, rollout
from uas_coverage_env.entities.state import FLYING, LANDED, LOST
from uas_coverage_env.flight.figures import summary
from uas_coverage_env.flight.metrics import accomplished, coverage, home
from uas_coverage_env.vehicle.layout import DOD, LIFT, VX
from uas_coverage_env.world import GoTo, Velocity, Wrench

RESPONSES = pytest.mark.parametrize("then", ["go_on", "hover", "return"])


def flown(*events, **more):
    return rollout(field(*events, **more), "nearest-waypoint")


def all_is_well(flight):
    return accomplished(flight) and not flight.breaches


def test_the_others_cover_what_a_lost_uas_leaves():
    flight = flown(event("uas_lost", 15.0, uas="uas_1"))
    assert home(flight).tolist() == [False, True]
    assert all_is_well(flight)
    assert coverage(flight) == 1.0
    assert summary(flight)["events"] == [{"t_s": 15.0, "kind": "uas_lost", "uas": "uas_1"}]
    assert summary(flight)["violations"] == []


def test_a_lost_uas_is_lost_at_its_sample_and_covers_nothing_there():
    world = hovering(event("uas_lost", 2.0, uas="uas_2"))
    assert after(world, 1).state.uas["status"].tolist() == [FLYING, FLYING]
    assert after(world, 1).state.uas["status"].tolist() == [FLYING, LOST]


@RESPONSES
def test_a_radio_that_is_lost_for_a_while_holds_a_mission_up_and_no_more(then):
    flight = flown(event("radio_lost", 15.0, uas="uas_1", for_s=12.0, then=then))
    assert all_is_well(flight)


@pytest.mark.parametrize(("then", "north_mps"), [("go_on", 2.0), ("hover", 0.0)])
def test_a_uas_without_a_radio_flies_what_the_scenario_says(then, north_mps):
    world = after(hovering(event("radio_lost", 10.0, uas="uas_1", for_s=8.0, then=then)), 10)
    assert world.swarm_state().responds.tolist() == [False, True]
    after(world, 8, Velocity(0.0, 5.0, 20.0))
    deaf, other = world.state.x
    assert other[VX + 1] == pytest.approx(5.0, abs=0.1)
    assert deaf[VX + 1] == pytest.approx(0.0, abs=0.1)
    assert deaf[VX] == pytest.approx(north_mps, abs=0.1)
    assert world.swarm_state().responds.all()
    assert after(world, 8, Velocity(0.0, 5.0, 20.0)).state.x[0, VX + 1] > 4.0


def test_a_wrench_is_not_held_on_without_a_radio():
    world = hovering(event("radio_lost", 3.0, uas="uas_1", for_s=20.0, then="go_on"))
    after(world, 3, Wrench(0.0, 0.0005, 0.0005, 0.0))
    assert np.linalg.norm(world.state.x[0, VX : VX + 3]) > 1.0
    for _ in range(12):
        outcome = world.step(dict.fromkeys(world.active, Velocity(0.0, 0.0, 20.0)))
        assert not outcome["limits_exceeded"].any()
    assert np.linalg.norm(world.state.x[0, VX : VX + 3]) < 0.5


def test_a_uas_without_a_radio_may_return():
    world = after(hovering(event("radio_lost", 10.0, uas="uas_1", for_s=99.0, then="return")), 10)
    assert world.state.x[0, 0] - 40.0 > 12.0
    assert after(world, 25, Velocity(0.0, 0.0, 20.0)).state.uas["status"].tolist() == [
        LANDED,
        FLYING,
    ]


@RESPONSES
def test_all_uas_come_home_when_the_planner_is_lost(then):
    flight = flown(event("planner_lost", 20.0, then=then))
    assert home(flight).all()
    assert not flight.violations
    assert coverage(flight) < 1.0
    assert flight.events[0].uas is None


def test_a_uas_that_starts_late_waits_without_drawing_charge_and_then_works():
    scenario = field(event("late_start", 20.0, uas="uas_1"))
    world = World(scenario)
    after(world, 20)
    np.testing.assert_array_equal(world.state.x[0], World(scenario).state.x[0])
    assert world.state.x[1, DOD] > 0.0
    assert world.swarm_state().responds.all()
    flight = rollout(scenario, "nearest-waypoint")
    assert all_is_well(flight)
    assert (flight.mode[-1] == flight.mode[-1, 0]).all()
    assert (flight.current_A[:20, 0] == 0.0).all()
    assert (flight.voltage_V[:20, 0] > 10.0).all()


def test_a_uas_that_loses_charge_comes_home_with_what_is_left():
    flight = flown(event("charge_lost", 20.0, uas="uas_1", share=0.55))
    assert flight.x[20, 0, DOD] - flight.x[19, 0, DOD] == pytest.approx(0.55, abs=0.01)
    assert all_is_well(flight)
    assert flight.last_sample[0] < flight.last_sample[1]


def test_a_uas_with_a_damaged_motor_draws_more_and_climbs_less_and_comes_home():
    weak = event("motor_degraded", 3.0, uas="uas_1", thrust_share=0.85, power_factor=1.5)
    # later than the flight lasts: where something may act, missions begin with a hover
    plain = flown(event("motor_degraded", 5000.0, uas="uas_1"))
    flight = flown(weak)
    assert flight.disturbances == ("motor_degraded",)
    np.testing.assert_array_equal(flight.x[:3], plain.x[:3])
    np.testing.assert_allclose(
        (flight.voltage_V * flight.current_A)[3, 0] / (plain.voltage_V * plain.current_A)[3, 0],
        1.5,
        rtol=0.15,
    )
    assert all_is_well(flight)
    world = World(field(weak))
    outcome = after(world, 4, Velocity(0.0, 0.0, 49.0)).step(
        dict.fromkeys(world.active, Velocity(0.0, 0.0, 49.0))
    )
    lift_N = outcome["u"][:, LIFT]
    vehicle = world.arena.vehicles[0]
    assert lift_N[0] <= 0.85 * (vehicle["weight_N"] + vehicle["lift_max_N"]) - vehicle["weight_N"]


def test_a_charge_that_is_lost_beyond_the_limit_loses_the_uas_to_its_battery():
    world = hovering(event("charge_lost", 1.0, uas="uas_1", share=0.9))
    assert after(world, 1).state.uas["status"].tolist() == [LOST, FLYING]


def test_a_uas_without_satellites_drifts_as_said_and_comes_home():
    scenario = field(event("gnss_lost", 10.0, uas="uas_1", for_s=20.0, drift_mps=0.3))
    world = World(scenario, seed=3)
    after(world, 9, GoTo(8))
    np.testing.assert_array_equal(world.swarm_state().x, world.state.x)
    after(world, 11, GoTo(8))
    off_m = world.swarm_state().x[0, :3] - world.state.x[0, :3]
    assert np.hypot(*off_m[:2]) == pytest.approx(11 * 0.3, abs=1.0)
    assert off_m[2] == 0.0
    after(world, 20, GoTo(8))
    np.testing.assert_array_equal(world.swarm_state().x, world.state.x)
    flight = rollout(scenario, "nearest-waypoint")
    assert accomplished(flight)


def test_a_dropped_waypoint_is_neither_covered_nor_missed():
    flight = flown(event("waypoint_dropped", 3.0, waypoint=8))
    assert flight.covered[-1] == len(WAYPOINTS) - 1
    assert coverage(flight) == 1.0
    assert all_is_well(flight)


def test_an_added_waypoint_is_covered_and_no_planner_knew_of_it():
    scenario = field(event("waypoint_added", 20.0, position_m=(100.0, 185.0, -20.0), radius_m=5.0))
    assert len(MissionBrief.of(scenario).waypoints) == len(WAYPOINTS)
    world = World(scenario)
    assert len(after(world, 19).swarm_state().uncovered) == len(WAYPOINTS)
    assert len(after(world, 1).swarm_state().uncovered) == len(WAYPOINTS) + 1
    assert len(world.known.waypoints) == len(WAYPOINTS) + 1
    flight = rollout(scenario, "nearest-waypoint")
    assert flight.covered[-1] == len(WAYPOINTS) + 1
    assert all_is_well(flight)


def test_a_new_obstacle_is_flown_round():
    # between waypoints that are still open, and out of the way of anyone who flies there now
    wall_m = corners_m((125.0, 60.0, -50.0), (135.0, 120.0, 0.0))
    crane = event("obstacle_added", 8.0, name="crane", safe_distance_m=2.0, vertices_m=wall_m)
    flight = flown(crane)
    assert all_is_well(flight)
    assert flight.min_obstacle_clearance_m >= 2.36


def test_a_uas_on_which_an_obstacle_falls_is_lost_to_it_by_name():
    on_it_m = corners_m((65.0, 60.0, -50.0), (75.0, 120.0, 0.0))
    tree = event("obstacle_added", 20.0, name="tree", safe_distance_m=2.0, vertices_m=on_it_m)
    (violation,) = flown(tree).violations
    assert (violation.kind, violation.partner, violation.time_s) == ("obstacle", "tree", 21.0)


def test_a_no_fly_zone_is_left_at_once_and_what_lies_in_it_is_dropped():
    starts_m = ((20.0, 20.0, -1.0),)
    zone_m = corners_m((10.0, 70.0, -50.0), (90.0, 130.0, 0.0))
    # when it is closed, a UAS is deep inside
    zone = event("no_fly_zone", 17.0, name="zone", safe_distance_m=2.0, vertices_m=zone_m)
    flight = flown(zone, starts_m=starts_m)
    north_m, east_m = flight.x[:, 0, 0], flight.x[:, 0, 1]
    inside = (north_m > 10.0) & (north_m < 90.0) & (east_m > 70.0) & (east_m < 130.0)
    assert inside[12:18].all()
    assert inside[18:].sum() == flight.breaches == 5
    assert not inside[23:].any()
    assert not flight.violations
    # two were covered before, one lies inside
    assert coverage(flight) == 1.0
    assert flight.covered[-1] == len(WAYPOINTS)
    assert accomplished(flight)


def test_a_moving_obstacle_that_appears_is_avoided_and_was_not_seen_before():
    helicopter = event(
        "moving_obstacle_added", 12.0, name="helicopter", radius_m=5.0, height_m=6.0,
        safe_distance_m=3.0, position_m=(100.0, 190.0, -20.0), velocity_mps=(0.0, -4.0, 0.0),
    )  # fmt: skip
    world = World(field(helicopter))
    assert len(after(world, 11).swarm_state().moving_position_m) == 0
    seen = after(world, 1).swarm_state()
    assert seen.moving_position_m.tolist() == [[100.0, 190.0, -20.0]]
    assert seen.moving_velocity_mps.tolist() == [[0.0, -4.0, 0.0]]
    assert after(world, 2).swarm_state().moving_position_m.tolist() == [[100.0, 182.0, -20.0]]
    assert all_is_well(flown(helicopter))


def test_a_moving_obstacle_that_turns_is_avoided():
    turn = event(
        "moving_obstacle_turns", 12.0, moving_obstacle="mover", velocity_mps=(0.0, -3.0, 0.0)
    )
    given = {"moving_obstacles": (mover((100.0, 190.0, -20.0), (0.0, (1.0, 0.0, 0.0))),)}
    flight = flown(turn, **given)
    assert flight.moving_position_m[[0, 12, 22], 0].tolist() == [
        [100.0, 190.0, -20.0],
        [112.0, 190.0, -20.0],
        [112.0, 160.0, -20.0],
    ]
    assert all_is_well(flight)


def test_a_uas_lands_at_the_alternative_when_its_home_is_closed():
    other_m = (20.0, 100.0, -1.0)
    flight = flown(event("home_closed", 12.0, uas="uas_1", alternative_m=other_m))
    assert all_is_well(flight)
    assert np.linalg.norm(flight.x[-1, 0, :3] - other_m) <= 2.0
    assert np.linalg.norm(flight.x[-1, 1, :3] - STARTS_M[1]) <= 2.0


def test_a_world_that_is_reset_knows_nothing_of_what_happened():
    added = event("waypoint_added", 2.0, position_m=(100.0, 185.0, -20.0), radius_m=5.0)
    world = hovering(added, event("uas_lost", 3.0, uas="uas_1"))
    first = after(world, 4).state.x.copy()
    world.reset()
    assert world.known is world.scenario
    assert len(world.state.uncovered) == 1
    np.testing.assert_array_equal(after(world, 4).state.x, first)


def test_a_rate_draws_the_time_and_the_uas_with_the_seed():
    world = hovering({"kind": "uas_lost", "rate_per_h": 60.0}, max_steps=100_000)
    steps, uas = [], []
    for seed in range(400):
        world.reset(seed)
        steps.append(int(world.state.events[0].step))
        uas.append(int(world.state.events[0].uas))
    assert np.mean(steps) == pytest.approx(60.0, rel=0.15)
    assert np.std(steps) == pytest.approx(60.0, rel=0.2)
    assert np.mean(uas) == pytest.approx(0.5, abs=0.1)
    world.reset(7)
    again = int(world.state.events[0].step), int(world.state.events[0].uas)
    assert again == (steps[7], uas[7])
    world.reset(7, mission=1)
    assert int(world.state.events[0].step) != steps[7]


def test_events_of_one_time_happen_together():
    both = [event("uas_lost", 2.0, uas="uas_1"), event("charge_lost", 2.0, uas="uas_2", share=0.1)]
    world = after(hovering(*both), 2)
    assert world.state.uas["status"].tolist() == [LOST, FLYING]
    assert world.state.x[1, DOD] > 0.1


def test_a_scenario_without_events_keeps_no_memory_for_them():
    world = hovering()
    assert not world.arena.rules["eventful"][0]
    kept = (world.state.events, world.state.measured, world.state.memory, world.state.packs)
    assert {len(array) for array in kept} == {0}
