"""The governor: what its rows promise holds for ever; beyond them the UAS is levelled out."""

import math

import numpy as np
import pytest
from flying import NAMES, STEPS_S, load, record_of
from numba import njit

from uas_coverage_env.vehicle.governor import design_velocity_loop, horizontal_axis
from uas_coverage_env.vehicle.inner_loop import (
    reseed_reference,
    velocity_climb_wrench,
    velocity_wrench,
)
from uas_coverage_env.vehicle.layout import (
    N_INPUTS,
    N_STATES,
    PHI,
    PSI,
    TAU_X,
    TAU_Y,
    TAU_Z,
    THETA,
    VX,
    VY,
    WX,
    WY,
    WZ,
    Z,
)
from uas_coverage_env.vehicle.lpv import clip_wrench, fly_kinematics

ROUNDING = 1e-9


def on_the_edge(loop, rng):
    """(velocity, tilt, rate, reference), each (2,), scaled until the first row is at its bound."""
    s = rng.normal(size=(4, 2)) * [[6.0], [0.2], [0.2], [6.0]]
    reached = np.linalg.norm(loop.rows[:, :4] @ s, axis=1) / loop.rows[:, 4]
    return s / max(reached.max(), np.linalg.norm(s[3]) / loop.reference_max_mps)


@pytest.mark.parametrize("dt_s", [0.25, *STEPS_S])
@pytest.mark.parametrize("name", NAMES)
def test_a_state_that_keeps_the_rows_keeps_all_bounds_while_the_reference_is_held(name, dt_s):
    """Rows are dropped and the horizon is cut: a minute of flight shows that nothing is missing."""
    vehicle = load(name)
    loop, limits = design_velocity_loop(vehicle, dt_s), vehicle.limits
    A, B = horizontal_axis(vehicle, dt_s)
    A, B = A[1:, 1:], B[1:]
    rng = np.random.default_rng(2)
    at_rest = np.array([1.0, vehicle.trim_tilt_rad_per_mps, 0.0])
    starts = np.array([on_the_edge(loop, rng) for _ in range(400)])
    s, wanted = starts[:, :3], at_rest[:, None] * starts[:, 3:]
    touched = np.zeros(4)
    for step in range(round(60.0 / dt_s)):
        alpha = -np.einsum("s,nsa->na", loop.gain, s - wanted)
        speed, tilt, rate = np.linalg.norm(s, axis=2).T
        largest = np.array(
            [
                np.linalg.norm(alpha, axis=1).max() / limits.angular_acceleration_xy_max_radps2,
                # what already is cannot be governed: the present state has no rows
                rate.max() / limits.rate_max_radps if step else 0.0,
                tilt.max() / limits.tilt_max_rad if step else 0.0,
                speed.max() / limits.v_xy_max_mps if step else 0.0,
            ]
        )
        assert largest.max() <= 1.0 + ROUNDING
        touched = np.maximum(touched, largest)
        s = np.einsum("ij,nja->nia", A, s) + B[:, None] * alpha[:, None, :]
    assert touched.min() > 0.9


