"""In wind: the inner loop finds out what blows, holds still, keeps its limits, and comes home."""

import sys
from pathlib import Path

import numpy as np
import pytest
from small_worlds import meadow

from uas_coverage_env import load_scenario, rollout
from uas_coverage_env.autopilot.belief import learn, speed_along
from uas_coverage_env.autopilot.return_mode import seconds_to_keep
from uas_coverage_env.entities.state import CONSUMPTION, LANDED, N_BELIEF, WIND
from uas_coverage_env.features import constant_wind
from uas_coverage_env.flight.record import LANDED as FLIGHT_LANDED
from uas_coverage_env.scenario import with_disturbances
from uas_coverage_env.simulation import World
from uas_coverage_env.vehicle.layout import DOD, VX, VY, VZ
from uas_coverage_env.world import Acceleration, GoTo, Velocity

sys.path.insert(0, str(Path(__file__).parents[2] / "benchmarks"))

from return_mode import fly

HOVER = {"uas_1": Velocity(0.0, 0.0, 20.0)}


def windy(wind_mps, from_deg, dynamics="lpv", **options):
    world = World(
        meadow([(100.0, 100.0, -20.0)], max_steps=900),
        dynamics=dynamics,
        disturbances=(constant_wind(wind_mps, from_deg),),
        **options,
    )
    world.state.uas[0].departed = True
    return world


def test_in_still_air_nothing_is_believed_and_nothing_changes():
    flights = []
    for disturbances in (None, ()):
        world = World(meadow(), disturbances=disturbances)
        for _ in range(8):
            world.step({"uas_1": Velocity(8.0, -3.0, 15.0)})
        assert (world.state.uas["belief"] == 0.0).all()
        flights.append(world.state.x.copy())
    assert (flights[0] == flights[1]).all()


@pytest.mark.parametrize("dynamics", ["lpv", "nonlinear"])
@pytest.mark.parametrize(("wind_mps", "from_deg"), [(4.0, 30.0), (10.0, 250.0)])
def test_a_hover_in_steady_wind_comes_to_rest_and_knows_the_wind(wind_mps, from_deg, dynamics):
    world = windy(wind_mps, from_deg, dynamics)
    for _ in range(40):
        world.step(HOVER)
    towards = np.deg2rad(from_deg + 180.0)
    wind = wind_mps * np.array([np.cos(towards), np.sin(towards)])
    np.testing.assert_allclose(
        world.state.uas["belief"][0, WIND : WIND + 2], wind, atol=0.05 * wind_mps
    )
    assert np.abs(world.state.x[0, VX : VZ + 1]).max() < 0.1


@pytest.mark.parametrize("from_deg", [0.0, 90.0, 215.0])
def test_no_limit_is_exceeded_in_ten_metres_per_second(from_deg):
    world = windy(10.0, from_deg, safety_filter=True)
    rng = np.random.default_rng(3)
    command = Velocity(0.0, 0.0, 20.0)
    for step in range(160):
        if step % 8 == 0:
            north_mps, east_mps = rng.uniform(-9.0, 9.0, 2).tolist()
            command = Velocity(north_mps, east_mps, float(rng.uniform(10.0, 40.0)))
        outcome = world.step({"uas_1": command})
        assert outcome["limits_exceeded"][0] == 0
        assert outcome["breaches"][0] == 0


def test_a_velocity_that_the_wind_does_not_allow_is_flown_in_its_direction():
    world = windy(8.0, 270.0)  # it blows to the east
    for _ in range(20):
        world.step({"uas_1": Velocity(11.0, 0.0, 20.0)})
        if world.state.x[0, 0] > 160.0:
            break
    north_mps, east_mps = world.state.x[0, VX], world.state.x[0, VY]
    assert abs(east_mps) < 0.4
    assert 7.0 < north_mps < 9.5  # √(12² - 8²)
    assert speed_along(12.0, 0.0, 8.0, 1.0, 0.0) == pytest.approx(np.sqrt(80.0))
    assert speed_along(12.0, 0.0, 8.0, 0.0, -1.0) == pytest.approx(4.0)
    assert speed_along(12.0, 0.0, 8.0, 0.0, 1.0) == pytest.approx(20.0)


def test_commands_of_all_kinds_know_the_wind():
    world = windy(6.0, 0.0)
    for _ in range(15):
        world.step(HOVER)
    before = world.state.x[0, VX : VY + 1].copy()
    for _ in range(3):
        world.step({"uas_1": Acceleration(0.5, 0.0, 0.0)})
    after = world.state.x[0, VX : VY + 1]
    assert 0.5 < after[0] - before[0] < 2.5
    assert abs(after[1] - before[1]) < 0.1
    for _ in range(200):
        if world.done:
            break
        world.step({"uas_1": GoTo(None)})
    assert world.state.uas[0].status == LANDED


