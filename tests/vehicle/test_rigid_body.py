"""The plant's rigid body against mechanics written with matrices, and how far it can be tilted."""

import numpy as np
import pytest
from flying import NAMES, STEPS_S, load, record_of
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from uas_coverage_env.vehicle import compile_vehicle, lpv_step, plant_step
from uas_coverage_env.vehicle.attitude import body_attitude, tilts_and_turn
from uas_coverage_env.vehicle.layout import (
    DOD,
    N_INPUTS,
    N_STATES,
    PHI,
    PSI,
    TAU_X,
    TAU_Z,
    THETA,
    VX,
    WX,
    WZ,
    X,
)
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
    _rigid_body(record_of(name), x, thrust_N, torque, dx)
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


def turned_after(angles):
    """Body to NED of a UAS that looks where it flies: pitch, then roll, then about its own axis."""
    phi, theta, psi = angles
    return Rotation.from_euler("YXZ", [theta, phi, psi]).as_matrix()


@settings(max_examples=100, deadline=None, derandomize=True)
@given(st.floats(-1.2, 1.2), st.floats(-1.2, 1.2), st.floats(-20.0, 20.0))
def test_roll_pitch_and_yaw_of_a_body_are_those_of_its_tilts_and_turn(phi, theta, psi):
    x = np.zeros(N_STATES)
    x[PHI:WX] = phi, theta, psi
    angles = body_attitude(x)
    np.testing.assert_allclose(rotation(angles), turned_after(x[PHI:WX]), rtol=0, atol=1e-9)
    # the same turn, and not another number of them
    assert abs(angles[2] - psi) < np.pi
    np.testing.assert_allclose(tilts_and_turn(angles), x[PHI:WX], rtol=0, atol=1e-9)


@pytest.mark.parametrize("dt_s", STEPS_S)
def test_a_uas_that_turns_tilts_as_one_that_does_not(dt_s):
    """Nothing depends on its heading, which does what was foretold."""
    record = compile_vehicle(load("s500_v2"), dt_s)
    x, u = np.zeros(N_STATES), np.zeros(N_INPUTS)
    x[[VX, PHI, THETA, WX, WX + 1]] = 3.0, 0.15, -0.1, 0.2 / dt_s, -0.3 / dt_s
    u[TAU_X : TAU_X + 2] = 0.2 * np.array(load("s500_v2").torque_max_Nm[:2])
    turning, asked = x.copy(), u.copy()
    turning[PSI], turning[WZ], asked[TAU_Z] = 2.0, 0.2, 0.3 * load("s500_v2").torque_max_Nm[2]
    linear = turning.copy()
    # one that faces north, and whose tilts do not turn it
    x[WZ] = -np.tan(x[PHI]) * x[WX + 1]
    plant_step(record[()], x, u, x)
    lpv_step(record[()], linear, asked.copy(), linear)
    record["follows_course"] = True
    plant_step(record[()], turning, asked, turning)
    np.testing.assert_array_equal(np.delete(turning, [PSI, WZ]), np.delete(x, [PSI, WZ]))
    assert (turning[PSI], turning[WZ]) == (linear[PSI], linear[WZ])
    assert asked[TAU_Z] > 0.0


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
