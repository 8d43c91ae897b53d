"""Air taxis: kilometres, 900 kg, one way each; flown on the nonlinear plant."""

import math

import numpy as np
import pytest

from uas_coverage_env import load_planner, load_scenario, load_vehicle, rollout
from uas_coverage_env.compiled.kernels import interpreted
from uas_coverage_env.flight.legs import legs_of
from uas_coverage_env.flight.metrics import accomplished
from uas_coverage_env.independent_check.judge import check
from uas_coverage_env.scenario import warnings
from uas_coverage_env.scenario.families import BUILT_IN
from uas_coverage_env.simulation import World
from uas_coverage_env.vehicle.flight_time import endurance
from uas_coverage_env.vehicle.layout import DOD
from uas_coverage_env.vehicle.plant import mix
from uas_coverage_env.vehicle.record import MAX_MOTORS
from uas_coverage_env.world import Velocity


@pytest.fixture(scope="module")
def city():
    return load_scenario("air_taxi")


@pytest.fixture(scope="module")
def flight(city):
    return rollout(city, load_planner("nearest-waypoint"), dynamics="nonlinear")


def test_every_taxi_lands_at_the_other_vertiport_with_its_reserve(city, flight, tmp_path):
    assert accomplished(flight)
    assert flight.breaches == flight.figures["reserve_breaches"] == 0
    for i, uas in enumerate(city.uas):
        assert math.dist(flight.x[-1, i, :3], uas.land_m) <= city.landing_distance_m
        assert math.dist(uas.start_m, uas.land_m) > 15_000.0
        assert flight.soc[-1, i] >= 0.2
    flight.save(tmp_path / "flight")
    assert check(tmp_path / "flight").problems == []


def test_one_taxi_lands_where_another_took_off(city):
    starts = {uas.start_m: uas.name for uas in city.uas}
    assert [starts.get(uas.land_m) for uas in city.uas] == [None, None, "taxi_1"]


def test_the_energies_of_the_legs_add_up_to_the_record(flight):
    power_W = flight.voltage_V * flight.current_A
    for i, name in enumerate(flight.names):
        legs_Wh = sum(leg.energy_Wh for leg in legs_of(flight) if leg.uas == name)
        recorded_Wh = power_W[:, i].sum() * flight.scenario.dt_s / 3600.0
        assert legs_Wh == pytest.approx(recorded_Wh, rel=1e-9)


def test_the_lpv_model_has_no_minimum_of_power_in_forward_flight():
    taxi = load_vehicle("air_taxi")
    flown, hover_W = endurance(taxi), taxi.power.hover_W
    assert flown.cruise_lpv.power_W > hover_W
    assert flown.longest.power_W < 0.8 * hover_W
    assert 10.0 < flown.longest.speed_mps < 20.0
    assert flown.cruise_nonlinear.power_W < 0.9 * flown.cruise_lpv.power_W


@pytest.mark.parametrize("yaw_Nm", [0.0, 300.0, 6000.0, -6000.0])
def test_what_little_yaw_large_rotors_give_does_not_cost_the_tilt(city, yaw_Nm):
    (taxi, *_), motors_N = World(city).arena.vehicles, np.zeros(MAX_MOTORS)
    torque = np.array([900.0, -900.0, yaw_Nm])
    thrust_N = interpreted(mix)(taxi, 9_000.0, torque, motors_N)
    assert thrust_N == pytest.approx(9_000.0)
    assert torque[:2] == pytest.approx([900.0, -900.0])
    assert abs(torque[2]) == pytest.approx(min(abs(yaw_Nm), 290.0), rel=0.05)


def test_on_a_long_way_home_the_time_for_others_is_no_share_of_the_way(city):
    # taxi_1 has charge for its way of 21.6 km, and for a sixth more: not called home at once
    world = World(city, return_mode=True)
    world.step({name: Velocity(0.0, 0.0, 60.0) for name in world.active})
    assert not world.state.uas["returning"].any()
    # with two thirds of the speed it would need 1078 s, for which the battery does not last
    world.state.x[0, DOD] = 0.30
    world.step({name: Velocity(0.0, 0.0, 60.0) for name in world.active})
    assert world.state.uas["returning"][0]


@pytest.mark.parametrize("seed", range(6))
def test_a_drawn_city_is_feasible_and_each_lands_where_another_took_off(seed):
    city = BUILT_IN["air-taxi"].sized(n_uas=(2, 4), n_waypoints=(4, 10)).of_seed(seed)
    assert warnings(city) == []
    starts = {uas.start_m for uas in city.uas}
    for uas in city.uas:
        assert uas.land_m in starts - {uas.start_m}
        assert 5_000.0 <= math.dist(uas.start_m, uas.land_m) <= 16_000.0
    pads_m = np.array([uas.start_m for uas in city.uas])
    for hull in city.hulls:
        assert hull.signed_distance(pads_m).min() > 600.0
    for time_s in range(0, 1200, 20):
        away_m = np.hypot(*(pads_m[:, None, :2] - city.moving_positions(time_s)[:, :2]).T)
        assert away_m.min() > 700.0
