"""Corners of the models: other people's vehicles, and questions that have no answer."""

import numpy as np
import pytest
from flying import NAMES, load

from uas_coverage_env.vehicle import (
    compile_vehicle,
    linear_model,
    lpv_step,
    open_circuit_voltage,
    simulate_battery,
)
from uas_coverage_env.vehicle.discharge import open_circuit_V
from uas_coverage_env.vehicle.layout import DOD, N_INPUTS, N_STATES, U_TH, VX


def changed(name, section, **values):
    """A shipped vehicle with some values of a section replaced."""
    return load(name).with_changes(**{section: values})


def test_a_replay_that_empties_the_battery_says_at_which_sample():
    with pytest.raises(ValueError, match=r"at sample 3"):
        simulate_battery(load("s500_v2"), [20.0] * 10, 2.5 * 20.0 / 18000.0)


def test_a_replay_that_overcharges_the_battery_is_refused():
    with pytest.raises(ValueError, match=r"state of charge to 1\.0"):
        simulate_battery(load("s500_v2"), [-20.0] * 10, 1.0)


def test_a_replay_of_no_samples_and_one_from_empty_are_valid():
    soc, voltage = simulate_battery(load("s500_v2"), [], 0.5)
    assert soc.shape == voltage.shape == (0,)
    soc, voltage = simulate_battery(load("s500_v2"), [0.0], 0.0)
    assert soc[0] == 0.0
    assert voltage[0] == pytest.approx(13.2)


@pytest.mark.parametrize("name", NAMES)
def test_the_discharge_curve_is_the_same_compiled_or_not(name):
    record = compile_vehicle(load(name), 1.0)[()]
    depths = np.linspace(-0.5, 1.5, 401)
    compiled = [open_circuit_V(record, depth) for depth in depths]
    np.testing.assert_allclose(open_circuit_voltage(load(name), depths), compiled, atol=1e-12)


@pytest.mark.parametrize("time_constant_s", [0.01, 0.2, 0.7, 1.0, 5.0, 500.0])
@pytest.mark.parametrize("dt_s", [0.25, 1.0, 2.0])
@pytest.mark.parametrize("order", [2, 3, 4, 5])
def test_the_polarisation_settles_for_any_time_constant(time_constant_s, dt_s, order):
    """The cut series of exp(-dt/tau) is no contraction where the step is long for tau."""
    vehicle = changed("s500_v2", "battery", time_constant_th_s=time_constant_s)
    model = linear_model(vehicle, 0.1, dt_s, order)
    x = np.zeros(N_STATES)
    x[DOD] = 0.1
    for _ in range(round(20.0 * time_constant_s / dt_s) + 20):
        before, x = x, model.A @ x + model.E
        x[DOD] = 0.1
        assert x[U_TH] >= before[U_TH] - 1e-12
    current = (model.C @ x + model.F)[2]
    assert x[U_TH] == pytest.approx(vehicle.battery.resistance_th_ohm * current, rel=1e-3)


@pytest.mark.parametrize("order", [2.5, "4", None, float("nan")])
def test_an_order_that_is_no_whole_number_is_refused(order):
    with pytest.raises(ValueError, match="order is"):
        linear_model(load("s500_v2"), 0.1, 1.0, order)


def test_a_step_too_long_for_the_drag_is_refused():
    body = {"drag_kgps": 4.5}
    slow = {"v_xy_max_mps": 1.0, "v_cruise_mps": 1.0}
    kite = load("s500_v2").with_changes(airframe=body, limits=slow)
    assert 0.0 < linear_model(kite, 0.1, 0.25).A[VX, VX] < 1.0
    with pytest.raises(ValueError, match=r"dt_s is 2\.0.*drag"):
        linear_model(kite, 0.1, 2.0)


def test_the_matrices_are_shared_and_cannot_be_written_to():
    model = linear_model(load("s500_v2"), 0.1)
    assert linear_model(load("s500_v2"), 0.2).A is model.A
    for matrix in model:
        with pytest.raises(ValueError, match="read-only"):
            matrix[0] = 1.0


def test_a_compiled_vehicle_belongs_to_its_caller():
    first = compile_vehicle(load("s500_v2"), 1.0)
    first["mass_kg"] = 0.0
    assert compile_vehicle(load("s500_v2"), 1.0)["mass_kg"] == 1.58


def test_however_little_thrust_is_left_no_current_flows_back():
    """A vehicle that may nearly fall: the linearised current would be negative."""
    vehicle = changed("s500_v2", "limits", delta_thrust_min_N=-15.4, lift_min_N=-15.4)
    record = compile_vehicle(vehicle, 1.0)[()]
    x, u = np.zeros(N_STATES), np.zeros(N_INPUTS)
    u[0] = -15.4
    assert linear_model(vehicle, 0.0).F[2] + linear_model(vehicle, 0.0).D[2, 4] * -15.4 < 0.0
    after = np.zeros(N_STATES)
    voltage, current = lpv_step(record, x, u, after)
    assert current == 0.0
    assert after[DOD] == 0.0
    assert voltage == pytest.approx(16.80002)


@pytest.mark.parametrize("dt_s", [0.0199, 10.001, 0.0, -1.0, float("nan")])
def test_the_inner_loop_has_steps_from_a_fiftieth_to_ten_seconds(dt_s):
    with pytest.raises(ValueError, match="dt_s is"):
        compile_vehicle(load("s500_v2"), dt_s)
