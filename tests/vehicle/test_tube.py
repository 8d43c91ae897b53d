"""What a wind other than the one believed in can do: bounds that flights come near and keep."""

import numpy as np
import pytest

from uas_coverage_env.vehicle import load_vehicle
from uas_coverage_env.vehicle.governor import design_velocity_loop, horizontal_axis
from uas_coverage_env.vehicle.tube import belief_gain, tube_of


@pytest.mark.parametrize("name", ["s500_v2", "hexacopter"])
@pytest.mark.parametrize("dt_s", [0.5, 1.0])
def test_no_sequence_of_winds_leads_out_of_the_tube_and_the_worst_to_its_wall(name, dt_s):
    vehicle, steps = load_vehicle(name), 60
    tube = tube_of(vehicle, dt_s, steps)
    A, B = horizontal_axis(vehicle, dt_s)
    gain = np.concatenate([[0.0], design_velocity_loop(vehicle, dt_s).gain])
    closed = A - np.outer(B, gain)
    by_wind = np.array([dt_s - A[0, 1], 1.0 - A[1, 1], 0.0, 0.0])
    rng = np.random.default_rng(0)
    responses = [by_wind]
    for _ in range(steps - 1):
        responses.append(closed @ responses[-1])
    worst = np.sign([response[1] for response in reversed(responses)])
    for winds in (*rng.choice([-1.0, 1.0], (50, steps)), worst):
        error = np.zeros(4)
        for k, wind in enumerate(winds):
            error = closed @ error + by_wind * wind
            assert abs(error[0]) <= tube.position[k + 1] + 1e-9
            assert abs(error[1]) <= tube.velocity + 1e-9
            assert abs(error[2]) <= tube.tilt + 1e-9
    assert abs(error[1]) == pytest.approx(tube.velocity, rel=1e-3)


def test_the_position_grows_and_everything_else_is_bounded():
    tube = tube_of(load_vehicle("s500_v2"), 1.0, 28)
    assert (np.diff(tube.position) > 0.0).all()
    assert tube.position[0] == 0.0
    assert 0.3 < tube.velocity < 0.7
    assert np.rad2deg(tube.tilt) < 1.5


def test_a_loop_that_learns_the_wind_stays_in_a_tube_that_ends():
    vehicle, dt_s, steps = load_vehicle("s500_v2"), 1.0, 60
    tube = tube_of(vehicle, dt_s, steps, learns=True)
    A, B = horizontal_axis(vehicle, dt_s)
    k_velocity, k_tilt, k_rate = design_velocity_loop(vehicle, dt_s).gain
    by_wind = np.array([dt_s - A[0, 1], 1.0 - A[1, 1], -A[2, 1], -A[3, 1]])
    rng = np.random.default_rng(0)
    for winds in (*rng.choice([-1.0, 1.0], (50, steps)), np.ones(steps)):
        error, belief = np.zeros(4), 0.0
        for k, wind in enumerate(winds):
            leans = error[2] + vehicle.trim_tilt_rad_per_mps * belief
            alpha = -(k_velocity * error[1] + k_tilt * leans + k_rate * error[3])
            error = A @ error + B * alpha + by_wind * wind
            belief += belief_gain(dt_s) * (wind - belief)
            assert abs(error[0]) <= tube.position[k + 1] + 1e-9
            assert abs(error[1]) <= tube.velocity + 1e-9
            assert abs(error[2]) <= tube.tilt + 1e-9
    # a wind that stays is found out: it leads off as far as the tube is wide, and no farther
    assert abs(error[0]) == pytest.approx(tube.position[-1], rel=1e-2)
    assert tube.position[14] == pytest.approx(tube.position[-1], rel=1e-2)
    assert tube.position[14] < 0.3 * tube_of(vehicle, dt_s, 14).position[14]
