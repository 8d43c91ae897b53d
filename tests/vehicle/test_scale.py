"""Lengths follow from how a fleet stops, and are those of the shipped vehicles for these."""

import pytest
from test_stopping import AIR_TAXI, CRAZYFLIE, flown_by, with_limits

from uas_coverage_env.entities.state import LANDED
from uas_coverage_env.scenario import load_scenario
from uas_coverage_env.simulation import World
from uas_coverage_env.vehicle import load_vehicle
from uas_coverage_env.vehicle.governor import time_scale
from uas_coverage_env.vehicle.scale import braking_s, clock_reserve_s, length_scale
from uas_coverage_env.vehicle.stopping import stopping_of
from uas_coverage_env.world import GoTo
from uas_coverage_env.world.obstacles import route_margin_m


def scale_of(*names, dt_s=1.0):
    return length_scale([load_vehicle(name) for name in names], dt_s)


@pytest.mark.parametrize("dt_s", [0.1, 0.3, 0.5, 1.0, 1.5, 2.0])
@pytest.mark.parametrize("names", [("s500_v2",), ("hexacopter",), ("s500_v2", "hexacopter")])
def test_at_the_shipped_vehicles_lengths_are_what_they_were_chosen_to_be(names, dt_s):
    assert scale_of(*names, dt_s=dt_s) == 1.0


@pytest.mark.parametrize("dt_s", [0.2, 1.0])
def test_a_vehicle_that_stops_in_a_tenth_of_the_way_has_a_tenth_of_the_lengths(dt_s):
    ways_m = {n: stopping_of(load_vehicle(n), dt_s).way_m for n in (CRAZYFLIE, AIR_TAXI)}
    assert scale_of(CRAZYFLIE, dt_s=dt_s) == pytest.approx(ways_m[CRAZYFLIE] / 25.0)
    assert scale_of(AIR_TAXI, dt_s=dt_s) == pytest.approx(ways_m[AIR_TAXI] / 30.0)
    assert 0.02 < scale_of(CRAZYFLIE, dt_s=dt_s) < 0.1
    assert 5.0 < scale_of(AIR_TAXI, dt_s=dt_s) < 8.0


def test_small_vehicles_have_a_quicker_loop_and_the_shipped_multirotors_the_one_they_had():
    for name in ("s500_v2", "hexacopter", AIR_TAXI):
        for dt_s in (0.02, 0.5, 1.0, 2.0):
            assert time_scale(load_vehicle(name), dt_s) == 1.0
    crazyflie = load_vehicle(CRAZYFLIE)
    assert 0.3 < time_scale(crazyflie, 0.2) < 0.5
    sluggish = with_limits(CRAZYFLIE, angular_acceleration_xy_max_radps2=1.25)
    assert time_scale(crazyflie, 0.2) < time_scale(sluggish, 0.2) < 1.0
    assert stopping_of(sluggish, 0.2).time_s > stopping_of(crazyflie, 0.2).time_s


def test_nothing_is_steered_more_quickly_than_steps_allow():
    crazyflie = load_vehicle(CRAZYFLIE)
    assert time_scale(crazyflie, 1.6) == pytest.approx(0.8)
    assert time_scale(crazyflie, 6.0) == time_scale(load_vehicle("s500_v2"), 6.0) == 3.0


@pytest.mark.parametrize("dt_s", [0.1, 2.0, 6.0, 10.0])
@pytest.mark.parametrize("vehicle", ["crazyflie", "s500_v2", AIR_TAXI])
def test_guidance_comes_to_rest_at_home_at_every_sampling_time(vehicle, dt_s):
    """It lands within a centimetre, at less than a millimetre per second."""
    mission = flown_by(vehicle, dt_s=dt_s, size=20.0)
    mission = mission.model_copy(update={"landing_distance_m": 0.01, "landing_speed_mps": 0.001})
    world, known = World(mission), load_vehicle(vehicle)
    far_m = 4.0 * stopping_of(known, dt_s).way_m
    world.state.x[0, :2] += far_m
    world.state.uas[0].departed = True
    most_s = 2.0 * far_m / known.limits.v_xy_max_mps + 90.0 + 30.0 * dt_s
    for _ in range(round(most_s / dt_s)):
        if not world.done:
            world.step({"uas_1": GoTo(None)})
    assert world.state.uas[0].status == LANDED


def test_a_mixed_fleet_has_the_lengths_of_its_largest():
    assert scale_of(CRAZYFLIE, "s500_v2") == 1.0
    assert scale_of("s500_v2", AIR_TAXI, CRAZYFLIE) == scale_of(AIR_TAXI)


def test_braking_takes_as_long_as_the_slowest_needs():
    assert braking_s([load_vehicle("s500_v2")], 1.0) == 14.0
    taxi = load_vehicle(AIR_TAXI)
    assert braking_s([taxi, load_vehicle("s500_v2")], 1.0) > stopping_of(taxi, 1.0).time_s


def test_of_a_short_mission_a_tenth_of_the_clock_is_kept():
    assert clock_reserve_s(30.0, 60.0) == pytest.approx(6.0)
    assert clock_reserve_s(30.0, 300.0) == clock_reserve_s(30.0, 9000.0) == 30.0


def test_routes_keep_what_the_file_says_or_what_follows_from_the_vehicles(tmp_path):
    mission = flown_by(CRAZYFLIE, dt_s=0.2)
    assert route_margin_m(mission) == scale_of(CRAZYFLIE, dt_s=0.2)
    for given_m in (0.0, 0.05):
        given = mission.model_copy(update={"route_margin_m": given_m})
        given.to_file(tmp_path / "given.toml")
        assert route_margin_m(load_scenario(str(tmp_path / "given.toml"))) == given_m
    mission.to_file(tmp_path / "derived.toml")
    assert "route_margin_m" not in (tmp_path / "derived.toml").read_text()


@pytest.mark.parametrize("given_m", [None, 0.05])
def test_the_world_keeps_the_margin_below_the_fences_ceiling(given_m):
    mission = flown_by(CRAZYFLIE).model_copy(update={"route_margin_m": given_m})
    (ceiling_m,) = World(mission).arena.rules["ceiling_m"]
    assert ceiling_m == pytest.approx(50.0 - 0.5 - route_margin_m(mission))
