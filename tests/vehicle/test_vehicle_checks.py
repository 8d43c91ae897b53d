"""A vehicle that contradicts itself is refused; what it leaves out is computed."""

import tomllib

import numpy as np
import pytest
from flying import NAMES, load, record_of
from test_vehicle_params import SHIPPED, changed_file

from uas_coverage_env.files.strict_toml import InputError, StrictModel, parse
from uas_coverage_env.vehicle import (
    VehicleParams,
    compile_vehicle,
    derived,
    load_vehicle,
    lpv_step,
    plant_step,
)
from uas_coverage_env.vehicle.battery import battery_segments
from uas_coverage_env.vehicle.checks import TOLERANCE
from uas_coverage_env.vehicle.layout import DOD, N_INPUTS, N_STATES, U_TH
from uas_coverage_env.vehicle.parts import computed_fields
from uas_coverage_env.vehicle.thrust_correction import fit_thrust_correction

CONTRADICTIONS = {
    "mass": ("mass_kg", 3.77, r"power\.hover_W is 193\.816, but .* take 612\.5 W"),
    "hover too cheap": ("hover_W", 60.0, r"power\.hover_W is 60, but .* take 193\.8 W"),
    "hover too dear": ("hover_W", 900.0, r"power\.hover_W is 900, but .* take 193\.8 W"),
    "slope": ("slope_W_per_N", 20.0, r"power\.slope_W_per_N is 20, but .* take 14\.59 W"),
    "motors": ("n_motors", 6, r"power\.slope_W_per_N is 14\.586, but .* take 11\.67 W"),
    "voltage": (
        "voltage_nominal_V",
        26.1,
        r"battery\.voltage_nominal_V is 26\.1, but .* give 14\.79 V",
    ),
    "six cells": ("ocv_V", [25.2, 23.0, 22.0, 20.0], r"voltage_nominal_V is 14\.8, but .* 22\.4"),
    "linearisation": ("polarisation_linearised_V", 3.0, r"linearised current of a hover off by 7%"),
    "climb": ("climb_N_per_mps", 0.2, r"climb_N_per_mps is 0\.2, but .* 0\.5821 at .* 3;"),
    "tilt": ("tilt_N_per_rad", 20.0, r"tilt_N_per_rad is 20, but .* need 5\.8"),
    "speed": ("speed_N_per_mps", 0.5, r"speed_N_per_mps is 0\.5, but .* 0\.07402 at .* 12;"),
    "drag": ("drag_kgps", 0.2, r"speed_N_per_mps is 0\.074, but"),
    "large propeller": (
        "propeller_radius_m",
        0.254,
        r"speed_N_per_mps is 0\.074, but",
    ),
    "small propeller": ("propeller_radius_m", 0.06, r"torque_Nm_per_radps2.*figure of merit 1\.37"),
    "full throttle": ("speed_max_radps", 1500.0, r"speed_max_radps is 1500, but .* 1290 rad/s"),
    "yaw": ("angular_acceleration_z_max_radps2", 50.0, r"takes 23\.87 N .* has 3\.875 N to spare"),
    "lift": ("lift_max_N", 12.0, r"lift_max_N 12\.0 .*delta_thrust_max_N 11\.6"),
    "thrust": ("delta_thrust_max_N", 40.0, r"rotors lift 51\.58 N .*delta_thrust_max_N 40\.0"),
    "current": ("current_max_A", 10.0, r"current_max_A 10\.0 does not feed a hover.* 13\.57 A"),
    "top speed": ("current_max_A", 14.0, r"current_max_A 14\.0 does not feed limits\.v_xy_max_mps"),
    "cut-off": (
        "voltage_min_V",
        14.5,
        r"voltage_min_V 14\.5 leaves no room for a hover.* 14\.29",
    ),
}


@pytest.mark.parametrize("contradiction", CONTRADICTIONS)
def test_a_contradiction_is_one_line_with_the_value_given_and_the_one_that_follows(
    contradiction, tmp_path
):
    key, value, message = CONTRADICTIONS[contradiction]
    path = changed_file(tmp_path, key, f"{key} = {value}")
    with pytest.raises(InputError, match=message) as caught:
        load_vehicle(path)
    assert str(caught.value).startswith(f"{path}: ")
    assert "\n" not in str(caught.value)


def left_out(vehicle, *keys):
    """The vehicle read again from data that lack some keys."""
    data = vehicle.model_dump(mode="json")
    for section in data.values():
        for key in keys:
            if isinstance(section, dict):
                section.pop(key, None)
    return parse(data, VehicleParams, "data")


FOLLOWING = (
    "hover_W",
    "slope_W_per_N",
    "voltage_nominal_V",
    "polarisation_linearised_V",
    "ocv_dod_linearised",
    "speed_max_radps",
    "speed_N_per_mps",
    "climb_N_per_mps",
    "descent_N_per_mps",
    "tilt_N_per_rad",
)


