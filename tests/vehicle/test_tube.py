"""What a wind other than the one believed in can do: bounds that flights come near and keep."""

import numpy as np
import pytest

from uas_coverage_env.vehicle import load_vehicle
from uas_coverage_env.vehicle.governor import design_velocity_loop, horizontal_axis
from uas_coverage_env.vehicle.tube import tube_of


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