def test_consumption_is_learned_within_its_bounds():
    world = windy(0.0, 0.0)
    vehicle, belief = world.arena.vehicles[0], np.zeros(N_BELIEF)
    x = world.state.x[0].copy()
    for factor, seen in ((1.25, 0.25), (9.0, 1.0), (0.1, -0.3)):
        for step in range(400):
            belief[4:] = (0.0, 0.0, 0.0, 1e-3)
            x[DOD] = 0.2 + factor * 1e-3
            learn(vehicle, belief, 10 + step, 0.2, x)
        assert belief[CONSUMPTION] == pytest.approx(seen, abs=0.01)


def test_what_return_mode_keeps_grows_with_headwind():
    world = windy(1.0, 0.0)
    x, belief = world.state.x[0].copy(), np.zeros(N_BELIEF)
    x[0] += 80.0  # north of home
    kept_s = []
    for north_mps in (0.0, 4.0, 8.0, 10.0):
        belief[WIND] = north_mps
        kept_s.append(seconds_to_keep(world.arena, 0, x, 0.0, belief))
    assert (np.diff(kept_s) > 0.0).all()
    assert kept_s[-1] > kept_s[0] + 40.0


@pytest.mark.parametrize("level", ["moderate", "strong"])
def test_gusts_lead_no_descent_and_no_climb_beyond_their_limits(level):
    world = World(with_disturbances(meadow([(100.0, 100.0, -2.0)], max_steps=900), level, 4))
    for seed in range(6):
        world.reset(seed)
        for step in range(120):
            altitude_m = 2.0 if step % 60 > 20 else 45.0
            outcome = world.step({"uas_1": Velocity(3.0 * (-1) ** (step // 30), 0.0, altitude_m)})
            assert outcome["limits_exceeded"][0] == 0


def test_a_climb_into_wind_that_grows_with_height_ends_within_the_speed_limit():
    strong = with_disturbances(meadow([(30.0, 100.0, -1.0)]), "strong", 4)
    wind = strong.wind.model_copy(update={"mean_mps": 9.2, "from_deg": 180.0})
    world = World(strong.model_copy(update={"wind": wind}))
    for seed in range(100):
        world.reset(seed)
        for _ in range(9):
            outcome = world.step({"uas_1": Velocity(12.0, 0.0, 14.0)})
            assert outcome["limits_exceeded"][0] == 0, seed


@pytest.mark.parametrize(("altitude_m", "limit_mps"), [(2.0, 1.5), (45.0, -3.0)])
def test_a_part_of_the_wind_is_kept_of_the_limits_of_descent_and_climb(altitude_m, limit_mps):
    world = windy(7.0, 0.0)
    for _ in range(10):
        world.step(HOVER)
    for _ in range(4):
        world.step({"uas_1": Velocity(0.0, 0.0, altitude_m)})
    kept_mps = abs(limit_mps) - abs(world.state.x[0, VZ])
    assert kept_mps == pytest.approx(0.04 * 7.0, abs=0.03)


def test_the_way_down_takes_longer_in_wind():
    world = World(meadow(), disturbances=(constant_wind(8.0, 0.0),))
    x, belief, kept_s = world.state.x[0].copy(), np.zeros(N_BELIEF), []
    for altitude_m in (10.0, 40.0):
        x[2] = -altitude_m
        belief[WIND + 1] = 0.0
        still_s = seconds_to_keep(world.arena, 0, x, 0.0, belief)
        belief[WIND + 1] = 8.0
        kept_s.append(seconds_to_keep(world.arena, 0, x, 0.0, belief) - still_s)
    assert kept_s[1] - kept_s[0] > 5.0


@pytest.mark.parametrize(
    "wind", [(2.0, 0.0), (4.0, 90.0), (6.0, 180.0), (8.0, 270.0), (10.0, 45.0)]
)
def test_in_wind_nearest_waypoint_brings_all_home(wind):
    flight = rollout(
        load_scenario("open_field"),
        "nearest-waypoint",
        return_mode=True,
        disturbances=(constant_wind(*wind),),
    )
    assert flight.violations == ()
    assert (flight.mode[-1] == FLIGHT_LANDED).all()
    if wind[0] <= 8.0:
        assert flight.covered[-1] == len(flight.scenario.waypoints)


@pytest.mark.parametrize("wind_mps", [4.0, 8.0])
@pytest.mark.parametrize("family", ["towns", "far", "overhangs"])
def test_random_policies_in_wind_come_home(family, wind_mps):
    tally = fly(family, "away", 80_000, wind_mps)
    assert tally["battery"] == tally["obstacle"] == tally["geofence"] == tally["uas"] == 0
