"""How long vehicles take to stop, and how far guidance and filter therefore look ahead."""

import math
from pathlib import Path

import numpy as np
import pytest
from small_worlds import meadow

from uas_coverage_env.autopilot.lookahead import fly_and_brake
from uas_coverage_env.simulation import World
from uas_coverage_env.vehicle import load_vehicle
from uas_coverage_env.vehicle.layout import DOD, VX, VY, VZ
from uas_coverage_env.vehicle.stopping import AT_REST_MPS, stopping_of
from uas_coverage_env.world import GoTo, Velocity

VEHICLES = Path(__file__).parents[1] / "vehicles"
CRAZYFLIE, AIR_TAXI = "crazyflie", str(VEHICLES / "air_taxi.toml")
STEPS_S = (0.1, 0.2, 0.3, 0.5, 0.7, 1.0, 1.3, 1.5, 1.7, 1.9, 2.0)


def flown_by(*vehicles, dt_s=1.0, size=1.0):
    """The meadow, `size` times as large, with a UAS of each vehicle."""
    starts_m = [(20.0 + 40.0 * i, 20.0, -20.0) for i in range(len(vehicles))]
    made = meadow(starts_m, dt_s=dt_s, max_steps=2000)
    pairs = zip(made.uas, vehicles, strict=True)
    uas = tuple(one.model_copy(update={"vehicle": vehicle}) for one, vehicle in pairs)
    vertices_m = tuple((size * n, size * e, d) for n, e, d in made.geofence.vertices_m)
    far = made.waypoints[0].model_copy(update={"position_m": (size * 190.0, size * 190.0, -20.0)})
    geofence = made.geofence.model_copy(update={"vertices_m": vertices_m})
    return made.model_copy(update={"uas": uas, "geofence": geofence, "waypoints": (far,)})


def lookahead_s(scenario):
    return int(World(scenario).arena.rules["lookahead_steps"][0]) * scenario.dt_s


def with_limits(vehicle, **limits):
    known = load_vehicle(vehicle)
    return known.model_copy(update={"limits": known.limits.model_copy(update=limits)})


@pytest.mark.parametrize("dt_s", STEPS_S)
@pytest.mark.parametrize("vehicle", ["s500_v2", "hexacopter"])
def test_shipped_vehicles_look_14_s_ahead_at_every_sampling_time(vehicle, dt_s):
    steps = World(flown_by(vehicle, dt_s=dt_s)).arena.rules["lookahead_steps"][0]
    assert steps == math.ceil(14.0 / dt_s)


@pytest.mark.parametrize("dt_s", [0.5, 2.0])
@pytest.mark.parametrize("vehicle", [CRAZYFLIE, "s500_v2", AIR_TAXI])
def test_whatever_was_flown_braking_ends_within_the_time_that_is_stated(vehicle, dt_s):
    world = World(flown_by(vehicle, dt_s=dt_s, size=60.0))
    stated_s = stopping_of(world.scenario.vehicles[0], dt_s).time_s
    rng, state = np.random.default_rng(3), world.state
    path_m = np.zeros((round(100.0 / dt_s), 3))
    top_mps = world.scenario.vehicles[0].limits.v_xy_max_mps
    state.x[0, :3], state.uas[0].departed = (6000.0, 6000.0, -20.0), True
    longest_s, command = 0.0, Velocity(0.0, 0.0, 20.0)
    for step in range(250):
        if step % 12 == 0:
            heading = rng.uniform(0.0, 2.0 * np.pi)
            north_mps, east_mps = top_mps * math.cos(heading), top_mps * math.sin(heading)
            command = Velocity(north_mps, east_mps, float(rng.uniform(5.0, 45.0)))
        state.x[0, DOD] = 0.0
        world.step({"uas_1": command})
        brake = world.arena.rules[0].brake
        fly_and_brake(
            world.arena, 0, state.x[0], state.uas[0].reference_mps[:], brake, False, path_m
        )
        speeds_mps = np.linalg.norm(np.diff(path_m, axis=0), axis=1) / dt_s
        longest_s = max(longest_s, dt_s * (np.flatnonzero(speeds_mps > AT_REST_MPS).max() + 1))
    assert 0.5 * stated_s < longest_s <= stated_s


def test_a_vehicle_that_leans_slowly_or_has_little_lift_takes_longer_to_stop():
    taxi = stopping_of(load_vehicle(AIR_TAXI), 1.0)
    slow = stopping_of(with_limits(AIR_TAXI, angular_acceleration_xy_max_radps2=0.05), 1.0)
    weak = stopping_of(with_limits(AIR_TAXI, lift_min_N=-100.0), 1.0)
    assert slow.time_s > taxi.time_s + 2.0
    assert slow.way_m > taxi.way_m + 30.0
    assert weak.time_s == pytest.approx(5.0 * 900.0 / 100.0)


def test_a_fleet_looks_as_far_ahead_as_the_slowest_of_it_needs():
    taxi_s = lookahead_s(flown_by(AIR_TAXI, dt_s=2.0))
    assert taxi_s > 1.15 * stopping_of(load_vehicle(AIR_TAXI), 2.0).time_s
    assert lookahead_s(flown_by("s500_v2", AIR_TAXI, dt_s=2.0)) == taxi_s
    assert lookahead_s(flown_by("s500_v2", CRAZYFLIE, dt_s=2.0)) == 14.0


@pytest.mark.parametrize("dt_s", [0.5, 1.0, 2.0])
@pytest.mark.parametrize("vehicle", [CRAZYFLIE, "s500_v2", AIR_TAXI])
def test_guidance_flies_every_vehicle_at_its_top_speed(vehicle, dt_s):
    world = World(flown_by(vehicle, dt_s=dt_s, size=40.0))
    x, top_mps = world.state.x[0], world.scenario.vehicles[0].limits.v_xy_max_mps
    for _ in range(round(60.0 / dt_s)):
        world.step({"uas_1": GoTo(0)})
    assert math.hypot(x[VX], x[VY]) > 0.98 * top_mps
    assert abs(x[VZ]) < 0.1
