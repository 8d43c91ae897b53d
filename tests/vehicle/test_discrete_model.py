"""The discrete model: series, matrices, outputs, and the battery replayed alone."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.linalg import expm

from uas_coverage_env.vehicle import linear_model, load_vehicle, simulate_battery
from uas_coverage_env.vehicle.layout import (
    DELTA_THRUST,
    DOD,
    LIFT,
    N_INPUTS,
    N_STATES,
    PHI,
    TAU_X,
    TAU_Y,
    TAU_Z,
    THETA,
    U_TH,
    VX,
    VY,
    VZ,
    WX,
    X,
    Z,
)

S500 = load_vehicle("s500_v2")
RIGID = slice(X, DOD)
names = st.sampled_from(["s500_v2", "hexacopter"])


def exact_rigid_body(vehicle, dt_s):
    """Matrix exponential of the rigid body with held inputs, written out anew."""
    body = vehicle.airframe
    M = np.zeros((12 + 4, 12 + 4))
    for axis in range(3):
        M[X + axis, VX + axis] = 1.0
        M[PHI + axis, WX + axis] = 1.0
        M[WX + axis, 12 + TAU_X + axis] = 1.0 / body.inertia_kgm2[axis]
    M[VX, THETA], M[VY, PHI] = -body.gravity_mps2, body.gravity_mps2
    M[VX, VX] = M[VY, VY] = -body.drag_kgps / body.mass_kg
    M[VZ, VZ] = -body.drag_vertical_kgps / body.mass_kg
    M[VZ, 12 + LIFT] = -1.0 / body.mass_kg
    whole = expm(M * dt_s)
    return whole[:12, :12], whole[:12, 12:]


@pytest.mark.parametrize("dt_s", [0.5, 1.0, 2.0])
@pytest.mark.parametrize("name", ["s500_v2", "hexacopter"])
def test_the_series_tends_to_the_matrix_exponential_as_its_order_grows(name, dt_s):
    vehicle = load_vehicle(name)
    A, B = exact_rigid_body(vehicle, dt_s)
    decay = np.exp(-dt_s / vehicle.battery.time_constant_th_s)
    errors = []
    for order in range(2, 13):
        model = linear_model(vehicle, 0.5, dt_s, order)
        scale = [*vehicle.torque_max_Nm]
        torque_error = (model.B[RIGID, TAU_X : TAU_Z + 1] - B[:, 1:]) * scale
        lift_error = model.B[RIGID, LIFT] - B[:, 0]
        relaxed = model.A[U_TH, U_TH] - model.A[DOD, U_TH] * (1.0 - decay) * (
            vehicle.battery.resistance_th_ohm * 3600.0 * vehicle.battery.capacity_Ah / dt_s
        )
        errors.append(
            max(
                np.abs(model.A[RIGID, RIGID] - A).max(),
                np.abs(torque_error).max(),
                np.abs(lift_error).max(),
                abs(relaxed - decay),
            )
        )
    large = [error for error in errors if error > 1e-12]
    assert all(later < earlier for earlier, later in pairwise(large))
    assert errors[-1] < 1e-8 if dt_s > 1.0 else errors[-1] < 1e-9


def test_order_four_is_the_lowest_in_which_a_torque_moves_the_position_at_once():
    assert linear_model(S500, 0.1, order=3).B[X, TAU_Y] == 0.0
    assert linear_model(S500, 0.1, order=4).B[X, TAU_Y] != 0.0


def test_the_matrices_are_those_of_the_model_note():
    model = linear_model(S500, 0.1)
    chain = np.ix_([0, 3, 7, 10], [0, 3, 7, 10])
    expected = [
        [1.0, 0.88262, -4.51456, -1.53074],
        [0.0, 0.77488, -8.65850, -4.51456],
        [0.0, 0.0, 1.0, 1.0],
        [0.0, 0.0, 0.0, 1.0],
    ]
    np.testing.assert_allclose(model.A[chain], expected, atol=6e-6)
    torque = model.B[[0, 3, 7, 10], TAU_Y]
    np.testing.assert_allclose(torque, [-24.773, -92.772, 30.303, 60.606], atol=6e-4)
    np.testing.assert_allclose(model.B[[Z, VZ], LIFT], [-0.31646, -0.63291], atol=6e-6)
    np.testing.assert_allclose(model.B[[8, 11], TAU_Z], [18.182, 36.364], atol=6e-4)


@pytest.mark.parametrize(
    ("dod", "current", "per_volt", "per_newton"),
    [(0.1, 11.8695, 0.7429, 0.9129), (0.6, 12.2416, 0.7913, 0.9429)],
)
def test_the_current_map_is_that_of_the_model_note(dod, current, per_volt, per_newton):
    model = linear_model(S500, dod)
    assert model.C[2, U_TH] == pytest.approx(per_volt, abs=6e-5)
    assert model.D[2, DELTA_THRUST] == pytest.approx(per_newton, abs=6e-5)
    hover = model.F[2] + per_volt * S500.battery.polarisation_linearised_V
    assert hover == pytest.approx(current, abs=2e-4)


@settings(max_examples=60, deadline=None, derandomize=True)
@given(
    names,
    st.floats(0.0, 1.0),
    st.floats(0.0, 0.5),
    st.floats(-7.0, 11.0),
    st.sampled_from([0.5, 1.0, 2.0]),
)
def test_outputs_and_battery_rows_are_one_battery(name, dod, u_th_V, excess_N, dt_s):
    vehicle = load_vehicle(name)
    battery = vehicle.battery
    model = linear_model(vehicle, dod, dt_s)
    x, u = np.zeros(N_STATES), np.zeros(N_INPUTS)
    x[DOD], x[U_TH], u[DELTA_THRUST] = dod, u_th_V, excess_N
    soc, voltage, current = model.C @ x + model.D @ u + model.F
    after = model.A @ x + model.B @ u + model.E
    assert soc == 1.0 - dod
    ocv = np.interp(dod, battery.ocv_dod, battery.ocv_V)
    assert voltage == pytest.approx(ocv - u_th_V - battery.resistance_0_ohm * current, abs=1e-9)
    charge = current * dt_s / (3600.0 * battery.capacity_Ah)
    assert after[DOD] == pytest.approx(dod + charge, abs=1e-12)
    settled = battery.resistance_th_ohm * current
    left = np.exp(-dt_s / battery.time_constant_th_s)
    # the series of order 4 leaves 0.013 more than the exponential at 2 s
    assert after[U_TH] == pytest.approx(
        settled + left * (u_th_V - settled), abs=0.014 * abs(u_th_V - settled) + 1e-12
    )


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"dod": -0.01}, "dod is -0.01"),
        ({"dod": 1.01}, "dod is 1.01"),
        ({"dod": float("nan")}, "dod is nan"),
        ({"dod": 0.1, "dt_s": 0.0}, "dt_s is 0"),
        ({"dod": 0.1, "dt_s": 13.0}, "dt_s is 13"),
        ({"dod": 0.1, "dt_s": float("nan")}, "dt_s is nan"),
        ({"dod": 0.1, "order": 1}, "order is 1"),
        ({"dod": 0.1, "order": 1000}, "order is 1000; give a whole number from 2 to 50"),
        ({"dod": "half"}, "dod is 'half'"),
        ({"dod": 0.1, "dt_s": "1"}, "dt_s is '1'"),
        ({"vehicle": "s500_v2", "dod": 0.1}, r"vehicle is 's500_v2'; .* load_vehicle"),
        ({"dod": 0.1, "order": 0}, "order is 0"),
    ],
)
def test_a_linear_model_out_of_range_is_refused(arguments, message):
    with pytest.raises(ValueError, match=message):
        linear_model(**{"vehicle": S500, **arguments})


@pytest.mark.parametrize(
    ("current_A", "soc_0", "dt_s", "message"),
    [
        ([[1.0, 2.0]], 1.0, 1.0, "shape"),
        (3.0, 1.0, 1.0, "shape"),
        ([1.0, float("nan")], 1.0, 1.0, "nan"),
        ([1.0, float("inf")], 1.0, 1.0, "inf"),
        ([1.0], -0.1, 1.0, "soc_0 is -0.1"),
        ([1.0], 1.1, 1.0, "soc_0 is 1.1"),
        ([1.0], float("nan"), 1.0, "soc_0 is nan"),
        ([1.0], 1.0, 0.0, "dt_s is 0"),
        ([1.0], 1.0, 12.5, "dt_s is 12.5"),
        ([1.0], 1.0, None, "dt_s is None"),
        ([1.0], "full", 1.0, "soc_0 is 'full'"),
        ([1.0 + 1.0j], 1.0, 1.0, "dtype complex128; give real numbers"),
    ],
)
def test_a_replay_that_makes_no_sense_is_refused(current_A, soc_0, dt_s, message):
    with pytest.raises(ValueError, match=message):
        simulate_battery(S500, current_A, soc_0, dt_s)


def test_a_replay_needs_a_vehicle_and_not_its_name():
    with pytest.raises(ValueError, match=r"vehicle is 's500_v2'; .* load_vehicle"):
        simulate_battery("s500_v2", [1.0], 1.0)


@settings(max_examples=40, deadline=None, derandomize=True)
@given(
    names,
    st.lists(st.floats(0.0, 30.0), max_size=60),
    st.floats(0.5, 1.0),
    st.sampled_from([0.25, 1.0, 2.0]),
)
def test_a_replayed_current_counts_its_charge_and_never_lifts_the_voltage(
    name, current_A, soc_0, dt_s
):
    vehicle = load_vehicle(name)
    soc, voltage = simulate_battery(vehicle, current_A, soc_0, dt_s)
    assert soc.shape == voltage.shape == (len(current_A),)
    if not current_A:
        return
    capacity = 3600.0 * vehicle.battery.capacity_Ah
    drawn = (soc[0] - soc[-1]) * capacity
    assert drawn == pytest.approx(sum(current_A[:-1]) * dt_s, abs=1e-6)
    assert soc[0] == pytest.approx(soc_0, abs=1e-12)
    ocv = np.interp(1.0 - soc, vehicle.battery.ocv_dod, vehicle.battery.ocv_V)
    drop = vehicle.battery.resistance_0_ohm * np.array(current_A)
    assert (voltage <= ocv - drop + 1e-9).all()
    assert voltage[0] == pytest.approx(ocv[0] - drop[0], abs=1e-9)
