"""From 0.02 to 10 s a sample, the inner loop keeps the limits and reaches what is asked for."""

import numpy as np
import pytest
from flying import fly, load

from uas_coverage_env.vehicle import compile_vehicle, lpv_step
from uas_coverage_env.vehicle.layout import N_STATES, PHI, THETA, VX, VY, WX, WY, Z
from uas_coverage_env.vehicle.record import MAX_GOVERNOR_ROWS

TOLERANCE = 1.0 + 1e-9


def flown(name, dt_s, commands):
    x = np.zeros(N_STATES)
    x[Z] = -100.0
    return fly(compile_vehicle(load(name), dt_s)[()], lpv_step, commands, x)[0]


@pytest.mark.parametrize("dt_s", [0.02, 0.05, 0.09, 3.0, 10.0])
@pytest.mark.parametrize("name", ["s500_v2", "crazyflie"])
def test_the_inner_loop_keeps_the_limits_whatever_is_asked_for(name, dt_s):
    limits, rng = load(name).limits, np.random.default_rng(7)
    most, held = limits.v_xy_max_mps, max(1, round(1.5 / dt_s))
    wished = rng.uniform(-most, most, (60, 2)).repeat(held, axis=0)
    x = flown(name, dt_s, [(*wish, 100.0) for wish in wished])
    assert np.hypot(x[:, VX], x[:, VY]).max() <= TOLERANCE * limits.v_xy_max_mps
    assert np.hypot(x[:, PHI], x[:, THETA]).max() <= TOLERANCE * limits.tilt_max_rad
    assert np.hypot(x[:, WX], x[:, WY]).max() <= TOLERANCE * limits.rate_max_radps


@pytest.mark.parametrize("dt_s", [0.02, 0.05, 1.0, 10.0])
@pytest.mark.parametrize("name", ["s500_v2", "crazyflie"])
def test_the_inner_loop_reaches_the_top_speed_and_rests(name, dt_s):
    top_mps, steps = load(name).limits.v_xy_max_mps, max(round(20.0 / dt_s), 12)
    x = flown(name, dt_s, [(top_mps, 0.0, 100.0)] * steps + [(0.0, 0.0, 100.0)] * steps)
    assert x[steps, VX] > 0.98 * top_mps
    assert abs(x[-1, VX]) < 0.01 * top_mps


@pytest.mark.parametrize("name", ["s500_v2", "hexacopter", "crazyflie"])
def test_fine_steps_need_few_rows(name):
    record = compile_vehicle(load(name), 0.02)[()]
    assert 0 < record["n_governor_rows"] < 0.8 * MAX_GOVERNOR_ROWS


@pytest.mark.parametrize("dt_s", [0.01, 11.0])
def test_other_sampling_times_are_refused(dt_s):
    with pytest.raises(ValueError, match="dt_s"):
        compile_vehicle(load("s500_v2"), dt_s)