@pytest.mark.parametrize("name", NAMES)
def test_what_is_left_out_is_computed_as_the_shipped_files_have_it(name):
    shipped, computed = load(name), left_out(load(name), *FOLLOWING)
    for section in ("power", "thrust_correction"):
        for key, value in getattr(computed, section):
            assert value == pytest.approx(getattr(getattr(shipped, section), key), rel=0.01), key
    nominal_V = shipped.battery.voltage_nominal_V
    assert computed.battery.voltage_nominal_V == pytest.approx(nominal_V, rel=0.01)
    # measured on a bench, where the voltage falls below nominal
    assert computed.rotor.speed_max_radps == pytest.approx(1096.0, rel=0.07)


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("dod", [0.05, 0.3, 0.6, 0.85])
def test_a_computed_linearisation_hovers_like_the_exact_current(name, dod):
    record = compile_vehicle(left_out(load(name), *FOLLOWING), 1.0)[()]
    after, currents = np.zeros(N_STATES), []
    for step in (lpv_step, plant_step):
        x = np.zeros(N_STATES)
        x[DOD] = dod
        for _ in range(20):
            _, current = step(record, x, np.zeros(N_INPUTS), after)
            x[U_TH] = after[U_TH]
        currents.append(current)
    assert currents[0] == pytest.approx(currents[1], rel=2e-3)


def test_a_section_that_only_holds_what_follows_may_be_left_out():
    data = load("s500_v2").model_dump(mode="json")
    del data["thrust_correction"]
    computed = parse(data, VehicleParams, "data").thrust_correction
    fitted = fit_thrust_correction(load("s500_v2"))
    assert computed.model_dump() == pytest.approx(fitted.model_dump(), rel=0.01)


def test_a_computed_vehicle_reads_back_as_itself():
    """Flight directories hold the completed file."""
    vehicle = left_out(load("s500_v2"), *FOLLOWING)
    assert parse(vehicle.model_dump(mode="json"), VehicleParams, "data") == vehicle


@pytest.mark.parametrize("name", NAMES)
def test_the_shipped_files_keep_every_value_that_they_give(name):
    data = tomllib.loads(SHIPPED.with_name(f"{name}.toml").read_text(encoding="utf-8"))
    loaded = load(name).model_dump(mode="json")
    for section, values in data.items():
        assert loaded[section] == values


def test_a_payload_changes_what_follows_from_the_mass():
    vehicle = load("s500_v2")
    loaded = vehicle.with_changes(airframe={"mass_kg": 2.0})
    assert loaded.power.hover_W == pytest.approx(258.2, abs=0.05)
    assert loaded.power.slope_W_per_N > vehicle.power.slope_W_per_N
    assert loaded.battery.voltage_nominal_V < vehicle.battery.voltage_nominal_V
    assert loaded.limits == vehicle.limits
    assert battery_segments(loaded)[0].current_A > battery_segments(vehicle)[0].current_A


def test_a_battery_of_more_cells_turns_the_rotors_faster():
    """Five cells for four: what a file may leave out is that of the changed vehicle."""
    vehicle = load("s500_v2")
    cells = {"ocv_V": tuple(1.25 * volts for volts in vehicle.battery.ocv_V), "voltage_min_V": 16.5}
    changed = vehicle.with_changes(battery=cells)
    nominal_V = changed.battery.voltage_nominal_V
    assert nominal_V == pytest.approx(1.25 * vehicle.battery.voltage_nominal_V, rel=0.02)
    full_radps = derived.full_throttle_radps(changed, nominal_V)
    assert changed.rotor.speed_max_radps == pytest.approx(full_radps)
    given = vehicle.with_changes(battery=cells, rotor={"speed_max_radps": 1200.0})
    assert given.rotor.speed_max_radps == 1200.0


def test_every_value_that_may_be_left_out_is_computed_anew():
    fields = {name for _, part in load("s500_v2") if isinstance(part, StrictModel)
              for name in computed_fields(type(part))}  # fmt: skip
    assert fields == set(FOLLOWING)


def test_a_copy_with_a_changed_mass_alone_is_refused():
    vehicle = load("s500_v2")
    heavy = vehicle.airframe.model_copy(update={"mass_kg": 3.77})
    with pytest.raises(ValueError, match=r"hover_W is 193\.816"):
        vehicle.model_copy(update={"airframe": heavy})


def test_changes_of_a_section_that_does_not_exist_are_refused():
    with pytest.raises(ValueError, match=r"unknown section 'body'; a vehicle has airframe, rotor"):
        load("s500_v2").with_changes(body={"mass_kg": 2.0})
    with pytest.raises(ValueError, match="mass"):
        load("s500_v2").with_changes(airframe={"mass": 2.0})


@pytest.mark.parametrize("name", NAMES)
def test_the_shipped_vehicles_contradict_themselves_by_far_less_than_is_allowed(name):
    """Hover current, linearised as the paper does, against the exact one: 1.4 % at most."""
    vehicle, record = load(name), record_of(name)
    worst = 0.0
    for dod in np.linspace(0.0, vehicle.battery.dod_cutoff, 31):
        currents = []
        for step in (lpv_step, plant_step):
            x, after = np.zeros(N_STATES), np.zeros(N_STATES)
            x[DOD] = dod
            for _ in range(12):
                _, current = step(record, x, np.zeros(N_INPUTS), after)
                x[U_TH] = after[U_TH]
            currents.append(current)
        worst = max(worst, abs(currents[0] / currents[1] - 1.0))
    assert 0.01 < worst < 0.3 * TOLERANCE
