"""The model of the convex program: the motion and the limits of the vehicle, by its own numbers."""

import numpy as np
import pytest
from uas_coverage_baselines.trajectory.flight_model import (
    excess,
    flight_model,
    fly_inputs,
    reduced_state,
)

from uas_coverage_env.vehicle import compile_vehicle, load_vehicle
from uas_coverage_env.vehicle import layout as S
from uas_coverage_env.vehicle.limits import LIMIT_NAMES

MODEL = flight_model(compile_vehicle(load_vehicle("s500_v2"), 1.0)[()], 0.0)


def vehicle_of(**numbers):
    """A vehicle with some numbers of its own."""
    record = compile_vehicle(load_vehicle("s500_v2"), 1.0).copy()
    for name, value in numbers.items():
        record[name] = value
    return record[()]


def test_the_limits_are_those_of_the_vehicle_less_what_is_kept_back():
    vehicle = vehicle_of(
        v_xy_max_mps=10.0, tilt_max_rad=0.5, rate_max_radps=2.0, v_up_max_mps=4.0,
        v_down_max_mps=2.0, lift_min_N=-8.0, lift_max_N=6.0, alpha_xy_max_radps2=8.0,
        torque_max_Nm=(2.0, 1.0, 0.3), inertia_kgm2=(0.1, 0.25, 0.4),
    )  # fmt: skip
    model = flight_model(vehicle, kept_back=0.1, speed_share=0.5)
    np.testing.assert_allclose(model.norms, 0.9 * np.array([5.0, 0.5, 2.0]))
    np.testing.assert_allclose(model.vertical, 0.9 * np.array([4.0, 2.0]))
    # pitch pushes north, within its torque; roll pushes east, within the angular acceleration
    np.testing.assert_allclose(model.input_high, 0.9 * np.array([4.0, 8.0, 6.0]))
    np.testing.assert_allclose(model.input_low, 0.9 * np.array([-4.0, -8.0, -8.0]))
    full = flight_model(vehicle)
    assert 0.999 < full.norms[0] / 10.0 < 1.0
    assert not full.drift.any()


@pytest.mark.parametrize(
    ("states", "limit"),
    [
        ((1, 5), MODEL.norms[0]),
        ((2, 6), MODEL.norms[1]),
        ((3, 7), MODEL.norms[2]),
        ((9, 9), -MODEL.vertical[0]),
        ((9, 9), MODEL.vertical[1]),
    ],
)
def test_the_excess_is_the_share_beyond_the_limit_that_is_exceeded_most(states, limit):
    start = np.zeros(10)
    one, other = states
    for share, beyond in ((0.99, 0.0), (1.2, 0.2)):
        start[other] = 0.8 * share * limit
        start[one] = (0.6 if one != other else 1.0) * share * limit
        assert excess(MODEL, start) == pytest.approx(beyond)


def test_what_is_flown_in_the_world_is_the_model_and_says_what_share_of_each_limit_it_used():
    vehicle, rng = vehicle_of(), np.random.default_rng(3)
    inputs = rng.uniform(0.3 * MODEL.input_low, 0.3 * MODEL.input_high, (6, 3))
    start = np.zeros(S.N_STATES)
    start[:3], start[S.VX : S.VZ + 1], start[S.DOD] = (5.0, -8.0, -20.0), (3.0, -2.0, 0.5), 0.3
    start[S.PHI : S.THETA + 1] = 0.05, -0.1
    x, u, used = fly_inputs(vehicle, start, inputs)
    np.testing.assert_array_equal(x[0], start)
    for n in range(6):
        expected = MODEL.A @ reduced_state(x[n]) + MODEL.B @ inputs[n]
        np.testing.assert_allclose(reduced_state(x[n + 1]), expected, atol=1e-9)
    np.testing.assert_array_equal(u[:, S.LIFT], inputs[:, 2])
    assert (np.diff(x[:, S.DOD]) > 0.0).all()

    norms = {
        "speed": np.hypot(x[1:, S.VX], x[1:, S.VY]) / vehicle.v_xy_max_mps,
        "climb": -x[1:, S.VZ] / vehicle.v_up_max_mps,
        "descent": x[1:, S.VZ] / vehicle.v_down_max_mps,
        "tilt": np.hypot(x[1:, S.PHI], x[1:, S.THETA]) / vehicle.tilt_max_rad,
        "tilt_rate": np.hypot(x[1:, S.WX], x[1:, S.WY]) / vehicle.rate_max_radps,
    }
    for name, shares in norms.items():
        expected = max(float(shares.max()), 0.0)
        assert used[LIMIT_NAMES.index(name)] == pytest.approx(expected, rel=1e-6), name
    assert 0.0 < used[LIMIT_NAMES.index("current")] < 1.0
    # a battery nearly down has a lower voltage, of which the limit is a larger share
    start[S.DOD] = 0.7
    lower = fly_inputs(vehicle, start, inputs)[2]
    assert used[-1] < lower[-1] < 1.0


def test_the_reduced_state_takes_tilts_and_rates_positive_along_their_axes():
    x = np.arange(1.0, 15.0)
    expected = {0: S.X, 1: S.VX, 4: S.Y, 5: S.VY, 6: S.PHI, 7: S.WX, 8: S.Z, 9: S.VZ}
    reduced = reduced_state(x)
    for at, state in expected.items():
        assert reduced[at] == x[state]
    assert (reduced[2], reduced[3]) == (-x[S.THETA], -x[S.WY])
