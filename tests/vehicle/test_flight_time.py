"""One model of flight time: what its parameters mean."""

import pytest

from uas_coverage_env.vehicle import load_vehicle
from uas_coverage_env.vehicle.flight_time import flight_time_s
from uas_coverage_env.vehicle.range import (
    SpeedLimits,
    TravelTimeModel,
    flight_seconds,
    seconds_until,
    speeds_of,
)

SPEEDS = SpeedLimits(level_mps=10.0, climb_mps=3.0, descent_mps=2.0)


def test_of_level_flight_and_descent_at_once_the_slower_decides():
    model = TravelTimeModel(speed_share=0.5, level_s=1.0, vertical_s=2.0, landing_s=4.0)
    assert flight_seconds(model, SPEEDS, 0.0, 100.0, 0.0, 10.0) == 20.0 + 1.0 + 4.0
    assert flight_seconds(model, SPEEDS, 0.0, 5.0, 0.0, 10.0) == 5.0 + 2.0 + 4.0


def test_in_turn_they_add_up():
    model = TravelTimeModel(detour=1.5, in_turn=True, landing_s=4.0)
    assert flight_seconds(model, SPEEDS, 0.0, 100.0, 0.0, 10.0) == 15.0 + 5.0 + 4.0


def test_a_climb_takes_the_climb_rate_and_a_turn_its_time():
    assert flight_seconds(TravelTimeModel(), SPEEDS, 0.0, 0.0, 9.0, 0.0) == 3.0
    assert flight_seconds(TravelTimeModel(), SPEEDS, 2.5, 10.0, 0.0, 0.0) == 3.5


def test_nothing_is_added_for_a_climb_that_there_is_not():
    assert flight_seconds(TravelTimeModel(vertical_s=9.0), SPEEDS, 0.0, 10.0, 0.0, 0.0) == 1.0


def test_the_speeds_are_those_of_the_vehicle():
    limits = load_vehicle("s500_v2").limits
    assert speeds_of(load_vehicle("s500_v2")) == (
        limits.v_xy_max_mps,
        limits.v_up_max_mps,
        limits.v_down_max_mps,
    )


def test_a_battery_lasts_about_as_long_as_it_does_in_the_plant():
    vehicle = load_vehicle("s500_v2")
    power_W, dod_end = vehicle.power.hover_W, 0.8
    simulated_s = flight_time_s(vehicle, power_W, dod_end)
    assert seconds_until(vehicle, 0.0, dod_end, power_W) == pytest.approx(simulated_s, rel=0.03)
