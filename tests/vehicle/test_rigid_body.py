"""The plant's rigid body against mechanics written with matrices, and how far it can be tilted."""

import numpy as np
import pytest
from flying import NAMES, STEPS_S, load, record_of
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from uas_coverage_env.vehicle import (
    DOD,
    N_INPUTS,
    N_STATES,
    PHI,
    PSI,
    TAU_X,
    VX,
    WX,
    X,
    plant_step,
)
from uas_coverage_env.vehicle.deviation import N_DEVIATIONS
from uas_coverage_env.vehicle.plant import _rigid_body

numbers = st.lists(st.floats(-1.0, 1.0), min_size=15, max_size=15)


def rotation(angles):
    """Body to NED, turned by heading, then pitch, then roll."""
    phi, theta, psi = angles
    return Rotation.from_euler("ZYX", [psi, theta, phi]).as_matrix()


@settings(max_examples=200, deadline=None, derandomize=True)
@given(st.sampled_from(NAMES), numbers, st.floats(0.0, 60.0))
def test_the_rigid_body_obeys_newton_and_euler(name, drawn, thrust_N):
    body = load(name).airframe
    drawn = np.array(drawn)
    x = np.zeros(N_STATES)
    x[:DOD] = drawn[:12] * np.repeat([100.0, 15.0, 1.2, 3.0], 3)
    torque = 2.0 * drawn[12:]
    dx = np.full(N_STATES, np.nan)
    _rigid_body(record_of(name), np.zeros(N_DEVIATIONS), x, thrust_N, torque, dx)
    R, omega, inertia = rotation(x[PHI:WX]), x[WX:DOD], np.diag(body.inertia_kgm2)
    np.testing.assert_array_equal(dx[X:VX], x[VX:PHI])
    drag = np.array([body.drag_kgps, body.drag_kgps, body.drag_vertical_kgps]) * x[VX:PHI]
    force = [0.0, 0.0, body.mass_kg * body.gravity_mps2] - thrust_N * R[:, 2] - drag
    np.testing.assert_allclose(dx[VX:PHI], force / body.mass_kg, rtol=0, atol=1e-9)
    spin = np.linalg.solve(inertia, torque - np.cross(omega, inertia @ omega))
    np.testing.assert_allclose(dx[WX:DOD], spin, rtol=0, atol=1e-9)
    # R' = R [omega]x, by a central difference along the Euler rates
    step = 1e-6 * dx[PHI:WX]
    turned = (rotation(x[PHI:WX] + step) - rotation(x[PHI:WX] - step)) / 2e-6
    cross = np.cross(np.eye(3), omega)
    np.testing.assert_allclose(turned, R @ cross, rtol=0, atol=1e-6)


@pytest.mark.parametrize("sign", [-1.0, 1.0])
@pytest.mark.parametrize("dt_s", STEPS_S)
@pytest.mark.parametrize("name", NAMES)
def test_a_torque_held_for_ever_tilts_to_an_angle_and_no_further(name, dt_s, sign):
    """The flight controller asks for one radian at most, and for no more than the yaw rate."""
    record, torques = record_of(name, dt_s), np.array(load(name).torque_max_Nm)
    fastest = load(name).limits.yaw_rate_max_radps
    for axis in range(3):
        x, u, before = np.zeros(N_STATES), np.zeros(N_INPUTS), np.zeros(N_STATES)
        u[TAU_X + axis] = sign * torques[axis]
        for _ in range(round(60.0 / dt_s)):
            before = x.copy()
            plant_step(record, x, u, x)
            assert np.abs(x[PHI:PSI]).max() < 1.02
        if axis < 2:
            assert sign * x[PHI + axis] > 0.7
        else:
            assert sign * (x[PSI] - before[PSI]) == pytest.approx(fastest * dt_s, rel=0.06)
