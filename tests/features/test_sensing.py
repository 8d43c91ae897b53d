"""What is sensed is not what is true: which state is used for what; missions still end well."""

import numpy as np
import pytest
from eventful import WAYPOINTS, after, field, hovering

from uas_coverage_env import World, rollout
from uas_coverage_env.flight.metrics import accomplished, coverage
from uas_coverage_env.vehicle.layout import DOD, VX, VZ, Z
from uas_coverage_env.world import GoTo, Velocity

GOOD = {"position_noise_m": 0.3, "velocity_noise_mps": 0.1, "position_bias_m": 0.3,
        "velocity_bias_mps": 0.05, "charge_bias": 0.01, "delay_steps": 1}  # fmt: skip


def sensed_and_true(world, n_steps):
    """(T, U, 14) of what planners were told and of what was."""
    told, true = [], []
    for _ in range(n_steps):
        after(world, 1, Velocity(0.0, 0.0, 20.0))
        told.append(world.swarm_state().x)
        true.append(world.state.x.copy())
    return np.array(told), np.array(true)


def test_noise_is_new_at_every_sample_and_of_the_spread_that_is_asked_for():
    world = hovering(sensing={"position_noise_m": 2.0, "velocity_noise_mps": 0.5}, max_steps=2000)
    told, true = sensed_and_true(world, 400)
    off = told - true
    np.testing.assert_allclose(off[..., :3].std(axis=0), 2.0, rtol=0.15)
    np.testing.assert_allclose(off[..., VX : VZ + 1].std(axis=0), 0.5, rtol=0.15)
    assert abs(off[..., :6].mean(axis=0)).max() < 0.4
    np.testing.assert_array_equal(off[..., 6:], 0.0)
    assert (off[:, 0] != off[:, 1]).any()
    # the inner loop has an estimate of its own: noise moves no UAS
    assert abs(true[-1, :, Z] + 20.0).max() < 0.01


def test_a_bias_is_drawn_once_for_each_uas_and_mission():
    sensing = {"position_bias_m": 2.0, "velocity_bias_mps": 0.2, "charge_bias": 0.05}
    world = hovering(sensing=sensing, soc_0=0.7)
    told, true = sensed_and_true(world, 5)
    off = told - true
    np.testing.assert_allclose(off, np.broadcast_to(off[0], off.shape), atol=1e-9)
    assert (off[0, 0, :6] != off[0, 1, :6]).all()
    assert off[0, 0, DOD] != 0.0
    # who believes to hover is carried off by what is wrong with the velocity
    share = -true[-1, :, VX] / off[-1, :, VX]
    assert ((share > 0.4) & (share < 1.0)).all()
    world.reset(5)
    others = np.subtract(*sensed_and_true(world, 1))
    assert (others[0, :, :6] != off[0, :, :6]).all()


def test_what_is_told_late_is_what_was_sensed_before():
    world = hovering(sensing={"delay_steps": 3})
    states = [world.state.x.copy()]
    for _ in range(8):
        after(world, 1)
        states.append(world.state.x.copy())
        np.testing.assert_array_equal(world.swarm_state().x, states[max(len(states) - 4, 0)])


def test_a_mission_with_a_good_receiver_is_accomplished():
    flight = rollout(field(sensing=GOOD), "nearest-waypoint")
    assert accomplished(flight)
    assert not flight.breaches


def test_what_counts_is_the_true_position():
    scenario = field(sensing={"position_bias_m": 30.0})
    flight = rollout(scenario, "nearest-waypoint", seed=1, max_steps=120)
    near = [
        (np.linalg.norm(flight.x[:, :, :3] - w["position_m"], axis=2) <= w["radius_m"]).any()
        for w in WAYPOINTS
    ]
    assert coverage(flight) == pytest.approx(np.mean(near))
    assert coverage(flight) < 1.0


def test_the_same_seed_senses_the_same():
    flights = [rollout(field(sensing=GOOD), "nearest-waypoint", seed=s) for s in (4, 4, 5)]
    np.testing.assert_array_equal(flights[0].x, flights[1].x)
    n = min(len(flights[0].x), len(flights[2].x))
    assert (flights[0].x[:n] != flights[2].x[:n]).any()


def test_perfect_sensors_change_nothing():
    plain, perfect = (World(field(sensing=sensing)) for sensing in (None, {}))
    for world in (plain, perfect):
        after(world, 15, GoTo(4))
    np.testing.assert_array_equal(plain.state.x, perfect.state.x)
    np.testing.assert_array_equal(perfect.swarm_state().x, perfect.state.x)