@pytest.mark.parametrize("dt_s", STEPS_S)
@pytest.mark.parametrize("name", NAMES)
def test_a_command_at_an_active_bound_does_not_slip_past_it(name, dt_s):
    """The quadratic of an active bound has no constant but rounding; turning hard keeps it so."""
    record, limits = record_of(name, dt_s), load(name).limits
    x, u, reference = np.zeros(N_STATES), np.zeros(N_INPUTS), np.zeros(2)
    steepest = 0.0
    for k in range(4000):
        # against the velocity, then across: the worst for tilt and rate
        turn = 0.5 * math.pi * (k // max(round(3.0 / dt_s), 1))
        velocity_climb_wrench(
            record, x, reference, 50.0 * math.cos(turn), 50.0 * math.sin(turn), 0.0, u
        )
        fly_kinematics(record, x, u)
        steepest = max(steepest, math.hypot(x[PHI], x[THETA]))
        assert math.hypot(x[WX], x[WY]) <= limits.rate_max_radps + ROUNDING
        assert math.hypot(x[VX], x[VY]) <= limits.v_xy_max_mps + ROUNDING
    assert 0.9 * limits.tilt_max_rad < steepest <= limits.tilt_max_rad + ROUNDING


@pytest.mark.parametrize("name", NAMES)
def test_a_reference_beyond_the_speed_limit_is_brought_back_to_it(name):
    record = record_of(name)
    x, reference, u = np.zeros(N_STATES), np.array([30.0, -40.0]), np.zeros(N_INPUTS)
    velocity_wrench(record, x, reference, 0.0, 0.0, 0.0, u)
    assert np.hypot(*reference) <= load(name).limits.v_xy_max_mps


@pytest.mark.parametrize("dt_s", STEPS_S)
@pytest.mark.parametrize("name", NAMES)
def test_a_reference_far_from_the_velocity_is_dropped_for_the_velocity(name, dt_s):
    """Somebody forgot to reseed it: in steady flight nothing happens."""
    vehicle, record = load(name), record_of(name, dt_s)
    x, reference, u = np.zeros(N_STATES), np.array([-11.9, 0.0]), np.zeros(N_INPUTS)
    x[VX] = 11.0
    x[THETA] = -vehicle.trim_tilt_rad_per_mps * x[VX]
    for _ in range(20):
        velocity_wrench(record, x, reference, 11.0, 0.0, 0.0, u)
        fly_kinematics(record, x, u)
        assert x[VX] == pytest.approx(11.0, abs=0.01)
    np.testing.assert_allclose(reference, [11.0, 0.0], rtol=0, atol=0.01)


@njit(error_model="numpy")
def rest_after_wild_wrenches(vehicle, wishes, rest_steps):
    """Fly wrenches (K, 4), each clipped, then brake.

    Returns the largest share of a torque limit used while braking, that of the norm of roll and
    pitch where the tilt ends inside of its limit, and the last state.
    """
    x, u, reference = np.zeros(N_STATES), np.zeros(N_INPUTS), np.zeros(2)
    for k in range(wishes.shape[0]):
        for number in range(4):
            u[number] = wishes[k, number]
        clip_wrench(vehicle, u)
        fly_kinematics(vehicle, x, u)
    reseed_reference(vehicle, x, reference)
    largest, inside = 0.0, 0.0
    for _ in range(rest_steps):
        velocity_wrench(vehicle, x, reference, 0.0, 0.0, 30.0, u)
        fly_kinematics(vehicle, x, u)
        for k in range(3):
            largest = max(largest, abs(u[TAU_X + k]) / vehicle.torque_max_Nm[k])
        if math.hypot(x[PHI], x[THETA]) < 0.999 * vehicle.tilt_max_rad:
            roll, pitch = u[TAU_X] / vehicle.inertia_kgm2[0], u[TAU_Y] / vehicle.inertia_kgm2[1]
            inside = max(inside, math.hypot(roll, pitch) / vehicle.alpha_xy_max_radps2)
    return largest, inside, x


@pytest.mark.parametrize("seconds", [2, 5, 8])
@pytest.mark.parametrize("dt_s", STEPS_S)
@pytest.mark.parametrize("name", NAMES)
def test_from_any_attitude_the_loop_brakes_to_a_hover_within_its_torques(name, dt_s, seconds):
    """Up to 8 s of random full wrenches tilt the linear model by some radians, at 100 m/s."""
    record, vehicle = record_of(name, dt_s), load(name)
    rng = np.random.default_rng(4)
    largest = np.array([vehicle.limits.lift_max_N, *vehicle.torque_max_Nm])
    for _ in range(50):
        wishes = 1.5 * largest * rng.uniform(-1.0, 1.0, (round(seconds / dt_s), 4))
        used, inside, x = rest_after_wild_wrenches(record, wishes, round(700.0 / dt_s))
        assert used <= 1.0 + ROUNDING
        # more than the norm only where the tilt would leave its limit
        assert inside <= 1.0 + ROUNDING
        np.testing.assert_allclose(x[VX:12], 0.0, rtol=0, atol=1e-6)
        assert x[Z] == pytest.approx(-30.0, abs=1e-6)


@pytest.mark.parametrize("dt_s", STEPS_S)
@pytest.mark.parametrize("name", NAMES)
def test_the_heading_is_brought_to_zero_without_swinging_past_it(name, dt_s):
    record, limits = record_of(name, dt_s), load(name).limits
    for psi in (-3.0, -0.3, 0.02, 1.0):
        x, u, reference = np.zeros(N_STATES), np.zeros(N_INPUTS), np.zeros(2)
        x[PSI] = psi
        for _ in range(round((abs(psi) / limits.yaw_rate_max_radps + 6.0) / dt_s)):
            velocity_wrench(record, x, reference, 5.0, 0.0, 0.0, u)
            fly_kinematics(record, x, u)
            assert abs(u[TAU_Z]) <= load(name).torque_max_Nm[2] + ROUNDING
            assert abs(x[WZ]) <= limits.yaw_rate_max_radps + ROUNDING
            assert math.copysign(1.0, psi) * x[PSI] >= -ROUNDING
        assert x[PSI] == pytest.approx(0.0, abs=1e-9)
