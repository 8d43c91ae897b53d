"""The thrust correction f_T: the exact form, the piecewise-linear one, and the fit between them."""

import math
import re
from pathlib import Path

import numpy as np
import pytest
from flying import NAMES, load, names, record_of
from hypothesis import given, settings
from hypothesis import strategies as st

import uas_coverage_env.vehicle
from uas_coverage_env.vehicle import delta_thrust, exact_delta_thrust
from uas_coverage_env.vehicle.layout import N_STATES, THETA, VX, VZ
from uas_coverage_env.vehicle.powertrain import electrical_power_W
from uas_coverage_env.vehicle.thrust_correction import fit_thrust_correction


def level_flight_N(name, speed_mps):
    tilt = math.atan(load(name).trim_tilt_rad_per_mps * speed_mps)
    return exact_delta_thrust(record_of(name), 0.0, 0.0, -tilt, 0.0, speed_mps, 0.0, 0.0)


def vertical_flight_N(name, vz_mps):
    return exact_delta_thrust(record_of(name), 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, vz_mps)


def test_level_flight_costs_what_the_model_note_says():
    watts = [14.586 * level_flight_N("s500_v2", float(speed)) for speed in range(0, 13, 2)]
    expected = [0.0, -2.3, -7.4, -11.4, -9.9, -1.6, 13.0]
    np.testing.assert_allclose(watts, expected, rtol=0, atol=0.05)


@pytest.mark.parametrize(("vz_mps", "extra_W"), [(-3.0, 25.5), (1.5, -13.3)])
def test_climb_and_descent_cost_what_the_model_note_says(vz_mps, extra_W):
    assert 14.586 * vertical_flight_N("s500_v2", vz_mps) == pytest.approx(extra_W, abs=0.05)


def test_level_flight_at_top_speed_costs_the_published_plateau():
    assert 14.586 * level_flight_N("s500_v2", 12.0) == pytest.approx(12.96, abs=0.01)


@pytest.mark.parametrize("name", NAMES)
def test_the_fit_gives_the_digits_in_the_file(name):
    path = Path(uas_coverage_env.vehicle.__file__).with_name(f"{name}.toml")
    text = path.read_text(encoding="utf-8")
    for key, fitted in fit_thrust_correction(load(name)):
        printed = re.search(rf"^{key} = ([0-9.]+)", text, re.MULTILINE)
        assert printed is not None, key
        last_digit = 10.0 ** -len(printed[1].partition(".")[2])
        assert fitted == pytest.approx(float(printed[1]), abs=0.5 * last_digit), key


@pytest.mark.parametrize("name", NAMES)
def test_the_planners_form_meets_the_exact_one_at_hover_and_at_the_limits(name):
    vehicle, record = load(name), record_of(name)
    limits = vehicle.limits
    hover = np.zeros(N_STATES)
    assert delta_thrust(record, hover, 0.0) == 0.0
    assert level_flight_N(name, 0.0) == pytest.approx(0.0, abs=1e-9)
    fast = hover.copy()
    fast[VX] = limits.v_xy_max_mps
    fast[THETA] = -vehicle.trim_tilt_rad_per_mps * fast[VX]
    exact = level_flight_N(name, limits.v_xy_max_mps)
    assert delta_thrust(record, fast, 0.0) == pytest.approx(exact, rel=1e-3)


@pytest.mark.parametrize("name", NAMES)
def test_the_planners_form_overrates_climb_and_descent_by_five_percent_at_most(name):
    """It is convex, so the steeper of the two slopes rules the climb and the other the descent."""
    vehicle, record = load(name), record_of(name)
    x = np.zeros(N_STATES)
    for vz in (-vehicle.limits.v_up_max_mps, vehicle.limits.v_down_max_mps):
        x[VZ] = vz
        exact = vertical_flight_N(name, vz)
        assert -1e-3 <= delta_thrust(record, x, 0.0) - exact < 0.05 * abs(exact)


@pytest.mark.parametrize("name", NAMES)
def test_the_planners_form_never_promises_cheaper_level_flight_than_the_exact_one(name):
    """Its excess is at most 19 W, at 7 m/s, for the S500; for the hexacopter in proportion."""
    vehicle, record = load(name), record_of(name)
    x, excess_W = np.zeros(N_STATES), []
    for speed in np.linspace(0.0, 12.0, 49):
        x[VX], x[THETA] = speed, -vehicle.trim_tilt_rad_per_mps * speed
        excess = delta_thrust(record, x, 0.0) - level_flight_N(name, float(speed))
        excess_W.append(vehicle.power.slope_W_per_N * excess)
    assert min(excess_W) > -0.02
    assert max(excess_W) < 0.101 * vehicle.power.hover_W


@pytest.mark.parametrize("name", NAMES)
def test_hover_power_and_its_slope_are_the_power_trains(name):
    vehicle, record = load(name), record_of(name)
    weight, small = vehicle.weight_N, 1e-3
    assert electrical_power_W(record, weight) == pytest.approx(vehicle.power.hover_W, rel=1e-6)
    rise = electrical_power_W(record, weight + small) - electrical_power_W(record, weight - small)
    assert rise / (2.0 * small) == pytest.approx(vehicle.power.slope_W_per_N, rel=1e-4)


@settings(max_examples=100, deadline=None, derandomize=True)
@given(
    names,
    st.floats(-1e4, 1e4),
    st.lists(st.floats(-1.5, 1.5), min_size=3, max_size=3),
    st.lists(st.floats(-200.0, 200.0), min_size=3, max_size=3),
)
def test_the_exact_form_is_finite_whatever_the_flight(name, lift_N, angles, velocity_mps):
    value = exact_delta_thrust(record_of(name), lift_N, *angles, *velocity_mps)
    assert math.isfinite(value)
    assert value >= -load(name).weight_N


@settings(max_examples=60, deadline=None, derandomize=True)
@given(names, st.floats(0.0, 12.0), st.floats(-math.pi, math.pi), st.floats(-3.0, 1.5))
def test_the_exact_form_does_not_care_about_the_compass(name, speed, course, vz):
    """Heading and course turned together change nothing."""
    tilt = math.atan(load(name).trim_tilt_rad_per_mps * speed)
    record = record_of(name)
    north = exact_delta_thrust(record, 0.5, 0.02, -tilt, 0.0, speed, 0.0, vz)
    turned = exact_delta_thrust(
        record, 0.5, 0.02, -tilt, course, speed * math.cos(course), speed * math.sin(course), vz
    )
    assert turned == pytest.approx(north, abs=1e-9)


@settings(max_examples=60, deadline=None, derandomize=True)
@given(names, st.floats(-4.0, 6.0), st.floats(0.05, 2.0))
def test_more_lift_and_more_climb_cost_more(name, lift_N, more):
    record = record_of(name)
    base = exact_delta_thrust(record, lift_N, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    assert exact_delta_thrust(record, lift_N + more, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0) > base
    assert exact_delta_thrust(record, lift_N, 0.0, 0.0, 0.0, 0.0, 0.0, -more) > base
    assert base == pytest.approx(lift_N, abs=1e-9)
