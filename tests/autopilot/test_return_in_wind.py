"""Return mode in wind: a gust calls a UAS home for a while, a low charge for good."""

import numpy as np
import pytest
from small_worlds import box, meadow, waypoint

from uas_coverage_env.autopilot.return_mode import has_to_return
from uas_coverage_env.entities.state import LANDED, LOST
from uas_coverage_env.features import constant_wind
from uas_coverage_env.features.wind import Gust, Wind
from uas_coverage_env.flight import rollout
from uas_coverage_env.scenario import sample_scenario, with_disturbances
from uas_coverage_env.simulation import World
from uas_coverage_env.vehicle.layout import DOD, X, Y
from uas_coverage_env.world import GoTo, Velocity

FAR = (waypoint((190.0, 100.0, -20.0), 5.0),)


def away_from_home(place_m, wind=None, return_mode=True, **options):
    """A UAS at a place, in wind, that is brought home from there."""
    scenario = meadow([(100.0, 30.0, -1.0)], waypoints=FAR, max_steps=900)
    world = World(scenario.model_copy(update={"wind": wind}), return_mode=return_mode, **options)
    world.state.uas[0].departed = True
    world.state.x[0, :3] = place_m
    return world


def called(world, steps, altitude_m):
    """Whether return mode has the UAS at each sample, as long as it flies."""
    samples = []
    for _ in range(steps):
        world.step({name: Velocity(0.0, 0.0, altitude_m) for name in world.active})
        samples.append(bool(world.state.uas[0].returning))
    return samples


def test_a_uas_that_a_gust_calls_home_goes_back_to_work_when_it_is_over():
    gust = Gust(at_s=30.0, lasts_s=10.0, peak_mps=7.0, from_deg=180.0)
    wind = Wind(mean_mps=6.0, from_deg=180.0, gusts=(gust,))
    samples = called(away_from_home((150.0, 150.0, -20.0), wind), 80, 20.0)
    assert not any(samples[:30])
    assert any(samples[30:45])
    assert not any(samples[60:])


@pytest.mark.parametrize(("dod", "comes_home"), [(0.2, False), (0.71, True)])
def test_a_uas_that_is_short_of_charge_is_called_until_it_lands(dod, comes_home):
    world = away_from_home((150.0, 150.0, -20.0), Wind(mean_mps=6.0, from_deg=180.0))
    world.state.x[0, DOD] = dod
    samples = called(world, 60, 20.0)
    assert samples == sorted(samples)
    assert samples[-1] == comes_home
    assert (world.state.uas[0].status == LANDED) == comes_home


@pytest.mark.parametrize(("return_mode", "is_lost"), [(True, False), (False, True)])
def test_a_wind_that_a_uas_cannot_hold_against_is_left_for_lower_air(return_mode, is_lost):
    wind = Wind(mean_mps=11.6, from_deg=90.0, reference_height_m=40.0, roughness_m=0.05)
    world = away_from_home((110.0, 20.0, -20.0), wind, return_mode, safety_filter=True)
    world.state.x[0, DOD] = 0.05
    called(world, 400, 48.0)
    assert (world.state.uas[0].status == LOST) == is_lost


def called_from_dod(level):
    """Depth of discharge from which on a UAS 10 m above home is called, in air that rests now."""
    world = World(with_disturbances(meadow([(100.0, 30.0, -1.0)], waypoints=FAR), level, 1))
    world.state.x[0, :3] = 100.0, 30.0, -11.0
    for dod in np.arange(0.6, 0.75, 5e-4):
        world.state.x[0, DOD] = dod
        if has_to_return(world.arena, world.state, 0):
            return float(dod)
    return 1.0


def test_where_gusts_make_landing_long_charge_is_kept_for_waiting_over_home():
    light, moderate, strong = map(called_from_dod, ("light", "moderate", "strong"))
    assert light == moderate
    seconds = (light - strong) / World(meadow()).arena.uas["dod_per_s"][0]
    assert 10.0 < seconds < 30.0


@pytest.mark.parametrize("wind_mps", [0.0, 3.0])
def test_home_is_found_from_above_a_roof_right_below_the_ceiling(wind_mps):
    block = box("block", (60.0, 60.0, -45.6), (90.0, 90.0, 0.0))
    world = World(
        meadow([(100.0, 40.0, -1.0)], obstacles=(block,), waypoints=FAR),
        disturbances=(constant_wind(wind_mps, 180.0),) if wind_mps else None,
        safety_filter=True,
    )
    world.state.uas[0].departed = True
    world.state.x[0, :3] = 75.0, 75.0, -48.4
    while not world.done:
        outcome = world.step({"uas_1": GoTo(None)})
        assert outcome["breaches"][0] == 0
    assert world.state.uas[0].status == LANDED


def flight_home(wind_mps, from_deg, dt_s, dynamics="lpv"):
    """Distances from home [m] at the samples of a flight home from 120 m away, until it lands."""
    scenario = meadow([(100.0, 30.0, -1.0)], waypoints=FAR, dt_s=dt_s)
    wind = (constant_wind(wind_mps, from_deg),) if wind_mps else None
    world = World(scenario, disturbances=wind, dynamics=dynamics)
    world.state.uas[0].departed = True
    world.state.x[0, :3] = 100.0, 150.0, -10.0
    distances_m = []
    while not world.done:
        world.step({"uas_1": GoTo(None)})
        distances_m.append(float(np.hypot(*(world.state.x[0, [X, Y]] - (100.0, 30.0)))))
    assert world.state.uas[0].status == LANDED
    return distances_m


@pytest.mark.parametrize("dt_s", [0.2, 0.5, 1.0, 2.0])
@pytest.mark.parametrize("from_deg", [0.0, 90.0])
def test_in_wind_a_uas_brakes_late_and_lands_where_it_comes_to_rest(from_deg, dt_s):
    distances_m = flight_home(3.0, from_deg, dt_s)
    # 10 s at full speed, 3 s each to reach it and to brake, and what steps do not divide
    assert dt_s * len(distances_m) <= 17.0 + 2.0 * dt_s
    reached = next(k for k, distance_m in enumerate(distances_m) if distance_m < 2.0)
    assert max(distances_m[reached:]) < 2.0


def test_in_a_wind_beyond_half_its_airspeed_a_uas_comes_home_slowly():
    # which a crosswind alone would make 1 s longer
    assert len(flight_home(8.0, 90.0, 1.0)) - len(flight_home(5.0, 90.0, 1.0)) >= 3


@pytest.mark.parametrize("seed", [3024, 3049])
def test_strong_wind_blows_no_uas_over_the_fence_beside_its_home(seed):
    scenario = sample_scenario(seed, (1, 2), (8, 12), (3, 8), disturbances="strong")
    assert rollout(scenario, "nearest-waypoint", seed).violations == ()


def test_the_plant_lands_as_soon_in_wind_as_the_linear_model():
    linear, plant = (len(flight_home(3.0, 90.0, 1.0, kind)) for kind in ("lpv", "nonlinear"))
    assert abs(linear - plant) <= 1


def test_in_still_air_a_uas_lands_as_recorded_flights_and_trained_policies_know_it():
    assert len(flight_home(0.0, 0.0, 1.0)) == 20
